"""Which wheels touch a rock, without physics: tyres of true width and radius on the true soil against the true rocks.

The rule is the plant's: a wheel on a rock of more than ROCK_LIMIT_M is a collision, by whatever part of the rock.

        \\     /        a tyre's underside: soil under its axle + R - sqrt(R^2 - along^2)
         \\___/   /^\\    it touches where the rock's surface is higher, anywhere over the tyre's width
    -------------/   \\--- soil
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hil.plant.plant import ROCK_LIMIT_M
from hil.terrain.rocks import rock_top
from onboard.config import Rover
from onboard.records import Pose
from protocol.conventions import WHEEL_SIGNS, wrap_rad
from tests.missions.world.world import World, wheels

SAMPLE_M = 0.0125
STEP_M, STEP_RAD = 0.02, math.radians(2.0)  # between two poses contact is checked this often
JUMP_M = 1.0  # poses farther apart are not the ends of one movement


def touches(world: World, pose: Pose, rover: Rover, turning: bool = False) -> Iterator[tuple[int, int]]:
    """(rock, wheel 1..4) of each tyre on a rock. turning: the wheels are steered for a turn on the spot."""
    reach_m = math.hypot(rover.half_wheelbase_m, rover.half_track_m) + math.hypot(
        rover.wheel_radius_m, rover.wheel_width_m / 2
    )
    near = [
        n
        for n, rock in enumerate(world.rocks)
        if rock.height_m > ROCK_LIMIT_M
        and math.hypot(rock.x_m - pose.x_m, rock.y_m - pose.y_m) < reach_m + rock.diameter_m / 2
    ]
    if not near:
        return
    radius_m, half_m = rover.wheel_radius_m, rover.wheel_width_m / 2
    along, across = (
        part.ravel()
        for part in np.meshgrid(
            np.linspace(-radius_m, radius_m, round(2 * radius_m / SAMPLE_M) + 1),
            np.linspace(-half_m, half_m, round(2 * half_m / SAMPLE_M) + 1),
        )
    )
    under = radius_m - np.sqrt(radius_m**2 - along**2)
    for wheel, ((x_m, y_m), (a, b)) in enumerate(zip(wheels(pose, rover), WHEEL_SIGNS), 1):
        yaw = pose.yaw_rad + (math.atan2(a * rover.half_wheelbase_m, -b * rover.half_track_m) if turning else 0.0)
        c, s = math.cos(yaw), math.sin(yaw)
        x, y = x_m + c * along - s * across, y_m + s * along + c * across
        soil_m = float(world.soil_height_m(np.array([x_m]), np.array([y_m]))[0])
        for n in near:
            if (rock_top(world.rocks[n], x, y) > soil_m + under).any():
                yield n, wheel


def between(a: Pose, b: Pose) -> Iterator[tuple[float, float, float, bool]]:
    """Yield places x, y, yaw from a to b, b included, in small steps, and whether it is a turn on the spot."""
    way_m, turn = math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)), wrap_rad(b.yaw_rad - a.yaw_rad)
    pieces = 1 if way_m > JUMP_M else max(1, math.ceil(way_m / STEP_M), math.ceil(abs(turn) / STEP_RAD))
    on_spot = way_m < STEP_M and turn != 0.0
    for k in range(1, pieces + 1):
        share = k / pieces
        yield a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m), a.yaw_rad + share * turn, on_spot
