"""What the wheel monitors look at in one tick, as plain values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from onboard.motion.odometry import Step
from onboard.native.elementary import hypot
from onboard.records import ImuSample, Twist, WheelCommand, WheelState
from protocol.can_codec import NodeState
from protocol.conventions import TICK_NS

TICK_S = 0.01
FRESH_NS = 30_000_000
LEAST_MPS = 0.04  # slower wheels drive the rover nowhere: they start, or turn it on the spot


class Seen(NamedTuple):
    """One tick. Wheels 1 to 4 in each sequence.

    orders: those last sent. wheels: newest feedback, as read. currents_a: of the drives, where a status came since the
    last tick, else None. imu: newest sample. step: odometry. turn_radps: yaw rate of the gyro, its bias taken out.
    slip_ratio: the filter's, moved by registrations.
    """

    now_ns: int
    orders: Sequence[WheelCommand]
    wheels: Sequence[WheelState | None]
    currents_a: Sequence[float | None]
    imu: ImuSample | None
    step: Step
    turn_radps: float
    slip_ratio: float


def unheard(seen: Seen) -> Seen:
    """A tick after `seen` that was left out: nothing came; how far the rover got in it is in the next one's step."""
    wheels = tuple(state and state._replace(age_ns=TICK_NS) for state in seen.wheels)
    return seen._replace(
        now_ns=seen.now_ns + TICK_NS, wheels=wheels, currents_a=(None,) * len(wheels),
        step=seen.step._replace(dx_m=0.0, dy_m=0.0, dyaw_rad=0.0, rolled_m=0.0),
    )  # fmt: skip


def works(state: WheelState | None) -> bool:
    """Whether a wheel's node runs and was heard: only then do its wheel and steering owe what was ordered."""
    return state is not None and state.age_ns <= FRESH_NS and state.state == NodeState.RUNNING


def speed_mps(twist: Twist) -> float:
    """How fast it goes, whatever it turns."""
    return hypot(twist.vx_mps, twist.vy_mps)


def approach(value: float, target: float, most: float) -> float:
    """One step of at most `most` towards the target: how a drive ramps and a steering turns."""
    step = target - value
    return value + (most if step > most else -most if step < -most else step)
