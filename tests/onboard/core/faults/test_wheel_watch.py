"""The wheel monitors on made-up signals: a rover that drives as ordered, and one thing that does not."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from onboard.config import Motion, Rover
from onboard.core.faults.wheels.offset import OffsetWatch
from onboard.core.faults.wheels.seen import TICK_S, WheelInputs, approach
from onboard.core.faults.wheels.slip import SlipWatch
from onboard.core.faults.wheels.watch import WheelWatch
from onboard.motion.kinematics import wheel_commands, wheel_places
from onboard.motion.odometry import Odometry, OdometryStep
from onboard.motion.wheel_health import SOUND, DriveHealth
from onboard.records import ImuSample, Twist, WheelCommand, WheelMode, WheelState
from protocol.generated.can_codec import NodeState
from protocol.tables.faults import BY_NAME

PLACES = wheel_places(Rover())
RADIUS_M, GRAVITY_MPS2, CRUISE_RADPS = 0.1, 1.62, 1.1
STEER_STEP_RAD = 0.005
LEVER_M, Q_M2 = math.hypot(*PLACES[0]), sum(a * a + b * b for a, b in PLACES)


@dataclass
class Wheel:
    """What one wheel does. The faults of a test are set here, between two runs."""

    steer_rad: float = 0.0
    owed_radps: float = 0.0
    position_rad: float = 0.0
    turns: float = 1.0  # share of what it owes
    current_a: float = 0.1
    steers: bool = True
    pot_rad: float = 0.0  # what the reading has too much
    jump_rad: float = 0.0
    frozen: tuple[float, float] | None = None  # position and rate that its encoder repeats
    state: int = NodeState.RUNNING
    heard: Callable[[int], bool] = lambda tick: True  # whether its frame of a tick comes
    last: WheelState | None = None


@dataclass
class Drive4:
    """Straight, or turning as the orders say, on level ground without noise. body: share of the wheels' speed."""

    wheels: list[Wheel] = field(default_factory=lambda: [Wheel() for _ in range(4)])
    body: float = 1.0
    extra_turn_radps: float = 0.0
    slip_ratio: float = 0.0
    shake_radps: float = 0.0

    def __post_init__(self):
        self.watch, self.odometry, self.tick, self.speed_mps = WheelWatch(Rover()), Odometry(Rover()), 0, 0.0
        self.first = {}

    def run(self, seconds, rate_radps=CRUISE_RADPS, steer_rad=0.0):
        """So much longer with one order for all wheels; the first tick of each fault's name, in s, is kept."""
        order = WheelCommand(WheelMode.RUN, steer_rad, rate_radps)
        for _ in range(round(seconds / TICK_S)):
            self.tick += 1
            self._step(order)
            for name in self.watch.faults:
                self.first.setdefault(name, self.tick * TICK_S)
        return self

    def after(self, seconds):
        """The names that were first found later than this, and how much later."""
        return {name: round(at - seconds, 2) for name, at in self.first.items() if at > seconds}

    def _step(self, order):
        states, true_rates = [], []
        for wheel in self.wheels:
            wheel.owed_radps = approach(wheel.owed_radps, order.rate_radps, TICK_S)
            if wheel.steers:
                wheel.steer_rad = approach(wheel.steer_rad, order.steer_rad, STEER_STEP_RAD)
            rate = wheel.owed_radps * wheel.turns
            wheel.position_rad += rate * TICK_S + wheel.jump_rad * (self.tick % 30 == 0)
            told = wheel.frozen or (wheel.position_rad, rate)
            fresh = WheelState(wheel.steer_rad + wheel.pot_rad, *told, wheel.state, 0)
            if wheel.heard(self.tick) or wheel.last is None:
                wheel.last = fresh
            else:
                wheel.last = wheel.last._replace(age_ns=wheel.last.age_ns + 10_000_000)
            states.append(wheel.last)
            true_rates.append(rate)
        step = self.odometry.update(self.watch.readings(states), self.tick * 10_000_000, self.watch.health)
        speed_mps = self.body * RADIUS_M * sum(true_rates) / 4
        thrust, self.speed_mps = (speed_mps - self.speed_mps) / TICK_S, speed_mps
        shake = self.shake_radps * (-1) ** (self.tick // 3)
        imu = ImuSample(self.tick * 10_000_000, (shake, 0.0, 0.0), (thrust, 0.0, GRAVITY_MPS2))
        currents_a = [wheel.current_a if self.tick % 5 == 0 else None for wheel in self.wheels]
        turn_radps, slip_ratio = self.extra_turn_radps, self.slip_ratio
        self.watch.update(WheelInputs(imu.stamp_ns, [order] * 4, states, currents_a, imu, step, turn_radps, slip_ratio))


def driving():
    """Stood for 2 s, driven for 4 s."""
    return Drive4().run(2.0, 0.0).run(4.0)


def test_a_sound_rover_that_starts_steers_and_stops_raises_nothing():
    rover = driving().run(3.0, steer_rad=0.6).run(3.0, -1.1, 0.6).run(2.0, 0.0, -0.4).run(3.0, 0.4, -0.4)
    assert rover.first == {}
    assert rover.watch.health == SOUND


@pytest.mark.parametrize("every", (2, 3, 4, 7))
def test_lost_frames_are_no_fault_of_an_encoder(every):
    rover = driving()
    rover.wheels[1].heard = lambda tick: tick % every != 0
    assert rover.run(3.0).first == {}


@pytest.mark.parametrize("ticks", range(20))  # a block is 20 ticks
def test_a_node_that_falls_silent_is_no_fault_of_its_encoder(ticks):
    rover = driving().run(ticks * TICK_S)
    rover.wheels[1].heard = lambda tick: False
    assert rover.run(1.0).first == {}


# -- drives and encoders -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", (1, 2, 3, 4))
@pytest.mark.parametrize(
    ("name", "fault", "drive"),
    [
        ("WHEEL_STUCK", {"turns": 0.0, "current_a": 10.0}, DriveHealth.STUCK),
        ("WHEEL_FREE", {"turns": 0.98, "current_a": 0.0}, DriveHealth.FREE),
        ("WHEEL_WEAK", {"turns": 0.9, "current_a": 0.05}, DriveHealth.FREE),
    ],
)
def test_a_failed_drive_is_named_of_its_wheel_within_a_second_and_goes_into_the_health(n, name, fault, drive):
    rover = driving()
    for key, value in fault.items():
        setattr(rover.wheels[n - 1], key, value)
    rover.run(1.2)
    assert set(rover.first) == {name}
    assert rover.after(6.0)[name] <= BY_NAME[name].detect_s
    assert rover.watch.faults[name] == (n,)
    assert [h.drive for h in rover.watch.health] == [drive if k == n - 1 else DriveHealth.GOOD for k in range(4)]


def test_a_wheel_that_stands_without_current_while_the_others_drag_it_is_stuck():
    rover = driving()
    for wheel in rover.wheels:
        wheel.current_a = 0.6
    rover.wheels[0].turns = rover.wheels[0].current_a = 0.0
    assert set(rover.run(1.0).first) == {"WHEEL_STUCK"}


def test_a_drive_that_misses_its_order_with_all_the_torque_it_wants_is_not_called_weak():
    rover = driving()
    rover.wheels[2].turns, rover.wheels[2].current_a = 0.9, -0.2  # it brakes: the ground pushes
    assert rover.run(2.0).first == {}


def test_a_free_wheel_is_not_named_while_no_wheel_has_work():
    rover = driving()
    for wheel in rover.wheels:
        wheel.current_a = 0.0
    rover.wheels[3].turns = 0.98
    assert rover.run(3.0).first == {}


def dead(wheel):
    wheel.frozen = (wheel.position_rad, 0.0)


def frozen(wheel):
    wheel.frozen = (wheel.position_rad, wheel.owed_radps)


def jumping(wheel):
    wheel.jump_rad = 0.5


@pytest.mark.parametrize("does", (dead, frozen, jumping))
def test_a_bad_encoder_is_named_within_a_second_and_left_out_of_the_odometry(does):
    rover = driving()
    does(rover.wheels[1])
    rover.run(1.0)
    assert set(rover.first) == {"ENCODER_BAD"}
    assert rover.watch.faults["ENCODER_BAD"] == (2,)
    assert [h.encoder for h in rover.watch.health] == [True, False, True, True]


@pytest.mark.parametrize("ticks", range(20))  # a block is 20 ticks
def test_a_dead_encoder_is_no_weak_drive_wherever_in_a_block_it_dies(ticks):
    rover = driving().run(ticks * TICK_S)
    rover.wheels[2].current_a = 0.3
    dead(rover.wheels[2])
    rover.run(1.0)
    assert set(rover.first) == {"ENCODER_BAD"}
    assert rover.watch.faults["ENCODER_BAD"] == (3,)


@pytest.mark.parametrize("ticks", range(20))
@pytest.mark.parametrize("jump_rad", (0.05, -0.5))
def test_one_jump_that_stays_is_the_encoders_and_named_within_half_a_second(ticks, jump_rad):
    rover = driving().run(ticks * TICK_S)
    begun_s = rover.tick * TICK_S
    rover.wheels[0].position_rad += jump_rad
    rover.run(1.0)
    assert set(rover.first) == {"ENCODER_BAD"}
    assert rover.after(begun_s)["ENCODER_BAD"] <= 0.5


@pytest.mark.parametrize("ticks", range(20))
@pytest.mark.parametrize("jump_rad", (0.05, -0.5))
def test_a_jump_that_is_gone_with_the_next_frame_is_an_accident_of_the_wire(ticks, jump_rad):
    rover = driving().run(ticks * TICK_S)
    for sign in (1.0, -1.0):
        rover.wheels[0].position_rad += sign * jump_rad
        rover.run(TICK_S)
    rover.run(3.0)
    assert "ENCODER_BAD" not in rover.first
    assert rover.watch.health == SOUND


def test_a_node_in_timeout_owes_nothing():
    rover = driving()
    for wheel in rover.wheels:
        wheel.state, wheel.turns, wheel.current_a = NodeState.COMMAND_TIMEOUT, 0.0, 0.0
    assert set(rover.run(2.0).first) <= {"SLIP_HIGH"}
    assert rover.watch.health == SOUND


# -- steering ------------------------------------------------------------------------------------------------------


def test_a_stuck_steering_is_named_half_a_second_after_it_is_three_degrees_away_with_its_angle():
    rover = driving()
    rover.wheels[0].steers = False
    rover.run(0.5, steer_rad=0.3)
    away_s = 6.0 + math.radians(3.0) / 0.5
    assert rover.after(away_s)["STEER_STUCK"] <= BY_NAME["STEER_STUCK"].detect_s
    assert rover.watch.faults["STEER_STUCK"] == (1,)
    assert [h.steer_fixed_rad for h in rover.watch.health] == [0.0, None, None, None]


def test_a_steering_that_was_left_turned_comes_home_and_is_not_stuck():
    rover = Drive4()
    rover.wheels[2].steer_rad = 0.7
    assert rover.run(2.0, 0.0).run(3.0).first == {}
    assert all(steer.off_rad == 0.0 for steer in rover.watch._steers)


OFF_RAD = math.radians(6.0)


def turn_of(n, off_rad, rate_radps=CRUISE_RADPS):
    """Yaw rate that the odometry has too much from a reading of wheel n that is wrong by off_rad, straight ahead."""
    a, _ = PLACES[n - 1]
    return a * RADIUS_M * rate_radps * math.sin(off_rad) / Q_M2


def test_a_pot_that_jumps_is_no_stuck_steering_and_within_five_metres_the_reading_is_said_to_be_wrong():
    rover = driving()
    rover.wheels[1].pot_rad = OFF_RAD
    rover.run(45.0)
    assert set(rover.first) == {"STEER_OFFSET"}  # the gyro does not turn: it is the reading
    assert rover.after(6.0)["STEER_OFFSET"] * RADIUS_M * CRUISE_RADPS <= 5.0
    assert rover.watch.faults["STEER_OFFSET"] == (2,)
    told = [WheelState(OFF_RAD, 0.0, 0.0, NodeState.RUNNING, 0)] * 4
    assert [s.steer_rad for s in rover.watch.readings(told)] == pytest.approx([OFF_RAD, 0.0, OFF_RAD, OFF_RAD])
    orders = [WheelCommand(WheelMode.RUN, 0.1, 1.0)] * 4
    assert list(rover.watch.orders(orders)) == orders


def test_where_the_gyro_turns_with_the_reading_the_wheel_stands_so_and_its_order_is_put_right():
    rover = driving()
    rover.wheels[3].pot_rad = OFF_RAD
    rover.extra_turn_radps = turn_of(4, OFF_RAD)
    rover.run(45.0)
    assert rover.watch.faults["STEER_OFFSET"] == (4,)
    orders = [WheelCommand(WheelMode.RUN, 0.2, 1.0)] * 4
    assert [o.steer_rad for o in rover.watch.orders(orders)] == pytest.approx([0.2, 0.2, 0.2, 0.2 - OFF_RAD])


def test_a_pot_that_jumps_does_not_hold_the_rover_where_it_is_before_it_is_known_to_lie():
    rover = driving()
    rover.wheels[1].pot_rad = OFF_RAD
    rover.run(0.5)
    assert rover.watch.faults == {}
    told = [wheel.last for wheel in rover.wheels]
    orders = [WheelCommand(WheelMode.RUN, 0.0, 0.0)] * 4

    def held(wheels):
        return wheel_commands(Twist(0.1, 0.0, 0.0), wheels, orders, Rover(), Motion(), True, SOUND)[1]

    assert held(rover.watch.readings(told))
    assert not held(rover.watch.steerings(told))


def test_a_turn_on_the_spot_says_nothing_of_an_offset_however_much_of_it_the_ground_keeps():
    watch, step_rad = OffsetWatch(PLACES[3], Q_M2), 0.25 * TICK_S
    reading = [WheelState(1.1, 0.0, 0.0, NodeState.RUNNING, 0)] * 4
    for _ in range(6000):
        step = OdometryStep(0.0, 0.0, step_rad, Twist(0.0, 0.0, 0.25), 0.0, 4, False, step_rad * LEVER_M)
        watch.update(OFF_RAD, step_rad * LEVER_M, WheelInputs(0, (), reading, (), None, step, 0.9 * 0.25, 0.0), 3)
    assert 6000 * step_rad * LEVER_M > 5.0
    assert watch.open and watch._way_m == 0.0


# -- slip ----------------------------------------------------------------------------------------------------------


def test_a_rover_that_lacks_half_its_speed_slips_within_a_metre_and_is_calm_three_seconds_after():
    rover = driving()
    rover.body, rover.shake_radps = 0.45, 0.02
    rover.run(3.0)
    assert set(rover.first) == {"SLIP_HIGH"}
    assert rover.after(6.0)["SLIP_HIGH"] * RADIUS_M * CRUISE_RADPS <= 1.0
    rover.body = 1.0
    assert rover.run(8.0).watch.faults == {}


def test_a_rover_that_a_stone_turns_by_seven_degrees_does_not_slip():
    rover = driving()
    rover.extra_turn_radps = math.radians(7.0)
    rover.run(1.0)
    rover.extra_turn_radps = 0.0
    assert rover.run(15.0).first == {}


def test_a_rover_that_turns_otherwise_than_its_wheels_slips():
    rover = driving()
    rover.extra_turn_radps = math.radians(9.0) * RADIUS_M * CRUISE_RADPS  # 9 degrees a metre
    rover.run(10.0)
    assert set(rover.after(6.0)) == {"SLIP_HIGH"}
    assert rover.after(6.0)["SLIP_HIGH"] * RADIUS_M * CRUISE_RADPS <= 1.0


def slip_after_a_turn_on_the_spot(loss_ratio, seconds=12.0, yaw_radps=0.25):
    """The slip monitor after a turn that the gyro sees short of the odometry's by so much."""
    watch, step_rad = SlipWatch(), yaw_radps * TICK_S
    for tick in range(round(seconds / TICK_S)):
        step = OdometryStep(0.0, 0.0, step_rad, Twist(0.0, 0.0, yaw_radps), 0.0, 4, False, step_rad * LEVER_M)
        turn_radps = (1.0 - loss_ratio) * yaw_radps
        imu = ImuSample(tick * 10_000_000, (0.0, 0.0, turn_radps), (0.0, 0.0, GRAVITY_MPS2))
        watch.update(WheelInputs(imu.stamp_ns, (), (), (), imu, step, turn_radps, 0.0), strays=True)
    return watch


def test_a_turn_on_the_spot_that_loses_a_tenth_is_no_slip_though_it_is_six_degrees_in_a_metre_of_the_rims():
    a_metre_rad = 1.0 / LEVER_M
    assert math.degrees(0.1 * a_metre_rad) > 5.0 and a_metre_rad < 12.0 * 0.25
    assert not slip_after_a_turn_on_the_spot(0.1).high


def test_a_turn_on_the_spot_that_loses_half_is_slip():
    assert slip_after_a_turn_on_the_spot(0.5).high


def test_the_filters_slip_ratio_counts_too():
    rover = driving()
    rover.slip_ratio = 0.5
    assert set(rover.run(0.02).first) == {"SLIP_HIGH"}


def test_a_rover_whose_wheels_turn_and_that_stands_is_found_within_five_seconds():
    rover = driving()
    rover.body = 0.0
    rover.run(6.0)
    assert rover.after(6.0)["NOT_MOVING"] <= BY_NAME["NOT_MOVING"].detect_s
    rover.run(3.0, 0.0)
    assert "NOT_MOVING" not in rover.watch.faults


def test_a_rover_that_does_not_start_is_found_within_five_seconds_of_its_wheels_turning():
    rover = Drive4(body=0.0).run(2.0, 0.0).run(6.0)
    assert rover.after(2.0)["NOT_MOVING"] <= BY_NAME["NOT_MOVING"].detect_s + 1.0  # a second to speed up


def test_a_rover_that_is_shaken_by_its_way_moves_whatever_the_accelerometer_says():
    rover = driving()
    rover.body, rover.shake_radps = 0.0, 0.02
    assert "NOT_MOVING" not in rover.run(8.0).first


@pytest.mark.parametrize(("kept", "stands"), [(0.0, False), (0.9, True)])
def test_a_rover_that_turns_on_the_spot_moves_whatever_an_encoder_made_of_it_for_a_moment(kept, stands):
    watch = SlipWatch()

    def goes(seconds, twist, turn_radps):
        for _ in range(round(seconds / TICK_S)):
            step = OdometryStep(0.0, 0.0, twist.yaw_radps * TICK_S, twist, 0.0, 4, twist == Twist(), 0.0)
            imu = ImuSample(0, (0.0, 0.0, turn_radps), (0.0, 0.0, GRAVITY_MPS2))
            watch.update(WheelInputs(0, (), (), (), imu, step, turn_radps, 0.0), strays=True)

    turn_radps = (1.0 - kept) * 0.25
    goes(2.0, Twist(), 0.0)
    goes(2.0, Twist(0.0, 0.0, 0.25), turn_radps)
    goes(0.4, Twist(0.05, 0.08, 0.03), turn_radps)  # two jumps of a wheel by 0.7 rad
    goes(4.0, Twist(0.0, 0.0, 0.25), turn_radps)
    assert watch.still is stands


def test_a_rover_that_slides_before_it_stands_is_found_within_five_seconds():
    rover = driving()
    rover.body, rover.shake_radps = 0.0, 0.02
    rover.run(2.2)
    rover.shake_radps = 0.0
    assert rover.run(3.0).after(6.0)["NOT_MOVING"] <= BY_NAME["NOT_MOVING"].detect_s
