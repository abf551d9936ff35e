"""Level and the accelerometer's bias, on a rover that stands, turns and drives with biased and noisy sensors."""

import math

import numpy as np
import pytest

from onboard.perception.pose.attitude import Attitude
from onboard.records import ImuSample

G = 1.62
DEG = math.pi / 180


class Rover:
    """Truth beside the estimate: roll, pitch, and a turn about the ground's normal; 100 samples a second."""

    def __init__(self, seed=1, bias=(0.0, 0.0), noise=(0.0, 0.0), level=(0.0, 0.0)):
        self.estimate, self.rng = Attitude(), np.random.default_rng(seed)
        self.bias, self.noise, self.gyro = bias, noise, (0.0, 0.0)
        self.slope, self.yaw, self.now_ns = level, 0.0, 0

    @property
    def level(self):
        """Roll and pitch on a plane that rises along x and y, seen at the heading of now."""
        down = np.array([math.tan(self.slope[1]), -math.tan(self.slope[0])])
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        ahead, left = c * down[0] + s * down[1], -s * down[0] + c * down[1]
        pitch = math.atan(ahead)
        return math.atan(-left * math.cos(pitch)), pitch

    def run(self, seconds, turn_radps=0.0, shake=0.0):
        for _ in range(round(100 * seconds)):
            before = self.level
            self.yaw += 0.01 * turn_radps
            roll, pitch = self.level
            d_roll, d_pitch = 100 * (roll - before[0]), 100 * (pitch - before[1])
            sp, cp, sr, cr = math.sin(pitch), math.cos(pitch), math.sin(roll), math.cos(roll)
            rate = (d_roll - sp * turn_radps, cr * d_pitch + cp * sr * turn_radps, cp * cr * turn_radps - sr * d_pitch)
            wander = self.rng.standard_normal(6)
            gyro = tuple(r + b + self.noise[0] * n for r, b, n in zip(rate, (*self.gyro, 0.0), wander))
            force = np.array([-G * sp, G * cp * sr, G * cp * cr]) + np.array([*self.bias, 0.0])
            force += (self.noise[1] + shake) * wander[3:]
            self.now_ns += 10_000_000
            self.estimate.update(ImuSample(self.now_ns, gyro, tuple(force)), 0.01, turn_radps == 0.0 and shake == 0.0)
        return self

    def error(self):
        roll, pitch = self.level
        return math.hypot(self.estimate.roll_rad - roll, self.estimate.pitch_rad - pitch)


@pytest.mark.parametrize("level", [(0.0, 0.0), (8 * DEG, -5 * DEG), (0.0, 20 * DEG)])
def test_half_a_turn_tells_the_accelerometers_bias_and_the_level(level):
    rover = Rover(bias=(0.012, -0.008), noise=(0.001, 0.01), level=level).run(15)
    assert rover.error() > 0.006  # standing still nothing can part them
    rover.run(math.pi / 0.2, 0.2).run(12)
    assert rover.estimate.force_bias_mps2 == pytest.approx((0.012, -0.008), abs=0.003)
    assert rover.error() < 0.0025


def test_a_stop_before_the_turn_is_levelled_afterwards():
    rover = Rover(bias=(0.012, -0.008), noise=(0.001, 0.01), level=(6 * DEG, 4 * DEG)).run(15)
    told, then, true = (rover.estimate.roll_rad, rover.estimate.pitch_rad), rover.estimate.force_bias_mps2, rover.level
    rover.run(math.pi / 0.2, 0.2).run(12)
    known = rover.estimate.known_now(*told, then)
    assert math.dist(told, true) > 0.006
    assert math.dist(known, true) < 0.002


def test_shaking_over_stones_does_not_tilt_the_rover():
    rover = Rover(noise=(0.001, 0.01)).run(5).run(60, shake=0.3)
    assert rover.error() < 0.006


def test_a_gyro_bias_that_comes_later_is_learned_at_a_stop():
    rover = Rover(noise=(0.001, 0.01)).run(5)
    rover.gyro = (0.0005, -0.0005)
    rover.run(60)
    before = rover.error()
    rover.run(20, shake=0.05)
    assert abs(rover.error() - before) < 0.004  # 14 mrad were it not learned


def test_a_tilt_that_the_gyro_missed_is_believed_at_the_next_stop():
    rover = Rover(noise=(0.001, 0.01)).run(5)
    rover.slope = (6 * DEG, 0.0)
    rover.run(2)
    assert rover.error() < 0.2 * DEG
