"""Rovers with random build errors: `onboard calibrate` estimates the errors and improves odometry.

Each seed draws errors (build_errors.py), drives the square on firm, sloping ground with rocks around, and estimates.
Then a rover with the estimate drives the same square again. The odometry of both drives (wheels and gyro, without the
scanner) is compared with the truth, leg by leg, in the axes of the scanner as configured: a drive cannot show whether
all wheels or the scanner are turned (docs/calibration.md). For comparison, odometry with the true build shows the
error from ground and slip that no calibration removes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from hil.faults.build_errors import drawn
from onboard.bringup.calibrate.drive import CalibrationDrive
from onboard.bringup.calibrate.estimate import Estimate, estimate
from onboard.bringup.calibrate.evidence import Evidence, evidence
from onboard.bringup.calibrate.model import CALIBRATED, Model, believed
from onboard.config import Config, Rover
from tests.onboard.calibrate_rig import Yard

SEEDS = tuple(range(1, 11))
SHORT = (1,)
SIDE_M = 1.5
LIMITS = {  # of errors that a drive can show; a wheel of 0.1 m rolls 0.5 % short on this ground
    "radius_mm": 1.2, "lidar_mm": 20.0, "lidar_tilt_deg": 0.15, "lidar_yaw_deg": 1.5, "imu_tilt_deg": 0.15,
    "steer_seen_deg": 1.5, "steer_difference_deg": 0.5,
}  # fmt: skip
BETTER_RATIO, OVER_BUILT_MM = 0.7, 2.0
UNITS = ("lidar", "imu")
PATTERNS = {"mean": (1, 1, 1, 1), "front_rear": (1, -1, -1, 1), "left_right": (1, 1, -1, -1)}


@dataclass(frozen=True, slots=True)
class Row:
    """Errors of the estimate against the true build.

    steer_seen_deg: mean steering angle.
    steer_difference_deg: the larger of front against rear and left against right.
    sigmas: largest error of all values in units of its sigma.
    way_before_mm, way_after_mm: rms odometry error over the legs, before and after calibration.
    way_built_mm: the same on the second drive, with the true build.
    """

    seed: int
    outcome: str
    radius_mm: float = 0.0
    lidar_mm: float = 0.0
    lidar_tilt_deg: float = 0.0
    lidar_yaw_deg: float = 0.0
    imu_tilt_deg: float = 0.0
    steer_seen_deg: float = 0.0
    steer_difference_deg: float = 0.0
    sigmas: float = 0.0
    way_before_mm: float = 0.0
    way_after_mm: float = 0.0
    way_built_mm: float = 0.0


def fly(seed: int) -> Row:
    """Fly both drives of one rover."""
    built = drawn(seed).built(Rover())
    problem, first = drive(built, Rover(), seed)
    if first is None:
        return Row(seed, problem)
    found = estimate(first.seen, Rover())
    problem, then = drive(built, found.applied(Rover()), seed)
    if then is None:
        return Row(seed, problem)
    off_mm = (first.off_mm(Rover(), built), then.off_mm(found.applied(Rover()), built), then.off_mm(built, built))
    return Row(seed, "calibrated", *_errors(found, built), *(round(off, 1) for off in off_mm))


@dataclass(frozen=True, slots=True)
class Driven:
    """Evidence of a drive, and the true poses (position, quaternion) of its stops."""

    seen: Evidence
    stops: Sequence[tuple[np.ndarray, np.ndarray]]

    def off_mm(self, believes: Rover, built: Rover) -> float:
        """Return the rms odometry error over the legs, mm, with this configuration, in its scanner's axes."""
        model = Model(self.seen, believes)
        ways = model.ways(model.start())[:, :2]
        askew = Rotation.from_euler("z", believes.lidar_yaw_rad - built.lidar_yaw_rad).as_matrix()[:2, :2]
        true = np.array([_in_base(self.stops[k], self.stops[k + 1]) for k in range(len(ways))]) @ askew.T
        return 1000.0 * float(np.sqrt(((ways - true) ** 2).sum(axis=1).mean()))


def drive(built: Rover, believes: Rover, seed: int) -> tuple[str, Driven | None]:
    """Return the reason for an early end, or the drive."""
    yard, poses = Yard(built, seed), []

    def observe(world: Yard, machine: CalibrationDrive) -> None:
        if machine.at > len(poses):  # a step is over
            poses.append((world.state.position_m.copy(), world.state.quaternion_xyzw.copy()))

    try:
        machine = yard.run(CalibrationDrive(replace(Config(), rover=believes), SIDE_M), observe)
    finally:
        yard.free()
    if not machine.complete:
        return machine.problem, None
    stops = [pose for pose, step in zip(poses, machine.steps) if step.scans]
    return "", Driven(evidence(machine.log, believes), stops)


def _in_base(first: tuple[np.ndarray, np.ndarray], then: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    x, y, z, w = first[1]
    ahead = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)])
    left = np.array([2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)])
    way = then[0] - first[0]
    return np.array([way @ ahead, way @ left])


def _errors(found: Estimate, built: Rover) -> tuple[float, ...]:
    off = dict(zip(CALIBRATED, np.array([value.after for value in found.values]) - believed(built)))
    sigma = {value.key: value.sigma for value in found.values}
    steer = np.degrees([off[f"steer_{n}_offset_rad"] for n in (1, 2, 3, 4)])
    pattern = {name: abs(float(steer @ signs)) / 4 for name, signs in PATTERNS.items()}
    tilts = {unit: math.degrees(math.hypot(off[f"{unit}_roll_rad"], off[f"{unit}_pitch_rad"])) for unit in UNITS}
    return tuple(
        round(float(v), 3)
        for v in (
            1000 * abs(off["wheel_radius_m"]),
            1000 * float(np.linalg.norm([off[f"lidar_{axis}_m"] for axis in "xyz"])),
            tilts["lidar"],
            abs(float(np.degrees(off["lidar_yaw_rad"]))),
            tilts["imu"],
            pattern["mean"],
            max(pattern["front_rear"], pattern["left_right"]),
            max(abs(off[key]) / sigma[key] for key in CALIBRATED),
        )
    )


def judge(rows: Sequence[Row]) -> list[str]:
    """Check each figure against LIMITS, odometry against that with the true build, all against BETTER_RATIO."""
    short, flown = [], [row for row in rows if row.outcome == "calibrated"]
    for row in rows:
        if row.outcome != "calibrated":
            short.append(f"seed {row.seed}: {row.outcome}")
            continue
        short += [
            f"seed {row.seed}: {name} is {getattr(row, name)}, at most {limit}"
            for name, limit in LIMITS.items()
            if getattr(row, name) > limit
        ]
        if row.way_after_mm > row.way_built_mm + OVER_BUILT_MM:
            short.append(f"seed {row.seed}: odometry is {row.way_after_mm} mm off, at best {row.way_built_mm}")
    before_mm, after_mm = (
        math.sqrt(sum(way * way for way in ways))
        for ways in ([row.way_before_mm for row in flown], [row.way_after_mm for row in flown])
    )
    if flown and after_mm > BETTER_RATIO * before_mm:
        short.append(f"odometry over all {len(flown)} is {after_mm / before_mm:.2f} of what it was off")
    return short
