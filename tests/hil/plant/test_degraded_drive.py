"""A wheel that fails at the start of a way: the way is held all the same, on the plant, over nodes and CAN frames.

The follower hears of the fault a second later, as the monitors promise. Worst distances from the way are printed (-rP).
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard.motion.wheel_health import DriveHealth, WheelHealth
from onboard.records import Path, Pose
from tests.hil.path_rig import PathRig
from tests.hil.small_fields import plane
from tests.onboard.motion.test_follower import arc, distance, path

DEG = math.pi / 180
HOLDS_M = 0.15
BEND_DEG = 35


def moved(track, dx_m, dy_m):
    return Path(track.stations + np.array([dx_m, dy_m, 0.0]))


PATHS = {  # and the wheel that fails: front left, rear right, rear left
    "straight": (path((-2, 0, 0), (2, 0, 0)), 1),
    "arc": (moved(arc(1.5, 75), -1.0, -1.0), 3),
    "bend": (path((-1.5, 0, 0), (-0.3, 0, 0), (-0.3, 0, BEND_DEG), (0.7, math.tan(BEND_DEG * DEG), BEND_DEG)), 2),
}
SHORT_AND_CAMPAIGN = ["straight", *(pytest.param(name, marks=pytest.mark.campaign) for name in ("arc", "bend"))]
FAULTS = {
    "steering fixed at 0": WheelHealth(steer_fixed_rad=0.0),
    "steering fixed at +10": WheelHealth(steer_fixed_rad=10 * DEG),
    "steering fixed at -25": WheelHealth(steer_fixed_rad=-25 * DEG),
    "drive free": WheelHealth(drive=DriveHealth.FREE),
    "drive stuck": WheelHealth(drive=DriveHealth.STUCK),
}


@pytest.fixture
def drive():
    rigs = []

    def run(track, n, health, slope_deg=0.0, limit_s=110.0):
        """Drives with wheel n failed: the rig, and the largest distance from the way."""
        x, y, yaw = track.stations[0]
        rig = PathRig(replace(plane(slope_deg), start=Pose(x, y, yaw_rad=yaw)))
        rigs.append(rig)
        rig.fail(n, health, told_s=1.0)
        return rig, max(distance(track, x, y) for x, y, _ in rig.drive(track, limit_s))

    yield run
    for rig in rigs:
        rig.plant.close()


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", SHORT_AND_CAMPAIGN)
def test_way_is_held_within_15_cm_with_a_failed_wheel(drive, name, fault):
    track, n = PATHS[name]
    rig, worst = drive(track, n, FAULTS[fault])
    print(f"{name}, wheel {n}, {fault}: {worst:.3f} m in {rig.tick / 100:.0f} s")
    assert rig.follower.done
    assert worst < HOLDS_M


def test_steering_fixed_at_60_degrees_rolls_up_a_slope_of_15_degrees_where_it_cannot_be_dragged(drive):
    track = path((-1, 0, 0), (0.5, 0, 0))
    rig, worst = drive(track, 2, WheelHealth(steer_fixed_rad=60 * DEG), slope_deg=15.0)
    print(f"up 15 deg, wheel 2, steering fixed at +60: {worst:.3f} m in {rig.tick / 100:.0f} s")
    assert rig.follower.done
    assert worst < HOLDS_M
    turned = max(abs(math.remainder(yaw, math.tau)) for _, _, yaw in rig.truth)
    assert turned == pytest.approx(60 * DEG, abs=0.15)  # its rim looks up the slope, the body aside
