"""Inputs of the wheel monitors in one tick, as plain values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from onboard.motion.odometry import OdometryStep
from onboard.native.elementary import hypot
from onboard.records import ImuSample, Twist, WheelCommand, WheelState
from protocol.conventions import TICK_NS
from protocol.generated.can_codec import NodeState

TICK_S = 0.01
FRESH_NS = 30_000_000
LEAST_MPS = 0.04  # slower wheels do not drive the rover: they start, or turn it on the spot


class WheelInputs(NamedTuple):
    """One tick. Wheels 1 to 4 in each sequence.

    now_ns: time of the tick.
    orders: last orders sent.
    wheels: newest feedback, as read.
    currents_a: currents of the drives; None where no status came since the last tick.
    imu: newest sample.
    step: odometry.
    turn_radps: yaw rate of the gyro, bias removed.
    slip_ratio: estimate of the filter, which registrations correct.
    """

    now_ns: int
    orders: Sequence[WheelCommand]
    wheels: Sequence[WheelState | None]
    currents_a: Sequence[float | None]
    imu: ImuSample | None
    step: OdometryStep
    turn_radps: float
    slip_ratio: float


def unheard(seen: WheelInputs) -> WheelInputs:
    """Return the inputs of a left-out tick after `seen`: no data; the next tick's step contains its motion."""
    wheels = tuple(state and state._replace(age_ns=TICK_NS) for state in seen.wheels)
    return seen._replace(
        now_ns=seen.now_ns + TICK_NS,
        wheels=wheels,
        currents_a=(None,) * len(wheels),
        step=seen.step._replace(dx_m=0.0, dy_m=0.0, dyaw_rad=0.0, rolled_m=0.0),
    )


def works(state: WheelState | None) -> bool:
    """Return whether a wheel's node runs and its data is fresh; only then do wheel and steering owe their order."""
    return state is not None and state.age_ns <= FRESH_NS and state.state == NodeState.RUNNING


def speed_mps(twist: Twist) -> float:
    """Speed of translation, without rotation."""
    return hypot(twist.vx_mps, twist.vy_mps)


def approach(value: float, target: float, most: float) -> float:
    """Value after one step of at most `most` towards the target: a drive's ramp or a steering's rate limit."""
    step = target - value
    return value + (most if step > most else -most if step < -most else step)
