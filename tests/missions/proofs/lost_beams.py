"""Shares of lost beams on sound ground under a realistic scanner: the table of docs/lost-beams.md.

`python -m tests.missions.proofs.lost_beams`: fields of the campaign, two sweeps each. Every beam that meets ground
flatter than 5 degrees is lost; half of the further loss is single beams, half clumps of 3 to 30.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.config import Config
from onboard.core.faults.devices.returns import ReturnWatch
from onboard.perception.scan.lost_beams import lost_beams
from onboard.records import BeamStatus, Bool, Pose, Scan
from tests.missions.world.fields import main_field
from tests.missions.world.scanner import BEAM_NS, LINE_NS, STEP_RAD, Scanner, scanner
from tests.missions.world.world import World

SEEDS = (2, 5, 9, *range(1, 35, 3))
RATIOS = (0.01, 0.03, 0.08)
FAR_M, GRAZING_RAD = 30.0, math.radians(5.0)


def lossy(eye: Scanner, world: World, pose: Pose, ratio: float, seed: int) -> tuple[Scan, ...]:
    """Return a sweep with losses from a true pose."""
    T_map_base, rover, shape = pose.matrix(), eye.config.rover, (eye.lines, eye.beams)
    origin = T_map_base[:3, :3] @ (rover.lidar_x_m, rover.lidar_y_m, rover.lidar_z_m) + T_map_base[:3, 3]
    rays = eye.directions @ T_map_base[:3, :3].T
    found = np.minimum(world.rays.cast(origin, rays, FAR_M), eye.hull_m).reshape(shape)
    ways = rays.reshape(*shape, 3)
    points = ways * np.where(np.isfinite(found), found, FAR_M)[..., None]
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True) + 1e-12
    flat = np.abs((normals * ways).sum(axis=2)) < math.sin(GRAZING_RAD)
    lost = flat & np.isinf(eye.hull_m.reshape(shape)) | _dropouts(found.size, ratio, seed).reshape(shape)
    hit = (found <= FAR_M) & ~lost
    ranges_m = np.where(hit, found, np.nan).astype(np.float32)
    status = np.where(hit, BeamStatus.OK, BeamStatus.NO_RETURN).astype(np.uint8)
    first_rad = -(eye.beams - 1) / 2 * STEP_RAD
    return tuple(Scan(k * LINE_NS, BEAM_NS, first_rad, STEP_RAD, ranges_m[k], status[k]) for k in range(eye.lines))


def _dropouts(count: int, ratio: float, seed: int) -> Bool:
    rng = np.random.default_rng(seed)
    lost: Bool = rng.random(count) < 0.5 * ratio
    for start in rng.integers(0, count, round(0.5 * ratio * count / 16.5)):
        lost[start : start + rng.integers(3, 31)] = True
    return lost


def worst_torn(eye: Scanner, scans: tuple[Scan, ...]) -> float:
    """Return the largest share of torn places that the flight's monitor finds in a sweep."""
    watch, worst = ReturnWatch(eye.config.rover, eye.config.scanning.sector_rad), 0.0
    for scan in scans:
        watch.update([scan], float(np.interp(scan.start_ns + 40e6, eye.tilt.times_ns, eye.tilt.angles_rad)))
        worst = max(worst, watch.torn_ratio)
    return worst


def main() -> None:
    """Print the table's rows."""
    config = Config()
    eye, rows = scanner(config), {ratio: [] for ratio in RATIOS}
    for seed in SEEDS:
        world = main_field(seed)
        start = world.start
        for turn_rad in (0.0, math.pi):
            pose = world.stand(start.x_m, start.y_m, start.yaw_rad + turn_rad, config.rover)
            for ratio in RATIOS:
                scans = lossy(eye, world, pose, ratio, seed)
                near = lost_beams(scans, eye.tilt, config.rover, config.scanning).ratio
                rows[ratio].append((near, worst_torn(eye, scans)))
    for ratio, found in rows.items():
        near, torn = np.array(found).T
        print(f"| {ratio:.0%} | {np.median(near):.1%}, {near.max():.1%} | {torn.max():.0%} |")


if __name__ == "__main__":
    main()
