"""Products as files for other tools, with a line that describes each file's content."""

from __future__ import annotations

import io
import json
import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import zstandard
from numpy.typing import NDArray

from onboard.config import Rover
from onboard.perception.scan.scan3d import Points, Scan3d, gather, points
from onboard.records import Scan, TiltTrack
from protocol import WireError
from protocol.link.bulk import Product
from protocol.products import PRODUCTS, RECORD_CODEC, decode_ldem, poses_of
from protocol.products.height_std import decode_height_std
from protocol.products.nsp import Explanation, decode_nsp
from protocol.products.scan import ScanProduct, decode_scan
from protocol.visible import visible

RAW, TEXT = ".bin", ".txt"
_VERTEX = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("time", "<f4")])


class FileContent(NamedTuple):
    """File content.

    data: bytes of the file.
    holds: description, in a line.
    """

    data: bytes
    holds: str


def default_name(product: str) -> str:
    """Return the default file name of a product."""
    return product + suffixes(product)[0]


def suffixes(product: str) -> tuple[str, ...]:
    """Return the file name endings that a product can have."""
    known = tuple(suffix for name, suffix in _FORMATS if name == product)
    return (*(known or (TEXT,)), RAW)


def check_name(product: str, path: Path) -> None:
    """Raises ValueError if the product cannot be written with the ending of `path`."""
    if path.suffix not in suffixes(product):
        raise ValueError(f"{path}: {product} is written as {', '.join(suffixes(product))}")


def save(product: Product, path: Path) -> str:
    """Write the file and return the description of its content.

    Raises ValueError like check_name, WireError, OSError.
    """
    check_name(product.name, path)
    made = _FORMATS.get((product.name, path.suffix), _raw)(product.data)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(made.data)
    return made.holds


def _raw(data: bytes) -> FileContent:
    return FileContent(data, "as it was sent")


def _npz(**arrays: Any) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def _ldem(data: bytes) -> FileContent:
    ldem = decode_ldem(data)
    grid, known = ldem.grid, np.isfinite(ldem.heights_m)
    low, high = (float(f(ldem.heights_m[known])) if known.any() else math.nan for f in (np.min, np.max))
    arrays = ldem_arrays(data)
    where = (
        f"around {grid.x0_m + grid.cell_m * (grid.columns - 1) / 2:.2f}, "
        f"{grid.y0_m + grid.cell_m * (grid.rows - 1) / 2:.2f}"
    )
    return FileContent(
        _npz(**arrays),
        f"{grid.columns} x {grid.rows} cells of {grid.cell_m:g} m {where}, "
        f"{known.mean():.0%} known, {low:.2f} to {high:.2f} m high; {', '.join(arrays)}",
    )


def ldem_arrays(data: bytes) -> dict[str, Any]:
    """Return the arrays of an encoded map: heights, sets, grid, and the poses if present. Raises WireError."""
    ldem = decode_ldem(data)
    grid = ldem.grid
    tree: dict[str, Any] = {
        "heights_m": ldem.heights_m,
        "node_sets": ldem.node_sets,
        "x0_m": grid.x0_m,
        "y0_m": grid.y0_m,
        "cell_m": grid.cell_m,
    }
    poses = poses_of(data)
    if poses is not None:
        tree |= {
            "freedom": poses.freedom,
            "pose": poses.pose,
            "known": poses.known,
            "slippery_m": np.array(poses.slippery_m).reshape(-1, 2),
            "settings": np.frombuffer(poses.settings, np.uint8),
        }
    return tree


def _height_std(data: bytes) -> FileContent:
    grid, std_m = decode_height_std(data)
    known = np.isfinite(std_m)
    middle = f"half of them under {float(np.median(std_m[known])) * 1e3:.1f} mm" if known.any() else "none known"
    arrays = {"height_std_m": std_m, "x0_m": grid.x0_m, "y0_m": grid.y0_m, "cell_m": grid.cell_m}
    return FileContent(
        _npz(**arrays),
        f"1 sigma of the heights in {int(known.sum())} of {grid.columns} x {grid.rows} "
        f"cells of {grid.cell_m:g} m, {middle}; {', '.join(arrays)}",
    )


# -- scan ------------------------------------------------------------------------------------------------------


def image_of(scan: ScanProduct) -> Scan3d:
    """Return the range image with tilt and time of every beam, as on board."""
    turns = [
        Scan(int(start_ns), float(beam_ns), scan.first_angle_rad, scan.step_rad, ranges_m, status)
        for start_ns, beam_ns, ranges_m, status in zip(scan.start_ns, scan.beam_ns, scan.ranges_m, scan.status)
    ]
    return gather(turns, TiltTrack(scan.tilt_ns, scan.tilt_rad))


def points_map(scan: ScanProduct, image: Scan3d) -> tuple[NDArray[np.float64], Points]:
    """Return (n, 3) points in the map frame, m, and their pixels."""
    at_scanner = Rover(
        lidar_x_m=0.0, lidar_y_m=0.0, lidar_z_m=0.0, lidar_roll_rad=0.0, lidar_pitch_rad=0.0, lidar_yaw_rad=0.0
    )
    found = points(image, at_scanner)
    T = scan.T_map_base @ scan.T_base_scanner
    return found.xyz_m @ T[:3, :3].T + T[:3, 3], found


def _scan_words(scan: ScanProduct, count: int) -> str:
    x_m, y_m, z_m = scan.T_map_base[:3, 3]
    span_s = (int(scan.start_ns[-1]) - int(scan.start_ns[0])) / 1e9
    return (
        f"{count} points of {scan.ranges_m.shape[0]} turns in {span_s:.1f} s, taken at stop {scan.stop} from "
        f"{x_m:.2f}, {y_m:.2f}, {z_m:.2f} in the map frame"
    )


def _scan_npz(data: bytes) -> FileContent:
    scan = decode_scan(data)
    image = image_of(scan)
    xyz_m, found = points_map(scan, image)
    fields = {name: image.pixels[name] for name in ("range_m", "tilt_rad", "time_ns", "mask")}
    made = _npz(
        points_m=xyz_m.astype(np.float32),
        line=found.line,
        beam=found.beam,
        T_map_base=scan.T_map_base,
        T_base_scanner=scan.T_base_scanner,
        first_angle_rad=scan.first_angle_rad,
        step_rad=scan.step_rad,
        **fields,
    )
    return FileContent(
        made,
        f"{_scan_words(scan, len(xyz_m))}; points_m, line, beam, {', '.join(fields)}, "
        "first_angle_rad, step_rad, T_map_base, T_base_scanner",
    )


def _scan_ply(data: bytes) -> FileContent:
    scan = decode_scan(data)
    xyz_m, found = points_map(scan, image_of(scan))
    rows = np.empty(len(xyz_m), _VERTEX)
    rows["x"], rows["y"], rows["z"] = xyz_m.T
    rows["time"] = (found.pixels["time_ns"] - int(scan.start_ns[0])) * 1e-9
    named = "".join(f"property float {name}\n" for name in _VERTEX.names or ())
    head = (
        "ply\nformat binary_little_endian 1.0\ncomment one sweep in the map frame: metres, x east, y north, z up; "
        f"time: s since its first turn\nelement vertex {len(rows)}\n{named}end_header\n"
    )
    return FileContent(head.encode("ascii") + rows.tobytes(), f"{_scan_words(scan, len(rows))}; x, y, z, time")


# -- decision, record ------------------------------------------------------------------------------------------


def explanation_tree(told: Explanation) -> dict[str, Any]:
    """Return the explanation as data for JSON: angles in radians, non-finite numbers as null."""
    tree = told._asdict() | {"places": [place._asdict() for place in told.places]}
    return {key: _plain(item) for key, item in tree.items()}


def _plain(item: Any) -> Any:
    if isinstance(item, dict):
        return {key: _plain(part) for key, part in item.items()}
    if isinstance(item, (list, tuple)):
        return [_plain(part) for part in item]
    return None if isinstance(item, float) and not math.isfinite(item) else item


def _nsp(data: bytes) -> FileContent:
    told = decode_nsp(data)
    x_m, y_m, heading_rad = told.end
    way = f"{told.rule} {told.kind} to {x_m:.2f}, {y_m:.2f}, heading {math.degrees(heading_rad):.0f} degrees"
    scored = (
        f"{told.scored} places scored, the best {len(told.places)} of them with their terms"
        if told.places
        else (f"the strategy {told.strategy} scored no places")
    )
    made = json.dumps(explanation_tree(told), indent=1).encode() + b"\n"
    return FileContent(made, visible(f"decision at stop {told.stop}: {way}: {told.reason}; {scored}"))


def _record(data: bytes) -> FileContent:
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    try:
        statistics = make_reader(io.BytesIO(data)).get_summary()
    except (McapError, ValueError, LookupError, OverflowError, struct.error, zstandard.ZstdError, EOFError) as error:
        raise WireError("product", f"the slice is no MCAP file: {error}") from error
    known = statistics.statistics if statistics is not None else None
    if known is None:
        return FileContent(data, "a slice of the record without a summary")
    span = f"{known.message_start_time / 1e9:.2f} s to {known.message_end_time / 1e9:.2f} s"
    told = f"{known.message_count} messages of the onboard record, {span}; `onboard record info` reads it"
    return FileContent(data, told)


_FORMATS: dict[tuple[str, str], Callable[[bytes], FileContent]] = {
    ("ldem", ".npz"): _ldem, ("scan", ".npz"): _scan_npz, ("scan", ".ply"): _scan_ply, ("nsp", ".json"): _nsp,
    ("record", "." + RECORD_CODEC): _record, ("height_std", ".npz"): _height_std,
}  # fmt: skip
assert {name for name, _ in _FORMATS} == {row.name for row in PRODUCTS}
