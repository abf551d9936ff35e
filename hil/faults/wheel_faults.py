"""TABLE of the faults of a wheel, its steering, its sensors and the ground under it: fault -> begin and heal.

Each function takes the world and a wheel number 1..4; those of the ground ignore the wheel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from hil.devices.can.nodes import Encoder
from hil.plant.plant import DRIVE_NM
from hil.world.world import World
from onboard.native import elementary

WEAK_RATIO = 0.01  # 0.08 N m: enough on flat soil, not up a slope
POT_OFFSET_RAD = math.radians(6.0)
PATCH_M, PATCH_AHEAD_M = 1.5, 2.0  # radius and place of the soft patch: the front wheels reach it after 0.1 m
DUST_M = 1.0


class WheelFault(NamedTuple):
    """One fault: begin(world, wheel), heal(world, wheel). of_ground: whatever the wheel."""

    means: str
    begin: Callable[[World, int], None]
    heal: Callable[[World, int], None]
    of_ground: bool = False


def _stick(world: World, n: int) -> None:
    world.nodes.wheels[n - 1].drive_stuck = True
    world.plant.jam(n, True)


def _unstick(world: World, n: int) -> None:
    world.nodes.wheels[n - 1].drive_stuck = False
    world.plant.jam(n, False)


def _torque(ratio: float) -> Callable[[World, int], None]:
    return lambda world, n: world.plant.set_motor(n, ratio * DRIVE_NM)


def _fix_steering(world: World, n: int) -> None:
    world.nodes.wheels[n - 1].steer_stuck_rad = world.state.wheels[n - 1].steer_rad


def _free_steering(world: World, n: int) -> None:
    world.nodes.wheels[n - 1].steer_stuck_rad = None


def _encoder(does: Encoder) -> Callable[[World, int], None]:
    def set_encoder(world: World, n: int) -> None:
        world.nodes.wheels[n - 1].encoder = does

    return set_encoder


def _pot(offset_rad: float) -> Callable[[World, int], None]:
    def move(world: World, n: int) -> None:
        world.nodes.wheels[n - 1].pot_offset_rad += offset_rad

    return move


def _patch(soil: str, radius_m: float, ahead_m: float) -> Callable[[World, int], None]:
    """Function that puts another soil into a circle ahead in the direction of motion."""

    def lay(world: World, _n: int) -> None:
        x, y, _ = world.state.position_m
        vx, vy, _ = world.state.velocity_mps
        share = ahead_m / max(elementary.hypot(vx, vy), 1e-6)
        world.plant.patches.lay((x + share * vx, y + share * vy), radius_m, soil)

    return lay


def _sweep_patches(world: World, _n: int) -> None:
    world.plant.patches.sweep()


WHEEL_FAULTS: Mapping[str, WheelFault] = {
    "wheel_stuck": WheelFault("a wheel's gear jams", _stick, _unstick),
    "wheel_free": WheelFault("a wheel's drive gives no torque", _torque(0.0), _torque(1.0)),
    "wheel_weak": WheelFault("a wheel's drive gives 1 % of its torque", _torque(WEAK_RATIO), _torque(1.0)),
    "steer_stuck": WheelFault("a wheel's steering stays where it is", _fix_steering, _free_steering),
    "encoder_dead": WheelFault("an encoder gives no pulses", _encoder(Encoder.DEAD), _encoder(Encoder.GOOD)),
    "encoder_frozen": WheelFault("an encoder's register hangs", _encoder(Encoder.FROZEN), _encoder(Encoder.GOOD)),
    "encoder_jumping": WheelFault("an encoder jumps", _encoder(Encoder.JUMPING), _encoder(Encoder.GOOD)),
    "pot_offset": WheelFault("a steering pot reads 6 degrees too much", _pot(POT_OFFSET_RAD), _pot(-POT_OFFSET_RAD)),
    "soft_patch": WheelFault(
        "a patch of powder, 3 m across, begins before the wheels", _patch("powder", PATCH_M, PATCH_AHEAD_M),
        _sweep_patches, of_ground=True,
    ),
    "no_grip": WheelFault("dust without grip, 2 m across, is under the rover", _patch("dust", DUST_M, 0.0),
                          _sweep_patches, of_ground=True),
}  # fmt: skip
