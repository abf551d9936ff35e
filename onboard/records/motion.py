"""Records of motion: poses, estimates, twists, wheel orders, paths, decisions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from onboard.native import each
from onboard.native.arrays import F64
from onboard.native.elementary import cos, sin


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of base_link in the map frame; roll, pitch, yaw intrinsic z-y-x (REP-103)."""

    x_m: float
    y_m: float
    z_m: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0

    def matrix(self) -> F64:
        """T_map_base, (4, 4) float64: takes base coordinates to map coordinates."""
        cr, sr = cos(self.roll_rad), sin(self.roll_rad)
        cp, sp = cos(self.pitch_rad), sin(self.pitch_rad)
        cy, sy = cos(self.yaw_rad), sin(self.yaw_rad)
        return np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, self.x_m],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, self.y_m],
                [-sp, cp * sr, cp * cr, self.z_m],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )


@dataclass(frozen=True, slots=True)
class Estimate:
    """Estimate of the filter: pose, its covariance (4, 4) over x, y, z, yaw, and the body rates."""

    pose: Pose
    covariance: F64
    speed_mps: float
    yaw_rate_radps: float


class Twist(NamedTuple):
    """Motion of base_link in its own axes."""

    vx_mps: float = 0.0
    vy_mps: float = 0.0
    yaw_radps: float = 0.0


class WheelMode(IntEnum):
    """Mode field of WHEEL_n_COMMAND."""

    OFF = 0
    HOLD = 1
    RUN = 2


class WheelCommand(NamedTuple):
    """Order of one wheel."""

    mode: WheelMode
    steer_rad: float
    rate_radps: float


@dataclass(frozen=True, slots=True)
class Path:
    """Stations to drive.

    stations: (k, 3) float64 x, y, body yaw in the map frame, at most `spacing_m` apart along the path. Successive
        stations with the same place and another yaw are a turn on the spot. The body may move in any direction
        relative to its yaw (crab, backwards): every station's pose was checked free.
    clearance_m: (k,) float64, distance of each to the nearest blocked pose, at most the search radius; None if not
        computed.
    """

    stations: F64
    clearance_m: F64 | None = None

    @property
    def length_m(self) -> float:
        """Length of the path of base_link, m."""
        if len(self.stations) < 2:
            return 0.0
        return float(each.hypot(*np.diff(self.stations[:, :2], axis=0).T).sum())


@dataclass(frozen=True, slots=True)
class Decision:
    """Choice of the mission rule and its reason.

    kind: 'drive' (then scan), 'goal' (then done), 'arrived', 'unreachable'.
    rule: name of the rule (R4 ...).
    reason: in words.
    path: to drive.
    heading_rad: direction of the scan at the stop.
    data: further values.
    """

    kind: str
    rule: str
    reason: str
    path: Path
    heading_rad: float
    data: Mapping[str, Any] = field(default_factory=dict)
