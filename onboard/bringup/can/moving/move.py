"""Movement of `onboard can jog` and `home`, and its limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

from onboard.config import Rover

RATE_LIMIT_RADPS, TIME_LIMIT_S, TILT_LIMIT_RAD = 2.0, 10.0, 1.2
WHEELS = (1, 2, 3, 4)
T = TypeVar("T", float, None)


class BoundsError(ValueError):
    """Request over the limits of a movement by hand."""


@dataclass(frozen=True, slots=True)
class Move:
    """One movement of wheels 1 to 4 and the tilt axis.

    limit_s: time after which it ends.
    steer_rad: steering target of each wheel, None: do not steer.
    rate_radps: wheel rate of each wheel.
    tilt_rad: target of the axis, None: do not move.
    """

    limit_s: float
    steer_rad: tuple[float | None, ...] = (None,) * 4
    rate_radps: tuple[float, ...] = (0.0,) * 4
    tilt_rad: float | None = None

    @property
    def wheels(self) -> tuple[int, ...]:
        """The wheels that are to move."""
        return tuple(n for n in WHEELS if self.steer_rad[n - 1] is not None or self.rate_radps[n - 1])

    @property
    def nodes(self) -> tuple[str, ...]:
        """The nodes that must be present."""
        return (*(f"WHEEL_{n}" for n in self.wheels), *(("TILT",) if self.tilt_rad is not None else ()))

    def __str__(self) -> str:
        """Description for the question before the movement."""
        steers = [s for s in self.steer_rad if s is not None]
        if len(steers) == len(WHEELS):
            return "all wheels will steer to 0 and the tilt axis will park level"
        if self.tilt_rad is not None:
            return f"the tilt axis will go to {self.tilt_rad:+.3f} rad ({math.degrees(self.tilt_rad):+.1f} degrees)"
        (n,) = self.wheels
        if steers:
            return f"wheel {n} will steer to {steers[0]:+.3f} rad ({math.degrees(steers[0]):+.1f} degrees)"
        return f"wheel {n} will turn at {self.rate_radps[n - 1]:+.2f} rad/s for {self.limit_s:g} s"


def turn(n: int, rate_radps: float, seconds: float, rover: Rover) -> Move:
    """Turn wheel n. Raises BoundsError."""
    fastest_radps = min(RATE_LIMIT_RADPS, rover.wheel_rate_limit_radps)
    _within("--rate", rate_radps, fastest_radps, "rad/s")
    if not rate_radps:
        raise BoundsError("--rate 0 moves nothing")
    return Move(_time(seconds), rate_radps=_one(n, rate_radps, 0.0))


def steer(n: int, angle_rad: float, seconds: float, rover: Rover) -> Move:
    """Steer wheel n. Raises BoundsError."""
    _within("--steer", angle_rad, rover.steer_limit_rad, "rad")
    return Move(_time(seconds), steer_rad=_one(n, angle_rad, None))


def tilt(angle_rad: float, seconds: float) -> Move:
    """Move the axis to an angle, positive down. Raises BoundsError."""
    _within("--tilt", angle_rad, TILT_LIMIT_RAD, "rad")
    return Move(_time(seconds), tilt_rad=angle_rad)


def home(seconds: float = TIME_LIMIT_S) -> Move:
    """Steer all wheels straight ahead and move the axis level. Raises BoundsError."""
    return Move(_time(seconds), steer_rad=(0.0,) * 4, tilt_rad=0.0)


def _one(n: int, value: float, other: T) -> tuple[float | T, ...]:
    return tuple(value if k == n else other for k in WHEELS)


def _time(seconds: float) -> float:
    if not 0 < seconds <= TIME_LIMIT_S:
        raise BoundsError(f"--for {seconds:g} should be over 0 and at most {TIME_LIMIT_S:g} s")
    return seconds


def _within(name: str, value: float, limit: float, unit: str) -> None:
    if not abs(value) <= limit:
        raise BoundsError(f"{name} {value:g} should be within -{limit:.3g} and {limit:.3g} {unit}")
