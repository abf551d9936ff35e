"""Export of a 3D scan: a cloud as PLY, the range image as .npz, both as a record (MCAP) for Foxglove.

/scan3d   application/octet-stream   the .npz of one scan
/cloud    foxglove.PointCloud, JSON  its points in base_link: x, y, z (m) and intensity, float32
"""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
from mcap.writer import CompressionType, Writer

from onboard.config import Rover
from onboard.perception.scan.scan3d import Pixels, Points, Scan3d, points

_VERTEX = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("tilt", "<f4"), ("time", "<f4")])
_PACKED = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4")])
_FLOAT32 = 7  # of foxglove.PackedElementField


def write_ply(scan: Scan3d, rover: Rover, path: Path) -> None:
    """Write the points: x, y, z (m, base_link), intensity (-1 without), tilt (rad), time (s since the first beam)."""
    made = points(scan, rover)
    vertices = _fill(np.empty(len(made.xyz_m), _VERTEX), made)
    vertices["tilt"] = made.pixels["tilt_rad"]
    vertices["time"] = (made.pixels["time_ns"] - scan.pixels["time_ns"].min()) * 1e-9
    rows = "".join(f"property float {name}\n" for name in _VERTEX.names or ())
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment one sweep of a tilting scanner\n"
        "comment frame base_link (the rover's): metres, x ahead, y left, z up\n"
        f"element vertex {len(vertices)}\n{rows}end_header\n"
    )
    path.write_bytes(head.encode("ascii") + vertices.tobytes())


def npz_bytes(scan: Scan3d) -> bytes:
    """Encode the image: a key for each field of a pixel, (lines, beams), and first_angle_rad, step_rad."""
    fields = {name: scan.pixels[name] for name in scan.pixels.dtype.names or ()}
    file = io.BytesIO()
    np.savez_compressed(file, first_angle_rad=scan.first_angle_rad, step_rad=scan.step_rad, **fields)  # type: ignore[arg-type]
    return file.getvalue()


def write_npz(scan: Scan3d, rover: Rover, path: Path) -> None:
    """Write the .npz of `npz_bytes`."""
    path.write_bytes(npz_bytes(scan))


def write_mcap(scan: Scan3d, rover: Rover, path: Path) -> None:
    """Write a record with this scan alone."""
    write_record([scan], rover, path)


def write_record(scans: Sequence[Scan3d], rover: Rover, path: Path) -> None:
    """Write all scans to one MCAP file, each at the time of its last beam."""
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library="el-dorado")
        layout = writer.register_schema("eldorado.scan3d", "text", b".npz: keys and shapes in its scan_export.py")
        image = writer.register_channel("/scan3d", "application/octet-stream", layout)
        shape = json.dumps({"type": "object", "title": "foxglove.PointCloud"}).encode()
        known = writer.register_schema("foxglove.PointCloud", "jsonschema", shape)
        cloud = writer.register_channel("/cloud", "json", known)
        for number, scan in enumerate(scans):
            at_ns = int(scan.pixels["time_ns"].max())
            for channel, data in ((image, npz_bytes(scan)), (cloud, _foxglove(scan, rover, at_ns))):
                writer.add_message(channel, log_time=at_ns, publish_time=at_ns, sequence=number, data=data)
        writer.finish()  # type: ignore[no-untyped-call]


def _foxglove(scan: Scan3d, rover: Rover, at_ns: int) -> bytes:
    made = points(scan, rover)
    packed = _fill(np.empty(len(made.xyz_m), _PACKED), made)
    fields = [{"name": name, "offset": 4 * k, "type": _FLOAT32} for k, name in enumerate(_PACKED.names or ())]
    here = {"position": {"x": 0, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    stamp = {"sec": at_ns // 1_000_000_000, "nsec": at_ns % 1_000_000_000}
    return json.dumps(
        {
            "timestamp": stamp,
            "frame_id": "base_link",
            "pose": here,
            "point_stride": _PACKED.itemsize,
            "fields": fields,
            "data": base64.b64encode(packed.tobytes()).decode("ascii"),
        }
    ).encode()


def _fill(rows: Pixels, made: Points) -> Pixels:
    rows["x"], rows["y"], rows["z"] = made.xyz_m.T
    rows["intensity"] = made.pixels["intensity"]
    return rows


FORMATS: Mapping[str, Callable[[Scan3d, Rover, Path], None]] = MappingProxyType(
    {"ply": write_ply, "npz": write_npz, "mcap": write_mcap}
)
