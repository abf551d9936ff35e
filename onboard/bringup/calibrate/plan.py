"""Plan of the calibration drive: sweeps that show the scanner's lag, a square with turns on the spot, two crabs.

A scan wherever the rover stands.

        3 <------ 2         each side: forward, scan, turn left by 90 degrees, scan. The turns separate the scanner's
        |         ^         position from its direction, and the inertial sensor's tilt from its bias and the slope of
        v         |         the ground.
        0 ------> 1         from 0, in the end: a crab to 3 and back, which shows the left wheels' steering against
      start                 the right wheels'
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from onboard.config import Config, Scanning
from onboard.perception.scan.sweep import TiltSegment
from onboard.perception.scan.tilt_lag import nods
from onboard.records import Twist

SPEED_MPS, TURN_RADPS = 0.1, 0.2
MOST_SIDE_M, LEAST_SIDE_M = 5.0, 0.5
SCAN_S, STEER_S, NOD_S = 15.0, 6.0, 5.0  # approximate, for people; of a nod in addition to its sweep


@dataclass(frozen=True, slots=True)
class DriveStep:
    """One step of the drive.

    name: for people.
    twist: motion; none: a scan of the standing rover, or with `nod` one sweep for the lag.
    amount: amount of the motion, m or rad.
    nod: segment of a sweep for the lag.
    """

    name: str
    twist: Twist = Twist()
    amount: float = 0.0
    nod: TiltSegment | None = None

    @property
    def scans(self) -> bool:
        """True if the rover stands and scans its surroundings."""
        return self.twist == Twist() and self.nod is None

    @property
    def speed(self) -> float:
        """Speed, m/s, or rad/s of a turn."""
        return math.hypot(self.twist.vx_mps, self.twist.vy_mps) or abs(self.twist.yaw_radps)

    @property
    def turns(self) -> bool:
        """True if its amount is an angle."""
        return self.twist.yaw_radps != 0.0

    @property
    def seconds(self) -> float:
        """Approximate duration."""
        if self.nod is not None:
            return NOD_S + self.nod.duration_ns * 1e-9
        return SCAN_S if self.scans else self.amount / self.speed + STEER_S


def square(side_m: float) -> tuple[DriveStep, ...]:
    """The whole drive. Raises ValueError for a side that is too short to observe anything or too long to supervise."""
    if not LEAST_SIDE_M <= side_m <= MOST_SIDE_M:
        raise ValueError(f"a side of {side_m:g} m should be within {LEAST_SIDE_M:g} and {MOST_SIDE_M:g} m")
    return tuple(_steps(side_m))


def _steps(side_m: float) -> Iterator[DriveStep]:
    scan = DriveStep("scan")
    yield scan
    for _ in range(4):
        yield DriveStep("forward", Twist(SPEED_MPS), side_m)
        yield scan
        yield DriveStep("turn left", Twist(yaw_radps=TURN_RADPS), math.pi / 2)
        yield scan
    yield DriveStep("crab left", Twist(vy_mps=SPEED_MPS), side_m)
    yield scan
    yield DriveStep("crab right", Twist(vy_mps=-SPEED_MPS), side_m)
    yield scan


def lag_steps(config: Config) -> tuple[DriveStep, ...]:
    """The sweeps before the square. Raises ValueError if the axis has too little travel."""
    return tuple(
        DriveStep("sweep down" if nod.rate_radps > 0 else "sweep up", nod=nod) for nod in nods(config.scanning)
    )


def room_m(side_m: float) -> float:
    """Largest distance from its start that the rover may reach, its body included."""
    return math.hypot(side_m, side_m) + 0.8


def nod(config: Config) -> Scanning:
    """The sweep of these scans: coarser than a mission's, and as wide as the rover itself does not hide it."""
    return Scanning(
        start_rad=config.scanning.start_rad,
        end_rad=math.radians(-10),
        spacing_m=0.08,
        cap_rad=math.radians(0.5),
        range_m=config.scanning.range_m,
        sector_rad=math.radians(110),
    )
