"""The filter on simulated drives: exact wheels, a noisy biased gyro, gravity; truth integrated beside it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard.config import Localisation as Config
from onboard.config import Motion, Rover
from onboard.motion.follower import Follower
from onboard.motion.kinematics import stopped, wheel_commands, wheel_places
from onboard.motion.odometry import body_twist
from onboard.perception.pose.localisation import Localisation, slide_ratio
from onboard.perception.pose.pose_filter import REACH_SIGMA
from onboard.perception.pose.registration import RegistrationResult
from onboard.records import ImuSample, Path, Pose, Twist, WheelCommand, WheelMode, WheelState

PLACES = wheel_places(Rover())
DEG = math.pi / 180
STILL = Twist()


class Drive:
    """Truth and sensors: twist by twist at 100 Hz on a plane of constant roll and pitch in body axes.

    The rims lose `slip` of their way and the filter expects that they lose nothing, until a stop tells it.
    """

    def __init__(self, seed=1, bias=0.0, noise=0.0, slip=0.0, roll=0.0, pitch=0.0, config=None):
        self.filter = Localisation(Rover(), replace(config or Config(), level_slip_ratio=0.0))
        self.rng = np.random.default_rng(seed)
        self.bias, self.noise, self.slip, self.roll, self.pitch = bias, noise, slip, roll, pitch
        self.x = self.y = self.yaw = self.way = 0.0
        self.now_ns, self.positions, self.steer = 0, [0.0] * 4, [0.0] * 4
        self.imu = True

    def run(self, twist, seconds):
        for _ in range(round(seconds * 100)):
            self.tick(twist)
        return self

    def tick(self, twist, slips=False):
        keep = 1 - self.slip
        for k, (a, b) in enumerate(PLACES):
            u, w = twist.vx_mps - twist.yaw_radps * b, twist.vy_mps + twist.yaw_radps * a
            if (u, w) != (0.0, 0.0):
                self.steer[k] = math.atan2(w, u)
                self.positions[k] += math.hypot(u, w) * 0.01 / 0.1
        middle = self.yaw + 0.005 * twist.yaw_radps
        level = keep * 0.01 * twist.vx_mps * math.cos(self.pitch)
        self.x += level * math.cos(middle) - keep * 0.01 * twist.vy_mps * math.sin(middle)
        self.y += level * math.sin(middle) + keep * 0.01 * twist.vy_mps * math.cos(middle)
        self.yaw += 0.01 * twist.yaw_radps
        self.way += keep * 0.01 * twist.vx_mps
        self.now_ns += 10_000_000
        wheels = [WheelState(s, p, 0.0, 2, 0) for s, p in zip(self.steer, self.positions)]
        self.filter.update(wheels, self.sample(twist) if self.imu else None, self.now_ns, slips=slips)

    def sample(self, twist):
        noise = self.rng.standard_normal(6) * self.noise
        sp, cp, sr, cr = math.sin(self.pitch), math.cos(self.pitch), math.sin(self.roll), math.cos(self.roll)
        rate = twist.yaw_radps  # about the map's vertical
        gyro = (-sp * rate + noise[0], cp * sr * rate + noise[1], cp * cr * rate + self.bias + noise[2])
        force = (-1.62 * sp + noise[3], 1.62 * cp * sr + noise[4], 1.62 * cp * cr + noise[5])
        return ImuSample(self.now_ns, gyro, force)

    def error(self):
        pose = self.filter.pose
        return math.hypot(pose.x_m - self.x, pose.y_m - self.y), math.remainder(pose.yaw_rad - self.yaw, math.tau)

    def registration(self, dx=0.0, dy=0.0, dyaw=0.0, **change):
        pose = Pose(self.x + dx, self.y + dy, self.filter.pose.z_m, self.roll, self.pitch, self.yaw + dyaw)
        made = RegistrationResult(
            True, "", pose.matrix(), np.diag([0.01, 0.01, 0.01, 0.002]) ** 2, True, 0.9, 0.01, 0.0, 0.0, ()
        )
        return replace(made, **change)


def test_exact_sensors_give_the_exact_way():
    drive = Drive().run(STILL, 1).run(Twist(0.11, 0, 0), 10).run(Twist(0.08, 0.03, 0.1), 10).run(STILL, 1)
    distance, yaw = drive.error()
    assert distance < 1e-3 and abs(yaw) < 1e-4
    assert drive.filter.ready


def test_first_half_second_of_standing_gives_roll_and_pitch():
    drive = Drive(roll=5 * DEG, pitch=-8 * DEG, noise=0.01).run(STILL, 0.6)
    pose = drive.filter.pose
    assert (pose.x_m, pose.y_m, pose.z_m) == (0, 0, 0) and abs(pose.yaw_rad) < 1e-3
    assert (pose.roll_rad, pose.pitch_rad) == pytest.approx((5 * DEG, -8 * DEG), abs=0.3 * DEG)


def test_driving_up_a_slope_of_10_degrees_rises_by_its_sine():
    drive = Drive(pitch=-10 * DEG, config=Config(slope_slip_ratio=0)).run(STILL, 1).run(Twist(0.1, 0, 0), 20)
    pose = drive.filter.pose
    assert pose.z_m == pytest.approx(2.0 * math.sin(10 * DEG), abs=0.005)
    assert pose.x_m == pytest.approx(2.0 * math.cos(10 * DEG), abs=0.005)


@pytest.mark.parametrize(
    ("tilt", "place"),
    [
        # 0.4 of 2 m times -0.7 ln(1 - tan(10 deg) / 0.7) = 0.1626 m down the slope, from where 2 m of wheels would lead
        ({"pitch": 10 * DEG}, (2.1626 * 0.9848, 0.0, -2.1626 * 0.1736)),  # nose down: farther ahead
        ({"pitch": -10 * DEG}, (1.8374 * 0.9848, 0.0, 1.8374 * 0.1736)),  # nose up: falls short
        ({"roll": 10 * DEG}, (2.0, -0.1626 * 0.9848, -0.1626 * 0.1736)),  # left side up: to the right, and lower
        ({"roll": -10 * DEG}, (2.0, 0.1626 * 0.9848, -0.1626 * 0.1736)),
    ],
)
def test_a_way_of_2_m_slides_down_a_slope_of_10_degrees_by_16_cm(tilt, place):
    config = Config(slope_slip_ratio=0.4, soil_friction_rad=math.atan(0.7))
    drive = Drive(**tilt, config=config).run(STILL, 1).run(Twist(0.1, 0, 0), 20)
    pose = drive.filter.pose
    assert (pose.x_m, pose.y_m, pose.z_m) == pytest.approx(place, abs=0.005)


def test_a_turn_on_the_spot_slides_by_the_way_of_the_rims_and_standing_does_not():
    drive = Drive(pitch=10 * DEG, config=Config(slope_slip_ratio=0.4, soil_friction_rad=math.atan(0.7)))
    drive.steer = [math.atan2(a, -b) for a, b in PLACES]  # across the way to the centre, before it turns
    drive.run(STILL, 3)
    assert drive.filter.pose.x_m == drive.filter.pose.z_m == 0.0
    pose = drive.run(Twist(0, 0, 0.25), 0.4).filter.pose  # 0.1 rad: each rim goes 0.1 of its wheel's distance
    slide_m = 0.4 * 0.1 * math.hypot(*PLACES[0]) * math.tan(10 * DEG)  # and a seventh more: nearer to what soil bears
    slide_m *= -math.log(1 - math.tan(10 * DEG) / 0.7) * 0.7 / math.tan(10 * DEG)
    assert math.hypot(pose.x_m, pose.y_m, pose.z_m) == pytest.approx(slide_m, rel=0.05)
    assert pose.z_m == pytest.approx(-slide_m * math.sin(10 * DEG), rel=0.05)


def test_gravity_brings_back_a_tilt_within_three_time_constants_and_spikes_are_left_out():
    drive = Drive().run(STILL, 1)
    drive.roll = 6 * DEG
    drive.run(STILL, 8)
    assert drive.filter.pose.roll_rad == pytest.approx(6 * DEG, abs=0.2 * DEG)
    before = drive.filter.pose.pitch_rad
    wheels = [WheelState(0.0, 0.0, 0.0, 2, 0)] * 4
    for k in range(20):
        now = drive.now_ns + (k + 1) * 10_000_000
        drive.filter.update(wheels, ImuSample(now, (0.0, 0.0, 0.0), (5.0, 0.0, 1.6)), now)
    assert drive.filter.pose.pitch_rad == pytest.approx(before, abs=1e-3)


def test_gyro_bias_that_comes_later_is_learned_while_standing_and_the_yaw_stays():
    drive = Drive(bias=0.003, noise=0.002).run(STILL, 5)
    drive.bias = 0.005
    drive.run(STILL, 60)
    assert abs(drive.filter.pose.yaw_rad) < 1e-3
    drive.run(Twist(0.11, 0, 0), 40)
    assert abs(drive.error()[1]) < 0.5 * DEG  # 0.002 rad/s not learned would make 4.6 degrees


def test_standing_corrects_the_drive_before_by_the_bias_learned_and_then_the_pose_does_not_creep():
    drive = Drive(noise=0.002).run(STILL, 1).run(Twist(0.11, 0, 0.02), 10).run(STILL, 1)
    first = drive.error()
    drive.run(STILL, 60)
    before, second = drive.filter.pose, drive.error()
    assert second[0] < first[0] and abs(second[1]) < abs(first[1])
    drive.run(STILL, 60)
    after = drive.filter.pose
    assert math.hypot(after.x_m - before.x_m, after.y_m - before.y_m) < 2e-4
    assert abs(after.yaw_rad - before.yaw_rad) < 2e-4


def test_silent_imu_leaves_the_turn_to_the_wheels():
    drive = Drive().run(STILL, 1)
    drive.imu = False
    drive.run(Twist(0.1, 0, 0.1), 10)
    assert drive.error()[0] < 0.02 and abs(drive.error()[1]) < 0.02


def test_samples_of_the_imu_that_come_a_tick_late_or_twice_change_nothing_that_matters():
    drive = Drive().run(STILL, 1)
    plain = drive.sample
    drive.sample = lambda twist: None if (drive.now_ns // 10_000_000) % 3 == 0 else plain(twist)
    drive.run(Twist(0.1, 0, 0.1), 10)
    assert drive.error()[0] < 2e-3 and abs(drive.error()[1]) < 2e-3


def test_covariance_grows_with_the_slip_that_is_not_known_and_a_registration_shrinks_it():
    drive = Drive(config=Config(odometry_noise_ratio=0.08)).run(STILL, 1).run(Twist(0.1, 0, 0), 40).run(STILL, 1)
    sigma = math.sqrt(drive.filter.estimate.covariance[0, 0])
    assert 0.08 * 4 < sigma < 0.12 * 4
    assert drive.filter.register(drive.registration())
    assert math.sqrt(drive.filter.estimate.covariance[0, 0]) < math.hypot(0.0101, 4.0 * REACH_SIGMA)
    assert drive.error()[0] < 1e-3


def test_while_the_wheels_are_said_to_slip_two_fifths_of_their_way_adds_to_the_sigma_of_each_spell():
    drive = Drive().run(STILL, 1.0).run(Twist(0.1), 1.0)
    sound_m2 = drive.filter.sigmas[0] ** 2
    for spells, metres in ((1, 0.4), (2, 0.4)):
        for _ in range(round(metres * 1000)):
            drive.tick(Twist(0.1), slips=True)
        drive.run(Twist(0.1), 0.5)
        added_m2 = drive.filter.sigmas[0] ** 2 - sound_m2
        assert added_m2 == pytest.approx(spells * (0.4 * (metres + 0.1)) ** 2, rel=0.05)


def test_slip_of_15_percent_is_learned_from_registrations():
    drive = Drive(slip=0.15, config=Config(odometry_noise_ratio=0.05)).run(STILL, 1)
    for _ in range(4):
        drive.run(Twist(0.11, 0, 0), 30).run(STILL, 1)
        assert drive.filter.register(drive.registration())
        assert drive.error()[0] < 0.02
    assert drive.filter.slip_ratio == pytest.approx(0.15, abs=0.01)
    drive.run(Twist(0.11, 0, 0), 30)
    assert drive.error()[0] < 0.03  # 0.5 m without


@pytest.mark.parametrize(("roll_deg", "pitch_deg"), [(0.5, 0.0), (0.0, -3.0), (4.0, 3.0)])
def test_on_a_small_slope_the_slide_is_the_slopes_tangent_times_the_ratio(roll_deg, pitch_deg):
    slope = math.acos(math.cos(roll_deg * DEG) * math.cos(pitch_deg * DEG))
    slide = slide_ratio(roll_deg * DEG, pitch_deg * DEG, Config(slope_slip_ratio=0.36)) * math.sin(slope)
    assert slide == pytest.approx(0.36 * math.tan(slope), rel=0.08)


@pytest.mark.parametrize("slope_deg", [34.9, 35.0, 60.0])
def test_a_slope_steeper_than_the_soil_bears_slides_by_no_more_than_just_below(slope_deg):
    config = Config(slope_slip_ratio=0.36, soil_friction_rad=35 * DEG)
    slide = slide_ratio(0.0, slope_deg * DEG, config) * math.sin(slope_deg * DEG)
    assert slide == pytest.approx(-0.36 * math.tan(35 * DEG) * math.log(0.05))


def test_a_slide_that_this_soil_lets_go_farther_is_learned_from_registrations():
    drive = Drive(pitch=15 * DEG, config=Config(slope_slip_ratio=0.3, odometry_noise_ratio=0.001)).run(STILL, 1)
    law = 0.3 * -math.tan(35 * DEG) * math.log(1 - math.tan(15 * DEG) / math.tan(35 * DEG))
    drive.slip = -1.1 * law  # nose down: a tenth farther than the law says
    for _ in range(8):
        drive.run(Twist(0.1, 0, 0), 30).run(STILL, 1)
        assert drive.filter.register(drive.registration(covariance=np.diag([1e-3] * 4) ** 2))
    before = drive.filter.pose.x_m - drive.x
    drive.run(Twist(0.1, 0, 0), 30)
    assert abs(drive.filter.pose.x_m - drive.x - before) < 0.3 * 0.1 * law * 3.0


HALF_SEEN = {"inlier_ratio": 0.4}


@pytest.mark.parametrize("wrong", [{"dx": 0.9}, {"dyaw": 9 * DEG}, {"dy": 0.3, **HALF_SEEN}, {"accepted": False}])
def test_refused_registration_widens_the_covariance_and_never_moves_the_pose(wrong):
    drive = Drive().run(STILL, 1).run(Twist(0.1, 0, 0), 10).run(STILL, 1)
    pose, before = drive.filter.pose, drive.filter.estimate.covariance
    assert not drive.filter.register(drive.registration(**wrong))
    assert drive.filter.pose == pose
    assert np.diag(drive.filter.estimate.covariance) == pytest.approx(2 * np.diag(before))


def test_a_look_that_could_not_be_compared_leaves_pose_and_covariance():
    drive = Drive().run(STILL, 1).run(Twist(0.1, 0, 0), 10).run(STILL, 1)
    pose, before = drive.filter.pose, drive.filter.estimate.covariance
    assert not drive.filter.register(drive.registration(accepted=False, told=False))
    assert drive.filter.pose == pose
    assert (drive.filter.estimate.covariance == before).all()


def test_filter_that_is_too_sure_yields_to_what_is_said_again_and_again():
    drive = Drive().run(STILL, 1).run(Twist(0.1, 0, 0), 20).run(STILL, 1)
    taken = [drive.filter.register(drive.registration(dy=0.3, **HALF_SEEN)) for _ in range(8)]
    assert not taken[0]
    assert any(taken)


@pytest.mark.parametrize("slid", [{"dy": 0.4}, {"dx": -0.3, "dyaw": 0.1}])
def test_a_slide_that_no_wheel_felt_is_believed_where_the_ground_fixes_all_and_spoils_nothing_learned(slid):
    drive = Drive().run(STILL, 1).run(Twist(0.1, 0, 0), 20).run(STILL, 1)
    slip = drive.filter.slip_ratio
    drive.x, drive.y, drive.yaw = (
        v + slid.get(n, 0.0) for v, n in ((drive.x, "dx"), (drive.y, "dy"), (drive.yaw, "dyaw"))
    )
    assert drive.filter.register(drive.registration())
    distance, yaw = drive.error()
    assert distance < 0.02 and abs(yaw) < 0.01
    assert drive.filter.slip_ratio == pytest.approx(slip, abs=0.01)


@pytest.mark.parametrize("weak", [HALF_SEEN, {"degenerate": ("x",)}])
def test_what_half_the_scan_or_half_the_directions_say_is_not_believed_against_the_way(weak):
    drive = Drive().run(STILL, 1).run(Twist(0.1, 0, 0), 20).run(STILL, 1)
    assert not drive.filter.register(drive.registration(dy=0.4, **weak))


def test_direction_that_the_ground_does_not_fix_keeps_the_pose():
    drive = Drive().run(STILL, 1).run(Twist(0.1, 0, 0), 20).run(STILL, 1)
    covariance = np.diag([100.0, 1e-4, 1e-4, 4e-6])
    assert drive.filter.register(drive.registration(dx=0.1, dy=0.03, covariance=covariance))
    pose = drive.filter.pose
    assert pose.x_m == pytest.approx(2.0, abs=0.005)
    assert pose.y_m == pytest.approx(0.03, abs=0.015)


def test_yaw_innovation_wraps_at_half_a_turn():
    drive = Drive().run(STILL, 1).run(Twist(0, 0, 0.25), (math.pi - 0.01) / 0.25).run(STILL, 1)
    assert drive.filter.register(drive.registration(dyaw=0.013))
    assert -math.pi < drive.filter.pose.yaw_rad <= math.pi
    assert abs(drive.error()[1]) < 0.014


def test_registrations_to_ones_own_map_add_half_of_their_errors_to_it_the_last_one_whole_and_their_reach_at_each():
    drive = Drive().run(STILL, 1)
    drive.filter.anchor(None)
    own = np.array([3e-3, 3e-3, 1e-3, 3e-4])
    for stop in range(1, 6):
        drive.run(Twist(0.1, 0, 0), 20).run(STILL, 1)
        found = drive.registration(covariance=np.diag(own) ** 2)
        assert drive.filter.register(found)
        drive.filter.anchor(found)
        sigma = np.sqrt(np.diag(drive.filter.estimate.covariance))
        added = math.sqrt(1.0 + 0.25 * (stop - 1))
        assert sigma[0] == pytest.approx(math.hypot(own[0] * added, 2.0 * stop * REACH_SIGMA), rel=0.1)
        assert sigma[3] == pytest.approx(own[3] * added, rel=0.3)


def test_heading_error_of_the_stop_before_moves_the_map_at_a_distance_from_it():
    drive = Drive().run(STILL, 1).run(Twist(0.1, 0, 0), 20).run(STILL, 1)
    found = drive.registration(covariance=np.diag([1e-3, 1e-3, 1e-3, 0.05]) ** 2)
    drive.filter.register(found)
    drive.filter.anchor(found)
    yaw = math.sqrt(drive.filter.estimate.covariance[3, 3])
    drive.run(Twist(0.1, 0, 0), 40).run(STILL, 1)
    assert drive.filter.register(drive.registration(covariance=np.diag([1e-3, 1e-3, 1e-3, 1e-3]) ** 2))
    across = math.sqrt(drive.filter.estimate.covariance[1, 1])
    # half of the points there are of the exact start; the odometry helps a little; to a true map it were 1 mm
    assert 0.35 * 4.0 * yaw < across < 0.5 * 4.0 * yaw


def test_a_look_that_cannot_be_registered_at_the_same_place_leaves_the_anchor_and_one_elsewhere_moves_it():
    drive = Drive().run(STILL, 1)
    drive.filter.anchor(None)
    drive.run(Twist(0, 0, 0.25), math.pi / 0.25).run(STILL, 1)
    drive.filter.anchor(None)  # the look behind
    assert drive.filter.register(drive.registration(covariance=np.diag([1e-4] * 4) ** 2))
    assert math.sqrt(drive.filter.estimate.covariance[0, 0]) < 2e-3  # of the start
    drive.run(Twist(0.1, 0, 0), 40).run(STILL, 1)
    far = math.sqrt(drive.filter.estimate.covariance[0, 0])
    drive.filter.anchor(None)
    assert drive.filter.register(drive.registration(covariance=np.diag([1e-4] * 4) ** 2))
    assert math.sqrt(drive.filter.estimate.covariance[0, 0]) > 0.8 * far


def test_points_of_a_registered_stop_enter_at_the_corrected_place_with_the_tilt_that_fits_the_map():
    drive = Drive().run(STILL, 1).run(Twist(0.1, 0, 0), 20).run(STILL, 1)
    tilted = Pose(2.03, 0.01, 0.0, 0.01, -0.02, 0.005).matrix()
    found = drive.registration(T_map_base=tilted)
    assert drive.filter.register(found)
    entered, pose = drive.filter.anchor(found), drive.filter.pose
    assert (entered.x_m, entered.y_m, entered.z_m, entered.yaw_rad) == (pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad)
    assert (entered.roll_rad, entered.pitch_rad) == pytest.approx((0.01, -0.02), abs=1e-9)


def test_a_gyro_that_reads_a_hundredth_too_much_is_learned_from_registrations_after_turns():
    drive = Drive().run(STILL, 1)
    plain = drive.sample

    def scaled(twist):
        seen = plain(twist)
        return seen._replace(gyro_radps=tuple(1.002 * rate for rate in seen.gyro_radps))

    drive.sample = scaled
    exact = np.diag([1e-3, 1e-3, 1e-3, 1e-4]) ** 2
    for _ in range(4):
        drive.run(Twist(0, 0, 0.25), 3.0 / 0.25).run(STILL, 1)
        assert drive.filter.register(drive.registration(covariance=exact))
    before = drive.error()[1]
    drive.run(Twist(0, 0, 0.25), 3.0 / 0.25).run(STILL, 1)
    assert abs(drive.error()[1] - before) < 0.3 * 0.002 * 3.0


def test_reset_puts_the_rover_there_and_keeps_what_was_learned():
    drive = Drive(slip=0.15).run(STILL, 1).run(Twist(0.11, 0, 0), 30).run(STILL, 1)
    drive.filter.register(drive.registration())
    slip = drive.filter.slip_ratio
    drive.filter.reset(Pose(5.0, -3.0, 0.4, yaw_rad=2.0))
    pose = drive.filter.pose
    assert (pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad) == (5.0, -3.0, 0.4, 2.0)
    assert drive.filter.slip_ratio == slip
    assert np.linalg.eigvalsh(drive.filter.estimate.covariance).min() > 0


def test_same_inputs_give_the_same_digest():
    one, two = (Drive(seed=4, noise=0.002).run(STILL, 1).run(Twist(0.1, 0.02, 0.1), 5) for _ in range(2))
    assert one.filter.digest_items() == two.filter.digest_items()
    assert len(one.filter.digest_items()) == 28


def test_noisy_drive_of_8_m_stays_within_its_own_covariance():
    drive = Drive(seed=7, bias=0.002, noise=0.002).run(STILL, 3)
    for turn in (0.05, -0.05, 0.03, -0.03):
        drive.run(Twist(0.1, 0, turn), 20)
    distance, yaw = drive.error()
    covariance = drive.filter.estimate.covariance
    assert distance < 3 * math.sqrt(covariance[0, 0] + covariance[1, 1])
    assert abs(yaw) < 3 * math.sqrt(covariance[3, 3])
    assert distance < 0.05


def test_rover_that_follows_its_own_estimate_ends_an_l_of_4_m_within_5_cm_of_the_truth():
    # The whole chain of motion, with a tick of delay, encoder steps, lost frames and a noisy, biased gyro.
    rover, motion = Rover(), Motion()
    drive, rng = Drive(seed=9, bias=0.003, noise=0.002).run(STILL, 2), np.random.default_rng(2)
    way = [(0.1 * k, 0.0, 0.0) for k in range(21)] + [(2.0, 0.1 * k, math.pi / 2) for k in range(21)]
    path, follower = Path(np.array(way)), Follower(rover, motion)
    orders, held, twist = stopped([WheelCommand(WheelMode.HOLD, 0.0, 0.0)] * 4), False, STILL
    steer, rate, position = [0.0] * 4, [0.0] * 4, [0.0] * 4
    wheels = [WheelState(0.0, 0.0, 0.0, 2, 0)] * 4
    for tick in range(8000):
        acting = orders
        if tick % 5 == 0:
            twist = follower.twist(path, drive.filter.pose, drive.now_ns)
        if tick % 2 == 0:
            orders, held = wheel_commands(twist, wheels, orders, rover, motion, held)
        for k, order in enumerate(acting):
            steer[k] += max(-0.005, min(0.005, order.steer_rad - steer[k]))
            rate[k] += max(-0.01, min(0.01, order.rate_radps - rate[k]))
            position[k] += 0.01 * rate[k]
            if rng.random() > 0.02:
                wheels[k] = WheelState(steer[k], round(position[k] / 1e-3) * 1e-3, rate[k], 2, 0)
        hubs = [(r * 0.1 * math.cos(s), r * 0.1 * math.sin(s)) for s, r in zip(steer, rate)]
        true, _ = body_twist(hubs, PLACES)
        middle = drive.yaw + 0.005 * true.yaw_radps
        drive.x += 0.01 * (true.vx_mps * math.cos(middle) - true.vy_mps * math.sin(middle))
        drive.y += 0.01 * (true.vx_mps * math.sin(middle) + true.vy_mps * math.cos(middle))
        drive.yaw += 0.01 * true.yaw_radps
        drive.now_ns += 10_000_000
        drive.filter.update(wheels, drive.sample(true), drive.now_ns)
        if follower.done and not any(rate):
            break
    assert follower.done
    assert math.hypot(drive.x - 2.0, drive.y - 2.0) < 0.05
    assert abs(drive.yaw - math.pi / 2) < 2.5 * DEG
    assert drive.error()[0] < 0.03
