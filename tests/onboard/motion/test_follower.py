"""The follower in a closed loop with an ideal rover: rigid-body motion, steering and wheels with limited rates."""

import itertools
import math

import numpy as np
import pytest

from onboard.config import Motion, Rover
from onboard.motion.follower import LAWS, Follower
from onboard.motion.kinematics import stopped, wheel_commands, wheel_places
from onboard.motion.odometry import body_twist
from onboard.records import Path, Pose, Twist, WheelCommand, WheelMode, WheelState

ROVER, MOTION = Rover(), Motion()
PLACES = wheel_places(ROVER)
DEG = math.pi / 180


class IdealRover:
    """Rolls without slip; steers at 0.5 rad/s, changes the wheels' rate by 1 rad/s2; one tick of 10 ms a step."""

    def __init__(self, x=0.0, y=0.0, yaw=0.0):
        self.x, self.y, self.yaw = x, y, yaw
        self.steer, self.rate = [0.0] * 4, [0.0] * 4

    def pose(self):
        return Pose(self.x, self.y, yaw_rad=math.remainder(self.yaw, math.tau))

    def states(self):
        return [WheelState(s, 0.0, r, 2, 0) for s, r in zip(self.steer, self.rate)]

    def step(self, orders):
        for k, order in enumerate(orders):
            self.steer[k] += max(-0.005, min(0.005, order.steer_rad - self.steer[k]))
            self.rate[k] += max(-0.01, min(0.01, order.rate_radps - self.rate[k]))
        hubs = [(r * 0.1 * math.cos(s), r * 0.1 * math.sin(s)) for s, r in zip(self.steer, self.rate)]
        (vx, vy, yaw), _ = body_twist(hubs, PLACES)
        middle = self.yaw + 0.005 * yaw
        self.x += 0.01 * (vx * math.cos(middle) - vy * math.sin(middle))
        self.y += 0.01 * (vx * math.sin(middle) + vy * math.cos(middle))
        self.yaw += 0.01 * yaw


def path(*corners, spacing=0.1):
    """Stations between (x, y, yaw in degrees) corners, evenly spaced, yaw turned evenly along the way."""
    stations = [corners[0]]
    for (ax, ay, at), (bx, by, bt) in itertools.pairwise(corners):
        n = max(1, math.ceil(math.hypot(bx - ax, by - ay) / spacing))
        stations += [(ax + (bx - ax) * k / n, ay + (by - ay) * k / n, at + (bt - at) * k / n) for k in range(1, n + 1)]
    return Path(np.array([(x, y, t * DEG) for x, y, t in stations]))


def distance(track, x, y):
    """Oracle: shortest distance of a point to the polyline of a path."""
    a, b = track.stations[:-1, :2], track.stations[1:, :2]
    d = b - a
    square = np.maximum((d * d).sum(1), 1e-12)
    t = np.clip(((np.array([x, y]) - a) * d).sum(1) / square, 0, 1)
    return float(np.min(np.hypot(*(a + t[:, None] * d - (x, y)).T)))


def drive(track, rover=None, motion=MOTION, limit_s=200.0, jump=None):
    """Runs to the end; returns the rover, the largest distance from the path, the seconds and the log of progress."""
    rover = rover or IdealRover(*track.stations[0])
    follower, orders, held = Follower(ROVER, motion), stopped([WheelCommand(WheelMode.HOLD, 0.0, 0.0)] * 4), False
    worst, progress, twist, tick = 0.0, [], Twist(), 0
    for tick in range(int(limit_s * 100)):
        if tick % 5 == 0:
            if jump and tick == jump[0]:
                rover.x, rover.y, rover.yaw = rover.x + jump[1], rover.y + jump[2], rover.yaw + jump[3]
            twist = follower.twist(track, rover.pose(), tick * 10_000_000)
            progress.append(follower.progress_ratio)
            worst = max(worst, distance(track, rover.x, rover.y))
        if follower.done and not any(rover.rate):
            break
        if tick % 2 == 0:
            orders, held = wheel_commands(twist, rover.states(), orders, ROVER, motion, held)
        rover.step(orders)
    assert follower.done, f"not there after {limit_s} s: {rover.pose()}, {progress[-1]}"
    return rover, worst, tick / 100, progress


def arc(radius, degrees, n=30):
    turn = [degrees * k / n for k in range(n + 1)]
    return path(*((radius * math.sin(t * DEG), radius * (1 - math.cos(t * DEG)), t) for t in turn), spacing=10)


PATHS = {
    "straight": path((0, 0, 0), (3, 0, 0)),
    "L with a turn on the spot": path((0, 0, 0), (2, 0, 0), (2, 0, 90), (2, 2, 90)),
    "L in crab": path((0, 0, 0), (2, 0, 0), (2, 2, 0)),
    "crab at 30 degrees": path((0, 0, 0), (2, 2 * math.tan(30 * DEG), 0)),
    "reverse": path((0, 0, 180), (2, 0, 180)),
    "ahead and back": path((0, 0, 0), (1, 0, 0), (0.2, 0, 0)),
    "turns on the spot": path((0, 0, 0), (0, 0, 45), (1, 1, 45), (1, 1, -45), (2, 0, -45), (2, 0, -135)),
    "a turn the long way": path((0, 0, 0), (1, 0, 0), (1, 0, 67), (1, 0, 135), (1, 0, 202), (1, 0, 270), (1, -1, 270)),
    "gentle corners": path((0, 0, 0), (1, 0, 0), (2, 0.16, 9), (3, 0.16, 0)),
    "arc of 1 m": arc(1.0, 120),
    "arc of 0.6 m": arc(0.6, 90),
    "yaw turning along the way": path((0, 0, 0), (2, 0, 80)),
    "only a turn": path((0, 0, 0), (0, 0, 120)),
}


@pytest.mark.parametrize("name", PATHS)
def test_path_is_kept_within_3_cm_and_ends_within_the_arrival_radius_and_heading(name):
    track = PATHS[name]
    rover, worst, _, progress = drive(track)
    x, y, yaw = track.stations[-1]
    assert worst < 0.03
    assert math.hypot(rover.x - x, rover.y - y) < MOTION.arrive_m
    assert abs(math.remainder(rover.yaw - yaw, math.tau)) < MOTION.arrive_yaw_rad
    assert progress == sorted(progress) and progress[-1] == 1.0


@pytest.mark.parametrize("name", [name for name in PATHS if "crab" not in name and name != "yaw turning along the way"])
def test_pure_pursuit_keeps_every_path_that_heads_along_its_way_within_3_cm(name):
    track = PATHS[name]
    rover, worst, *_ = drive(track, motion=Motion(law="pure-pursuit"))
    x, y, yaw = track.stations[-1]
    assert worst < 0.03
    assert math.hypot(rover.x - x, rover.y - y) < MOTION.arrive_m
    assert abs(math.remainder(rover.yaw - yaw, math.tau)) < MOTION.arrive_yaw_rad


@pytest.mark.parametrize("name", [name for name in PATHS if "crab" in name])
def test_pure_pursuit_turns_to_a_way_that_the_others_crab(name):
    track = PATHS[name]
    rover, worst, *_ = drive(track, motion=Motion(law="pure-pursuit"))
    x, y, yaw = track.stations[-1]
    assert worst < 0.08
    assert math.hypot(rover.x - x, rover.y - y) < MOTION.arrive_m
    assert abs(math.remainder(rover.yaw - yaw, math.tau)) < MOTION.arrive_yaw_rad


def test_way_beside_rocks_and_uphill_is_driven_slower():
    track = path((0, 0, 0), (3, 0, 0))
    beside = Path(track.stations, np.zeros(len(track.stations)))
    speeds = [
        Follower(ROVER, MOTION).twist(p, pose, 0).vx_mps
        for p, pose in (
            (track, Pose(1.0, 0.0)),
            (beside, Pose(1.0, 0.0)),
            (track, Pose(1.0, 0.0, pitch_rad=-20 * DEG)),
        )
    ]
    assert speeds == pytest.approx([0.11, 0.066, 0.066])


def test_look_ahead_is_a_length_along_the_slope():
    # 0.1 m beside a way up 20 degrees: the carrot is 0.35 m off in the slope's plane, 0.329 m of map ahead at most.
    track, pose = path((0, 0, 0), (3, 0, 0)), Pose(1.0, 0.1, pitch_rad=-20 * DEG)
    vx, vy, _ = Follower(ROVER, MOTION).twist(track, pose, 0)
    ahead_map_m = math.sqrt((0.35 * math.cos(20 * DEG)) ** 2 - 0.1**2)
    assert vy / vx == pytest.approx(-0.1 / (ahead_map_m / math.cos(20 * DEG)), rel=1e-6)


def test_straight_way_takes_what_cruise_speed_and_ramps_take():
    _, _, seconds, _ = drive(PATHS["straight"])
    assert 3 / 0.11 < seconds < 3 / 0.11 + 3.0


def test_turn_goes_the_way_round_that_its_stations_show():
    rover, *_ = drive(PATHS["a turn the long way"])
    assert rover.yaw == pytest.approx(270 * DEG, abs=0.1)  # not -90


def test_path_started_45_mm_and_20_degrees_off_is_met():
    track = PATHS["straight"]
    rover, worst, *_ = drive(track, IdealRover(0.0, 0.045, 20 * DEG))
    assert worst < 0.055
    assert math.hypot(rover.x - 3, rover.y) < 0.02


def test_path_started_backwards_turns_on_the_spot_first():
    track = PATHS["straight"]
    rover, worst, *_ = drive(track, IdealRover(0.0, 0.0, 170 * DEG))
    assert worst < 0.01
    assert abs(rover.y) < 0.01


@pytest.mark.parametrize("jump", [(0.04, 0.05, 0.05), (-0.08, -0.05, -0.05), (0.0, 0.08, 0.0), (0.3, 0.0, 0.0)])
@pytest.mark.parametrize("at", [500, 2450, 2600])
def test_jump_of_the_pose_by_a_registration_is_steered_out(jump, at):
    track = PATHS["straight"]
    rover, worst, *_ = drive(track, jump=(at, *jump))
    assert math.hypot(rover.x - 3, rover.y) < MOTION.arrive_m
    assert worst < max(abs(jump[0]), abs(jump[1])) + 0.03


def test_no_wheel_steers_faster_than_0_4_radps_in_gentle_ways():
    follower, rover, track = Follower(ROVER, MOTION), IdealRover(), PATHS["gentle corners"]
    orders, held, stops, last = stopped([WheelCommand(WheelMode.HOLD, 0.0, 0.0)] * 4), False, 0, None
    for tick in range(3500):
        if tick % 5 == 0:
            twist = follower.twist(track, rover.pose(), tick * 10_000_000)
            if follower.done:
                break
            orders, held = wheel_commands(twist, rover.states(), orders, ROVER, MOTION, held)
            stops += held
            steer = [o.steer_rad for o in orders]
            if last and tick > 200:
                assert max(abs(a - b) for a, b in zip(steer, last)) < 0.4 * 0.05 * 1.1
            last = steer
        rover.step(orders)
    assert follower.done
    assert stops == 0


def unicycle_overshoot(look_ahead_m):
    """Ideal unicycle 5 cm beside a straight path under the chapter's law."""
    motion = Motion(law="carrot", cruise_mps=0.11, heading_gain_hz=0.22, look_ahead_m=look_ahead_m)
    follower, track = Follower(ROVER, motion), path((0, 0, 0), (40, 0, 0))
    x, y, yaw, lowest = 0.0, 0.05, 0.0, 0.0
    for k in range(2400):
        twist = follower.twist(track, Pose(x, y, yaw_rad=yaw), k * 50_000_000)
        middle = yaw + twist.yaw_radps * 0.025
        x, y = x + twist.vx_mps * 0.05 * math.cos(middle), y + twist.vx_mps * 0.05 * math.sin(middle)
        yaw += twist.yaw_radps * 0.05
        lowest = min(lowest, y)
    return -lowest / 0.05


@pytest.mark.parametrize(("look_ahead_m", "overshoot"), [(1.0, 0.043), (0.2, 0.352)])
def test_fig_11b_overshoot_of_the_chapters_carrot_follows_its_damping(look_ahead_m, overshoot):
    zeta = 0.5 * math.sqrt(0.22 * look_ahead_m / 0.11)
    assert math.exp(-math.pi * zeta / math.sqrt(1 - zeta * zeta)) == pytest.approx(overshoot, abs=0.0015)
    assert unicycle_overshoot(look_ahead_m) == pytest.approx(overshoot, abs=0.008)


def test_chapters_carrot_cuts_an_l_but_arrives():
    track = path((0, 0, 0), (2, 0, 0), (2, 2, 90))
    rover, worst, *_ = drive(track, motion=Motion(law="carrot", heading_gain_hz=0.8))
    assert 0.005 < worst < 0.3
    assert math.hypot(rover.x - 2, rover.y - 2) < MOTION.arrive_m


def test_turn_ends_at_its_heading_the_short_way():
    follower = Follower(ROVER, MOTION)
    yaw, ticks = 170 * DEG, 0
    while not follower.done and ticks < 1000:
        twist = follower.turn(-150 * DEG, Pose(0, 0, yaw_rad=yaw))
        assert twist[:2] == (0.0, 0.0) and abs(twist.yaw_radps) <= MOTION.yaw_rate_limit_radps
        yaw += twist.yaw_radps * 0.05
        ticks += 1
    assert yaw == pytest.approx(210 * DEG, abs=MOTION.arrive_yaw_rad)
    assert follower.turn(-150 * DEG, Pose(0, 0, yaw_rad=yaw)) == Twist()


@pytest.mark.parametrize("stations", [[], [(1.0, 2.0, 0.3)], [(1.0, 2.0, 0.3)] * 2])
def test_path_without_a_way_is_done_at_once_where_the_rover_stands(stations):
    follower = Follower(ROVER, MOTION)
    track = Path(np.array(stations).reshape(-1, 3))
    assert follower.twist(track, Pose(1.0, 2.0, yaw_rad=0.3), 0) == Twist()
    assert follower.done and follower.progress_ratio == 1.0


def test_every_law_of_the_configuration_is_in_the_table():
    assert set(LAWS) == {"pose-carrot", "carrot", "pure-pursuit"}
