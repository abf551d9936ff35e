"""Scanner, tilt axis, inertial sensor and clocks that answer and are wrong: each is found, and answered by its row."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.config import Rover, Scanning
from onboard.core.faults.devices.bias import LIMIT_RADPS, BiasWatch
from onboard.core.faults.devices.clocks import HOLD_NS, UTC_JUMP_NS, Jumps, UtcWatch
from onboard.core.faults.devices.returns import SCANS, WINDOW_TICKS, FrameWatch, ReturnWatch
from onboard.core.faults.devices.stall import StallWatch
from onboard.devices.tilt import Tilt
from onboard.perception.scan.sweep import segments
from onboard.records import BeamStatus, Scan
from protocol.generated.can_codec import TiltFeedbackFrame, TiltState
from protocol.link.transactions import RequestState
from protocol.tables.faults import BY_NAME
from protocol.tables.modes import Mode, Phase
from tests.onboard.core_bench import CoreBench, quick

TICK_NS, S_NS = 10_000_000, 1_000_000_000
SECTOR_RAD = math.radians(65)
DOWN_RAD = math.radians(20)
pytestmark = pytest.mark.copied


# -- frames and returns ----------------------------------------------------------------------------------------------


@given(st.lists(st.tuples(st.integers(0, 1), st.integers(0, 1)), max_size=3 * WINDOW_TICKS))
def test_frames_are_garbled_when_over_a_fifth_of_the_last_two_seconds_and_four_at_least_were_bad(came):
    watch, good, bad = FrameWatch(), 0, 0
    watch.update(0, 0)
    for tick, (well, ill) in enumerate(came, 1):
        good, bad = good + well, bad + ill
        watch.update(good, bad)
        last = came[max(0, tick - WINDOW_TICKS) : tick]
        wrong, whole = sum(row[1] for row in last), sum(map(sum, last))
        assert watch.garbled == (wrong >= 4 and wrong > 0.2 * whole)


def scan(status):
    status = np.array(status, np.uint8)
    return Scan(0, 17361.0, math.radians(-135), math.radians(0.25), np.ones(len(status), np.float32), status)


def skyline():
    """Ground below, five hills before nothing, and nothing at all at the sides, which are not looked at."""
    status = np.full(1081, BeamStatus.OK)
    status[:270] = status[820:] = BeamStatus.NO_RETURN
    status[300:800:50] = BeamStatus.NO_RETURN
    return scan(status)


def torn(rng, ratio):
    return scan(np.where(rng.random(1081) < ratio, BeamStatus.NO_RETURN, BeamStatus.OK))


def test_a_skyline_is_clean_and_a_window_with_dust_is_dirty_after_40_scans_and_clean_40_after_it_was_wiped():
    rng, watch, dirty = np.random.default_rng(7), ReturnWatch(Rover(), SECTOR_RAD), []
    for kind in (skyline, lambda: torn(rng, 0.5), skyline):
        for _ in range(2 * SCANS):
            watch.update([kind()], DOWN_RAD)
            dirty.append(watch.dirty)
    assert not any(dirty[: 2 * SCANS]) and all(dirty[3 * SCANS : 4 * SCANS]) and not any(dirty[5 * SCANS :])


@pytest.mark.parametrize("word", [BeamStatus.TOO_NEAR, BeamStatus.ERROR, BeamStatus.INTERFERENCE])
@pytest.mark.parametrize(("ratio", "dirty"), [(0.05, False), (0.2, True)])
def test_beams_that_say_too_near_error_or_interference_are_counted(word, ratio, dirty):
    rng, watch = np.random.default_rng(8), ReturnWatch(Rover(), SECTOR_RAD)
    for _ in range(SCANS):
        watch.update([scan(np.where(rng.random(1081) < ratio, word, BeamStatus.OK))], None)
    assert watch.dirty is dirty


@pytest.mark.parametrize(("ratio", "dirty"), [(0.01, False), (0.08, False), (0.2, False), (0.35, True)])
def test_torn_lines_are_dirt_from_the_share_on_that_ends_a_mission(ratio, dirty):
    rng, watch = np.random.default_rng(11), ReturnWatch(Rover(), SECTOR_RAD)
    for _ in range(SCANS):
        watch.update([torn(rng, ratio)], DOWN_RAD)
    assert watch.dirty is dirty
    assert watch.torn_ratio == pytest.approx(2 * ratio * (1 - ratio), abs=0.02)


def test_lines_to_the_sky_or_of_an_unknown_tilt_tear_nothing():
    rng = np.random.default_rng(12)
    for tilt_rad in (math.radians(-10), math.radians(1), None):
        watch = ReturnWatch(Rover(), SECTOR_RAD)
        for _ in range(SCANS):
            watch.update([torn(rng, 0.5)], tilt_rad)
        assert not watch.dirty and watch.torn_ratio == 0.0


def test_dust_over_a_field_that_ends_is_dirt_and_the_field_s_end_is_not():
    """Ground straight ahead only, as at the edge of a field; dust tears what there is of it."""
    rng = np.random.default_rng(13)
    for dusty in (False, True):
        watch = ReturnWatch(Rover(), SECTOR_RAD)
        for _ in range(SCANS):
            gone = np.abs(np.arange(1081) - 540) > 100
            gone |= dusty & (rng.random(1081) < 0.5)
            watch.update([scan(np.where(gone, BeamStatus.NO_RETURN, BeamStatus.OK))], DOWN_RAD)
        assert watch.dirty is dusty


def test_what_the_scanner_sees_beside_the_sector_is_not_its_dirt():
    rng, watch = np.random.default_rng(9), ReturnWatch(Rover(), SECTOR_RAD)
    for _ in range(SCANS):
        watch.update(
            [scan(np.where(np.abs(np.arange(1081) - 540) > 262, rng.integers(0, 4, 1081), BeamStatus.OK))], DOWN_RAD
        )
    assert not watch.dirty and watch.torn_ratio == 0.0


# -- clocks ----------------------------------------------------------------------------------------------------------


def test_a_count_that_has_grown_holds_for_a_second():
    jumps = Jumps()
    counts = [0] * 50 + [1] * 120 + [3] * 120
    held = [jumps.update(count, tick * TICK_NS) for tick, count in enumerate(counts)]
    second = HOLD_NS // TICK_NS
    assert held == [False] * 50 + [True] * second + [False] * 20 + [True] * second + [False] * 20


@pytest.mark.parametrize(("step_ns", "jumps"), [(0, 0), (UTC_JUMP_NS // 2, 0), (2 * UTC_JUMP_NS, 1), (-3600 * S_NS, 1)])
def test_utc_jumps_where_it_leaves_the_onboard_time_by_over_half_a_second(step_ns, jumps):
    watch, utc_ns = UtcWatch(), 1_800_000_000 * S_NS
    for tick in range(1000):
        now_ns = tick * TICK_NS
        read_ns = utc_ns + now_ns // S_NS * S_NS  # read again once a second
        watch.update(read_ns + (step_ns if tick >= 500 else 0) if tick >= 100 else 0, now_ns)
    assert watch.jumps == jumps
    assert watch.last_ns == (step_ns if jumps else 0)


# -- the axis --------------------------------------------------------------------------------------------------------


class Axis:
    """A tilt axis that goes where it was told 20 ms ago, at 20 degrees a second at most, until it sticks."""

    def __init__(self):
        self.tilt, self.watch, self.now_ns, self.angle_rad, self.stuck = Tilt(), StallWatch(), 0, 0.0, False

    def step(self):
        self.now_ns += TICK_NS
        self.tilt.send(self.now_ns)
        wanted = self.tilt.ordered_rad(self.now_ns - 2 * TICK_NS)
        if wanted is not None and not self.stuck:
            most = math.radians(30.0) * 0.01
            self.angle_rad += max(-most, min(most, wanted - self.angle_rad))
        told = round(self.angle_rad / (math.tau / 4096)) * math.tau / 4096
        self.tilt.feedback(TiltFeedbackFrame(self.now_ns // 1000, told, 0.0, TiltState.SWEEPING), self.now_ns)
        self.watch.update(self.tilt, self.now_ns)
        return self.watch.stalled


@pytest.fixture
def sweeping():
    axis, nod = Axis(), segments(Scanning(), 0.7)
    axis.tilt.park(nod[0].start_rad, 0)
    assert not any(axis.step() for _ in range(400))
    axis.tilt.sweep(nod, axis.now_ns + 400_000_000)
    axis.ticks = round(sum(part.duration_ns for part in nod) / TICK_NS) + 60
    return axis


def test_an_axis_that_follows_its_orders_is_never_stalled(sweeping):
    assert not any(sweeping.step() for _ in range(sweeping.ticks))
    assert sweeping.angle_rad == pytest.approx(Scanning().end_rad, abs=0.01)


@pytest.mark.parametrize("after_ticks", [60, 200, 400, 700, 1000])
def test_an_axis_that_sticks_is_found_within_its_row_s_time_wherever_it_is(sweeping, after_ticks):
    for _ in range(after_ticks):
        sweeping.step()
    sweeping.stuck = True
    took = next(tick for tick in range(1, 100) if sweeping.step())
    assert took / 100 <= BY_NAME["TILT_STALL"].detect_s
    sweeping.stuck = False
    sweeping.tilt.park(sweeping.angle_rad + 0.3, sweeping.now_ns)
    assert not any(sweeping.step() for _ in range(200))


def test_an_axis_that_says_nothing_is_silent_not_stalled(sweeping):
    for _ in range(300):
        sweeping.step()
    for _ in range(100):
        sweeping.now_ns += TICK_NS
        sweeping.watch.update(sweeping.tilt, sweeping.now_ns)
        assert not sweeping.watch.stalled


# -- the gyro --------------------------------------------------------------------------------------------------------


def rests(watch, biases_radps, noise_radps=0.001, seed=3):
    """A rest of 3 s with each of these biases of yaw, 1 s of motion between; jumps counted after each."""
    rng, counts, tick = np.random.default_rng(seed), [], 0
    for bias in biases_radps:
        for standing in [False] * 100 + [True] * 300:
            tick += 1
            rates = rng.normal((0.0, 0.0, bias if standing else 0.2), noise_radps)
            watch.update(rates.tolist(), standing, tick * TICK_NS)
        counts.append(watch.jumps)
    return counts


def test_a_rest_with_another_bias_than_the_last_is_told_once_and_drift_is_not():
    watch = BiasWatch()
    assert rests(watch, [0.01, 0.01, 0.01 + 2 * LIMIT_RADPS, 0.01 + 2 * LIMIT_RADPS, 0.01]) == [0, 0, 1, 1, 2]
    assert watch.step_radps == pytest.approx(-2 * LIMIT_RADPS, abs=0.0005)
    assert rests(BiasWatch(), [0.3 * LIMIT_RADPS * k for k in range(8)]) == [0] * 8


def test_it_is_told_two_and_a_half_seconds_after_the_wheels_stand():
    watch, tick = BiasWatch(), 0
    rests(watch, [0.0])
    for standing in [False] * 10 + [True] * 300:
        tick += standing
        watch.update((0.0, 0.0, 0.01), standing, 10 * S_NS + tick * TICK_NS)
        if watch.jumps:
            break
    assert 2.4 <= tick / 100 <= 2.6


def test_a_rest_after_a_way_that_slipped_has_no_word_and_the_next_one_has():
    watch, tick, counts = BiasWatch(), 0, []
    for slips, standing, rate in (
        (False, True, 0.0),
        (True, False, 0.2),
        (False, False, 0.2),
        (False, True, 0.01),
        (False, False, 0.2),
        (False, True, 0.01),
    ):
        for _ in range(300):
            tick += 1
            watch.update((0.0, 0.0, rate), standing, tick * TICK_NS, slips)
        counts.append(watch.jumps)
    assert counts == [0, 0, 0, 0, 0, 1]


def test_a_rover_that_creeps_on_while_its_wheels_stand_is_no_bias():
    """As on the bench's powder: 0.22 degrees a second, half of it 1.5 s later."""
    watch = BiasWatch()
    rests(watch, [0.0])
    rng = np.random.default_rng(4)
    for tick in range(800):
        creeps = math.radians(0.22) * 0.5 ** (tick / 150)
        watch.update(rng.normal((0.0, 0.0, creeps), 0.001).tolist(), True, (2000 + tick) * TICK_NS)
    assert watch.jumps == 0


# -- the rows, by the whole core -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def scanning():
    rover = CoreBench(settings=quick())
    rover.settle()
    rover.request = rover.goto(3.0, 0.5)
    rover.until(lambda: rover.lidar.scans > 60, 20.0)
    rover.until(lambda: rover.nodes.tilt.state is TiltState.SWEEPING, 10.0)
    rover.run(0.5)
    return rover


BREAKS = {
    "TILT_STALL": (lambda r: setattr(r.nodes.tilt, "stalled", True), lambda r: setattr(r.nodes.tilt, "stalled", False)),
    "LIDAR_GARBLED": (lambda r: r.lidar.faults.begin(r.lidar, "flip"), lambda r: r.lidar.faults.end(r.lidar, "flip")),
    "LIDAR_DIRTY": (lambda r: r.lidar.faults.begin(r.lidar, "dust"), lambda r: r.lidar.faults.end(r.lidar, "dust")),
    "LIDAR_CLOCK": (lambda r: r.lidar.jump_clock(5000.0), lambda r: None),
    "CLOCK_JUMP": (lambda r: setattr(r.nodes.tilt, "clock_jump_us", 500_000), lambda r: None),
}  # fmt: skip


@pytest.mark.parametrize("row", BREAKS)
def test_a_device_that_goes_wrong_in_mid_sweep_is_named_in_time_and_the_sweep_is_scanned_again(scanning, row):
    begin, heal = BREAKS[row]
    begin(scanning)
    took_s = scanning.until(lambda: any(text.startswith(row) for _, text in scanning.told("FAULT")), 3.0)
    assert took_s <= BY_NAME[row].detect_s + 0.03  # a turn of the scanner until the first bad sample is whole
    heal(scanning)
    scanning.run(0.05)
    assert scanning.phase is Phase.SCANNING and scanning.nodes.tilt.state is not TiltState.SWEEPING
    scanning.until_phase(Phase.MAPPING, 30.0)
    assert row in {text for _, text in scanning.told("FAULT_CLEARED")}
    assert scanning.rover.executive.mission.scans_taken == 1


@pytest.mark.parametrize("row", ["TILT_STALL", "LIDAR_GARBLED", "LIDAR_DIRTY"])
def test_a_device_that_stays_wrong_ends_in_safe_with_the_reason(scanning, row):
    BREAKS[row][0](scanning)
    assert scanning.until_final(scanning.request, 90.0) is RequestState.FAILED
    assert "scanned again 3 times" in scanning.text(scanning.request) and row in scanning.text(scanning.request)
    assert scanning.mode is Mode.SAFE


def test_a_jump_of_utc_is_told_and_moves_no_order():
    rover, utc_ns = CoreBench(settings=quick()), 1_800_000_000 * S_NS
    for tick in range(400):
        jump_ns = -7200 * S_NS if tick >= 300 else 0
        rover.health = rover.health._replace(utc_ns=utc_ns + tick * TICK_NS + jump_ns)
        rover.step()
    ((at_s, text),) = rover.told("FAULT")
    assert text.startswith("CLOCK_JUMP") and "last by -7200.0 s" in text and at_s == pytest.approx(3.01, abs=0.011)
    assert rover.mode is Mode.STANDBY


def test_a_gyro_that_reads_otherwise_at_the_next_stop_is_named_and_learned():
    rover = CoreBench(settings=quick())
    rover.run(4.0)
    rover.order("drive", vx_mps=0.1, vy_mps=0.0, yaw_radps=0.0, duration_s=3.0, distance_m=1.0)
    rover.run(1.0)
    rover.nodes.imu.gyro_bias_radps[2] += math.radians(0.2)
    rover.until(lambda: rover.mode is Mode.STANDBY and not any(rover.turning_rates), 10.0)
    took_s = rover.until(lambda: rover.told("FAULT"), 4.0)
    row, changed = re.fullmatch(r"(\w+): by ([+-][\d.]+) degrees a second .*", rover.told("FAULT")[0][1]).groups()
    assert row == "IMU_BIAS" and float(changed) == pytest.approx(0.2, abs=0.02)
    assert took_s <= BY_NAME["IMU_BIAS"].detect_s
    rover.run(2.0)
    turns = []
    for _ in range(100):
        rover.step()
        turns.append(rover.rover.localisation.yaw_rate_radps)
    assert abs(np.mean(turns)) < math.radians(0.03)
