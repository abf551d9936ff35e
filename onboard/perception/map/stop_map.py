"""MAPPING work of a stop, as pure functions that run outside the tick: cloud, registration, map.

`look` makes the cloud of a sweep in base_link axes and registers it to the points of earlier stops. Then the filter
decides in the tick whether to accept the registration. `remember_all` enters the cloud into the map at the decided
pose; at the second look of the first stop it enters both clouds, because the level of the first one is known better by
then. `recall` loads the map that an earlier run of the program stored on disk.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.config import Config
from onboard.native.elementary import asin, atan2
from onboard.native.linear import product
from onboard.perception.map import ldem
from onboard.perception.map.tiles import Tile, join
from onboard.perception.map.unseen_cells import updated
from onboard.perception.pose.registration import RegistrationResult, merge_target, register
from onboard.perception.scan.cloud import cloud
from onboard.perception.scan.dark_regions import dark_regions
from onboard.perception.scan.lost_beams import LostBeams, lost_beams
from onboard.records import F32, F64, Cloud, Entry, Ldem, Pose, Scan, TiltTrack

NO_POINTS: F64 = np.empty((0, 3))
NOTHING_DARK: F32 = np.empty((0, 3), np.float32)
POINTS_AT_ONCE = 1 << 14  # keeps temporaries small against the 240,000 points of a sweep


@dataclass(frozen=True, slots=True)
class Look:
    """One sweep of a stop.

    cloud_base: cloud in base_link axes.
    registration: None at the first scan.
    lost: lost beams of the sweep.
    dark_base_m: (k, 3) points of ground that it did not see, in base_link axes (`dark_regions`).
    """

    cloud_base: Cloud
    registration: RegistrationResult | None
    lost: LostBeams
    dark_base_m: F32


@dataclass(frozen=True, slots=True)
class StopMap:
    """Map memory of the rover.

    cells: the persistent map.
    target_points: (m, 3) points in the map frame, target of registrations.
    blocked_m: points whose cells no wheel may roll over, regardless of the map: the drive guard stopped at them.
    slippery_m: positions of the rover while SLIP_HIGH was active; ground there costs more.
    unseen_m: centres of cells that the beams should have seen and did not (`unseen_cells`), sorted.

    blocked_m, slippery_m and unseen_m are not stored on disk.
    """

    cells: Ldem
    target_points: F64
    blocked_m: tuple[tuple[float, float], ...] = ()
    slippery_m: tuple[tuple[float, float], ...] = ()
    unseen_m: tuple[tuple[float, float], ...] = ()


def look(scans: Sequence[Scan], tilt: TiltTrack, guess: F64, memory: StopMap | None, config: Config) -> Look:
    """Cloud of a sweep, registered to the points of `memory`, if any, from `guess` (4, 4) T_map_base."""
    far = replace(config.scanning, range_m=max(config.scanning.range_m, config.localisation.registration_range_m))
    seen = cloud(scans, tilt, np.eye(4), config.rover, far, config.lidar.range_noise_m)
    lost = lost_beams(scans, tilt, config.rover, config.scanning)
    dark = dark_regions(scans, tilt, config.rover, config.scanning)
    if memory is None or not len(memory.target_points):
        return Look(seen, None, lost, dark)
    found = register(seen.ends_m[seen.hit], memory.target_points, guess, config.localisation)
    return Look(seen, found, lost, dark)


def remember_all(memory: StopMap | None, entries: Sequence[Entry], config: Config) -> StopMap | None:
    """The map after `remember` of each entry in turn."""
    for entry in entries:
        memory = remember(memory, entry.cloud_base, entry.pose.matrix(), entry.stop, config, entry.dark_base_m)
    return memory


def remember(
    memory: StopMap | None, seen: Cloud, T_map_base: F64, stop: int, config: Config, dark_base_m: F32 = NOTHING_DARK
) -> StopMap:
    """The map with one more cloud, entered at T_map_base; the first cloud starts the map.

    dark_base_m: as of a Look.

    If the map does not know the ground under the rover (the first stop, a stored map of another place), that ground is
    assumed to be the disc that the wheels stand on (R1).
    """
    mapping = config.mapping
    x_m, y_m = float(T_map_base[0, 3]), float(T_map_base[1, 3])
    here = moved(seen, T_map_base)
    if memory is None:
        memory = StopMap(ldem.empty(ldem.grid_around(x_m, y_m, mapping.cell_m, mapping.cell_m)), NO_POINTS)
    cells = ldem.grow(memory.cells, x_m, y_m, mapping.size_m / 2)
    if not ldem.knows(cells, x_m, y_m, config.rover.body_length_m / 2):
        cells = ldem.assume_disc(cells, pose_of(T_map_base), mapping.assumed_m)
    near = ldem.window(cells, x_m, y_m, mapping.size_m)  # a scan reaches no farther, and the map may be large
    cells = ldem.paste(cells, ldem.insert(near, within(here, config.scanning.range_m), stop, mapping.near_m))
    target = merge_target(memory.target_points, here.ends_m[here.hit], (x_m, y_m))
    dark_m = product(dark_base_m, T_map_base[:3, :3].T) + T_map_base[:3, 3]
    unseen_m = updated(memory.unseen_m, dark_m, here, mapping.cell_m, mapping.near_m)
    return replace(memory, cells=cells, target_points=target, unseen_m=unseen_m)


def recall(tiles: Sequence[Tile]) -> StopMap | None:
    """The map of stored tiles; None without any. Raises ValueError if they lie too far apart to fit in memory."""
    return StopMap(*join(tiles)) if tiles else None


def within(seen: Cloud, range_m: float) -> Cloud:
    """The same beams with the scanner's range limited to `range_m`: longer beams end there without a hit."""
    ends, hit, origin = seen.ends_m.copy(), seen.hit.copy(), seen.origin_m.astype(np.float32)
    for part in _parts(len(ends)):
        way = ends[part] - origin
        x, y, z = way.T
        length = np.sqrt(x * x + y * y + z * z)
        beyond = length > range_m
        ends[part][beyond] -= way[beyond] * (1.0 - range_m / length[beyond])[:, None].astype(np.float32)
        hit[part] &= ~beyond
    return replace(seen, ends_m=ends, hit=hit)


def moved(seen: Cloud, T_map_base: F64) -> Cloud:
    """The same beams in the map frame of T_map_base."""
    rotation, shift = T_map_base[:3, :3], T_map_base[:3, 3]
    ends = np.empty_like(seen.ends_m)
    for part in _parts(len(ends)):
        ends[part] = product(seen.ends_m[part], rotation.T) + shift
    return replace(seen, origin_m=product(rotation, seen.origin_m) + shift, ends_m=ends)


def _parts(count: int) -> list[slice]:
    return [slice(first, first + POINTS_AT_ONCE) for first in range(0, count, POINTS_AT_ONCE)]


def pose_of(T_map_base: F64) -> Pose:
    """Pose of a (4, 4) transform, roll, pitch, yaw intrinsic z-y-x."""
    R = T_map_base[:3, :3]
    return Pose(
        float(T_map_base[0, 3]),
        float(T_map_base[1, 3]),
        float(T_map_base[2, 3]),
        roll_rad=atan2(R[2, 1], R[2, 2]),
        pitch_rad=-asin(min(1.0, max(-1.0, R[2, 0]))),
        yaw_rad=atan2(R[1, 0], R[0, 0]),
    )
