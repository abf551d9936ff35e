"""The scanner's clock on the model of the design: 80 ppm, late links, milliseconds for stamps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from onboard.devices.lidar.clock import LidarClock
from protocol.scip import STAMP_MODULUS

LATENCY_NS = 3_200_000


@dataclass
class Sensor:
    """Turns of the model: stamps cut to ms, 3.2 ms and a half-normal of 0.4 ms late, 2 % of them by spikes."""

    turn_ns: float
    seed: int
    ppm: float = 80.0
    start_ms: float = 5000.3
    jitter: str = "half-normal"
    at_ns: float = 1_000_137_000.0
    turn: int = 0

    def __post_init__(self):
        self.rng, self.last_ns = np.random.default_rng(self.seed), 0

    def counter_ms(self, true_ns):
        return int(true_ns * (1 + self.ppm * 1e-6) * 1e-6 + self.start_ms) % STAMP_MODULUS

    def late_ns(self):
        rng = self.rng
        late = {
            "half-normal": lambda: abs(rng.standard_normal()) * 0.4e6,
            "exponential": lambda: rng.exponential(2e6),
            "uniform": lambda: rng.random() * 10e6,
        }[self.jitter]()
        return LATENCY_NS + late + (self.rng.random() < 0.02) * self.rng.exponential(20e6)

    def next(self):
        """(stamp, arrival, true time) of the next turn."""
        true_ns = self.at_ns + self.turn * self.turn_ns / (1 + self.ppm * 1e-6)
        self.turn += 1
        self.last_ns = max(self.last_ns, int(true_ns + self.late_ns()))
        return self.counter_ms(true_ns), self.last_ns, true_ns

    def feed(self, clock, turns):
        """Errors in ms of that many turns."""
        errors = []
        for _ in range(turns):
            stamp_ms, rx_ns, true_ns = self.next()
            errors.append((clock.observe(stamp_ms, rx_ns) - true_ns) * 1e-6)
        return np.array(errors)


def rms(errors):
    return float(np.sqrt((errors**2).mean()))


@pytest.mark.parametrize("turn_ns", [25.05e6, 25.0e6, 24.98e6])
def test_clock_error_is_0_05_ms_rms_and_under_0_25_ms_at_99_percent_over_4_times_120_s(turn_ns):
    runs = [Sensor(turn_ns, seed).feed(LidarClock(LATENCY_NS), int(120e9 / turn_ns)) for seed in (1, 2, 3, 4)]
    settled, whole = np.concatenate([run[400:] for run in runs]), np.concatenate(runs)
    assert rms(settled) <= 0.01 and np.abs(settled).max() <= 0.05
    assert rms(whole) <= 0.05 and np.percentile(np.abs(whole), 99) <= 0.25  # from the first frame on


def test_after_a_pause_the_period_is_known_and_the_first_frames_are_as_good():
    sensor, clock = Sensor(25.05e6, 5), LidarClock(LATENCY_NS)
    sensor.feed(clock, 800)
    sensor.turn += 2400  # a minute
    errors_ms = sensor.feed(clock, 400)
    assert clock.quality.samples == 400 and clock.jumps == clock.reboots == 0
    assert np.abs(errors_ms[5:]).max() < 0.15


@pytest.mark.parametrize("jitter", ["half-normal", "exponential", "uniform"])
def test_sigma_is_the_rms_error_within_a_factor_of_1_3_whatever_the_link_adds(jitter):
    errors_ms, sigmas_ms = [], []
    for seed in range(4):
        sensor, clock = Sensor(25.05e6, seed, jitter=jitter), LidarClock(LATENCY_NS)
        sensor.feed(clock, 400)
        for _ in range(2000):
            errors_ms.append(sensor.feed(clock, 1)[0])
            sigmas_ms.append(clock.quality.sigma_ns * 1e-6)
    assert 1 / 1.3 < rms(np.array(sigmas_ms)) / rms(np.array(errors_ms)) < 1.3


def test_uneven_motor_shows_in_sigma():
    sensor, clock = Sensor(25.05e6, 3), LidarClock(LATENCY_NS)
    for k in range(400):
        stamp_ms, rx_ns, _ = sensor.next()
        clock.observe(stamp_ms + (k // 20 % 2) * 2, rx_ns)
    assert 0.7e6 < clock.quality.sigma_ns < 1.5e6


def test_quality_tells_offset_drift_and_samples():
    sensor, clock = Sensor(25.05e6, 1), LidarClock(LATENCY_NS)
    assert clock.quality.samples == 0 and clock.quality.sigma_ns == math.inf
    sensor.feed(clock, 1000)
    quality, true_ns = clock.quality, sensor.at_ns + 999 * sensor.turn_ns / (1 + 80e-6)
    counter_ms = true_ns * (1 + 80e-6) * 1e-6 + sensor.start_ms
    assert quality.offset_ns * 1e-6 == pytest.approx(true_ns * 1e-6 - counter_ms, abs=1.0)  # stamps are whole ms
    assert quality.ppm == pytest.approx(-80.0, abs=5.0)
    assert quality.samples == 400
    assert clock.turn_ns == pytest.approx(sensor.turn_ns / (1 + 80e-6), abs=100)


def test_counter_that_wraps_is_no_jump():
    sensor, clock = Sensor(25.05e6, 1, start_ms=STAMP_MODULUS - 20_000.0), LidarClock(LATENCY_NS)
    errors_ms = sensor.feed(clock, 2000)
    assert clock.jumps == clock.reboots == 0 and np.abs(errors_ms[400:]).max() < 0.05


@pytest.mark.parametrize(("new_start_ms", "jumps", "reboots"), [(9e5, 1, 0), (4000.0, 1, 0), (-11_000.0, 0, 1)])
def test_counter_near_zero_is_a_reboot_and_any_other_step_a_jump(new_start_ms, jumps, reboots):
    sensor, clock = Sensor(25.05e6, 1), LidarClock(LATENCY_NS)
    sensor.feed(clock, 400)  # 10 s: the counter stands at 16 s
    sensor.start_ms = new_start_ms
    errors_ms = sensor.feed(clock, 400)
    assert (clock.jumps, clock.reboots) == (jumps, reboots)
    assert rms(errors_ms[100:]) < 0.1


@pytest.mark.parametrize("reconnected", [False, True])
def test_reboot_while_nothing_was_heard_is_seen_at_the_first_frame(reconnected):
    sensor, clock = Sensor(25.05e6, 1), LidarClock(LATENCY_NS)
    sensor.feed(clock, 400)
    if reconnected:
        clock.restart(25.0)
    sensor.turn += 400  # 10 s
    sensor.start_ms = -sensor.turn * 25.05 + 3000.0 - 1000.0
    sensor.feed(clock, 10)
    assert (clock.jumps, clock.reboots) == (0, 1)


def test_repeated_stamp_is_no_new_turn():
    sensor, clock = Sensor(25.05e6, 1), LidarClock(LATENCY_NS)
    sensor.feed(clock, 100)
    stamp_ms, rx_ns, _ = sensor.next()
    assert clock.observe(stamp_ms, rx_ns) is not None
    assert clock.observe(stamp_ms, rx_ns + 1_000_000) is None and clock.repeated == 1
    assert rms(sensor.feed(clock, 100)) < 0.1


def exchanged(sensor, clock, times=10, before_ns=500e6):
    """TM1 exchanges: 0.3 to 0.7 ms to the sensor and as much back."""
    for k in range(times):
        sent_ns = int(sensor.at_ns - before_ns + k * 1.13e6)
        there, back = 0.3e6 + 0.4e6 * sensor.rng.random(2)
        clock.seed(sensor.counter_ms(sent_ns + there), sent_ns, int(sent_ns + there + back))


@pytest.mark.parametrize(("turn_ns", "goal_ms"), [(25.05e6, 0.5), (25.0e6, 0.8)])
@pytest.mark.parametrize("start_ms", [5000.3, STAMP_MODULUS - 200.0])  # the counter may wrap between seed and stream
@pytest.mark.parametrize("wrong_ns", [-15e6, 15e6])
def test_seed_corrects_a_constant_delay_that_is_stated_wrong(turn_ns, goal_ms, start_ms, wrong_ns):
    sensor, clock = Sensor(turn_ns, 1, start_ms=start_ms - 1000), LidarClock(round(LATENCY_NS + wrong_ns))
    exchanged(sensor, clock)
    assert np.abs(sensor.feed(clock, 80)[8:]).max() < 1.2  # stamps have whole milliseconds, and so have seeds
    assert np.abs(sensor.feed(clock, 1000)).max() < goal_ms
    assert clock.latency_ns == pytest.approx(LATENCY_NS, abs=goal_ms * 1e6)


def test_seed_leaves_a_right_constant_alone():
    sensor, clock = Sensor(25.05e6, 1), LidarClock(LATENCY_NS)
    exchanged(sensor, clock)
    sensor.feed(clock, 1000)
    assert clock.latency_ns == LATENCY_NS


def test_seed_of_another_count_is_not_used():
    sensor, clock = Sensor(25.05e6, 1), LidarClock(LATENCY_NS)
    exchanged(sensor, clock)
    sensor.feed(clock, 20)
    sensor.start_ms += 7e5
    assert rms(sensor.feed(clock, 400)[20:]) < 0.2 and clock.jumps == 1
