"""Operator's moves: a turn on the spot, or a twist for a limited time and distance. They use no map.

A move ends at its bounds. A fault whose response ends a leg, stops or looks ends it too (the executive does that).
"""

from __future__ import annotations

import math
from typing import Protocol

from onboard.config import Config
from onboard.core.context import Context
from onboard.core.faults.wheels.blocks import SLEW_RADPS2
from onboard.motion.follower import Follower
from onboard.native.elementary import dist
from onboard.records import Twist

_PROGRESS_NS = 5_000_000_000
_LATE_S = 0.03  # from an order to the wheels' motion
_TURN_NS = 120_000_000_000  # half a turn takes 13 s at the default rate; a turn that does not end is given up


class Move(Protocol):
    """Interface of a move; call `step` each tick until `ended` is set.

    ended: result in words; '' while it runs.
    failed: the result is a failure.
    progress: texts to report; the caller takes them.
    """

    ended: str
    failed: bool
    progress: list[str]

    def step(self, ctx: Context) -> Twist:
        """Process one tick; return the twist wanted."""
        ...


class TurnTo:
    """Turn on the spot to a heading."""

    def __init__(self, config: Config, heading_rad: float) -> None:
        self.ended, self.failed, self.progress = "", False, list[str]()
        self._follower, self._heading_rad = Follower(config.rover, config.motion), heading_rad
        self._begun_ns: int | None = None

    def step(self, ctx: Context) -> Twist:
        """Process one tick; return the twist wanted."""
        self._begun_ns = ctx.now_ns if self._begun_ns is None else self._begun_ns
        if ctx.now_ns - self._begun_ns > _TURN_NS:
            self.ended, self.failed = f"not there after {_TURN_NS // 10**9} s", True
            return Twist()
        twist = self._follower.turn(self._heading_rad, ctx.localisation.pose, ctx.wheels)
        if self._follower.done:
            self.ended = f"heading {math.degrees(ctx.localisation.pose.yaw_rad):.1f} degrees"
        return twist


class TwistMove:
    """Twist until `duration_s` have passed, including the time to steer, or base_link stops after `distance_m`."""

    def __init__(self, config: Config, twist: Twist, duration_s: float, distance_m: float) -> None:
        self.ended, self.failed, self.progress = "", False, list[str]()
        self._brakes_mps2 = SLEW_RADPS2 * config.rover.wheel_radius_m
        self._twist, self._duration_ns, self._distance_m = twist, round(duration_s * 1e9), distance_m
        self._begun_ns: int | None = None
        self._gone_m, self._last_m, self._brakes = 0.0, (0.0, 0.0), False
        self._told_ns = 0

    def step(self, ctx: Context) -> Twist:
        """Process one tick; return the twist wanted."""
        pose = ctx.localisation.pose
        here_m = (pose.x_m, pose.y_m)
        if self._begun_ns is None:
            self._begun_ns = self._told_ns = ctx.now_ns
            self._last_m = here_m
        self._gone_m += dist(here_m, self._last_m)
        self._last_m = here_m
        lasted_s = (ctx.now_ns - self._begun_ns) / 1e9
        said = f"{self._gone_m:.2f} m in {lasted_s:.1f} s"
        self._brakes |= self._comes_to_m(ctx) >= self._distance_m or ctx.now_ns - self._begun_ns >= self._duration_ns
        if self._brakes:
            self.ended = said if ctx.localisation.step.standing else ""
            return Twist()
        if ctx.now_ns - self._told_ns >= _PROGRESS_NS:
            self._told_ns = ctx.now_ns
            self.progress.append(said)
        return self._twist

    def _comes_to_m(self, ctx: Context) -> float:
        """Distance driven in all if the rover brakes now, m."""
        speed_mps = abs(ctx.localisation.estimate.speed_mps)
        return self._gone_m + speed_mps * (_LATE_S + speed_mps / (2.0 * self._brakes_mps2))
