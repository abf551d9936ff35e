"""TABLE of the faults of tilt axis, inertial sensor, power node and buttons: fault -> begin and heal.

Faults of the wheels: hil.faults.wheel_faults; of the bus: hil.faults.can_faults.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from hil.devices.can.node import Node
from hil.world.world import World
from protocol.generated.can_codec import StopReason

CLOCK_JUMP_US = 500_000
GYRO_STEP_RADPS = math.radians(0.2)
SAG_V = 9.0  # of 28 V: below the brown-out limit
LOW_RATIO = 0.05


class NodeFault(NamedTuple):
    """One fault: begin(world), heal(world)."""

    means: str
    begin: Callable[[World], None]
    heal: Callable[[World], None]


def _silent(node_of: Callable[[World], Node]) -> tuple[Callable[[World], None], Callable[[World], None]]:
    return lambda world: setattr(node_of(world), "silent", True), lambda world: setattr(node_of(world), "silent", False)


def _stall(stalled: bool) -> Callable[[World], None]:
    return lambda world: setattr(world.nodes.tilt, "stalled", stalled)


def _jump(world: World) -> None:
    world.nodes.tilt.clock_jump_us += CLOCK_JUMP_US


def _turn_gyro(step_radps: float) -> Callable[[World], None]:
    def step(world: World) -> None:
        world.nodes.imu.gyro_bias_radps[2] += step_radps

    return step


def _sag(sag_v: float) -> Callable[[World], None]:
    return lambda world: setattr(world.nodes.power, "sag_v", sag_v)


def _discharge(world: World) -> None:
    world.nodes.power.charge_ratio = LOW_RATIO


def _press(world: World) -> None:
    world.nodes.power.assert_stop(StopReason.BUTTON)


def _stays(_world: World) -> None:
    """Heal nothing: the computer releases a latched stop; a clock that jumped stays ahead, a battery stays empty."""


NODE_FAULTS: Mapping[str, NodeFault] = {
    "tilt_silent": NodeFault("the tilt node sends nothing more", *_silent(lambda world: world.nodes.tilt)),
    "tilt_stalled": NodeFault("the tilt axis does not move", _stall(True), _stall(False)),
    "tilt_clock_jump": NodeFault("the tilt node's clock jumps half a second ahead", _jump, _stays),
    "imu_silent": NodeFault("the inertial sensor sends nothing more", *_silent(lambda world: world.nodes.imu)),
    "imu_bias": NodeFault(
        "the yaw gyro reads 0.2 degrees a second too much", _turn_gyro(GYRO_STEP_RADPS), _turn_gyro(-GYRO_STEP_RADPS)
    ),
    "power_silent": NodeFault("the power node sends nothing more", *_silent(lambda world: world.nodes.power)),
    "brown_out": NodeFault("the bus voltage sags by 9 V", _sag(SAG_V), _sag(0.0)),
    "low_charge": NodeFault("5 % of the battery's charge are left", _discharge, _stays),
    "button_pressed": NodeFault("somebody presses the stop button at the rover", _press, _stays),
}
