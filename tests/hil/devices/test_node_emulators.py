"""The emulated nodes: command timeout, emergency stop, tilt segments, sensors, the same seed."""

import math

import numpy as np
import pytest

from hil.devices.can.nodes import Nodes, build_nodes
from hil.records import PlantState, WheelTruth
from onboard.records import Frame
from protocol.can.guard import Sender
from protocol.generated.can_codec import (
    ENCODER_COUNTS_PER_TURN,
    TABLE,
    NodeState,
    StopReason,
    TiltMode,
    TiltState,
    WheelMode,
)

TICK_NS = 10_000_000
DEG = math.pi / 180
STANDING = (WheelTruth(0.0, 0.0, 0.0, 0.0),) * 4


def truth(now_ns=0, wheels=STANDING, gyro=(0.0, 0.0, 0.0), force=(0.0, 0.0, 1.62)):
    zero = np.zeros(3)
    return PlantState(now_ns, zero, np.array([0, 0, 0, 1.0]), zero, np.array(gyro), np.array(force), wheels)


class Bench:
    """A bus in ticks: frames of the computer in, the nodes' frames out, decoded."""

    def __init__(self, seed=7):
        self.nodes: Nodes = build_nodes(seed)
        self.sender = Sender()
        self.now_ns = 0
        self.frames = []

    def put(self, can_id, *values):
        self.nodes.receive(Frame(can_id, self.sender.encode(can_id, *values), self.now_ns), self.now_ns)

    def tick(self, count=1, state=None, **kwargs):
        new = []
        for _ in range(count):
            self.now_ns += TICK_NS
            self.nodes.step(self.now_ns, state or truth(self.now_ns, **kwargs))
            new += self.nodes.send()
        self.frames += new
        return [(TABLE[f.can_id].name, TABLE[f.can_id].decode(f.data), f.stamp_ns) for f in new]

    def run_wheels(self, count, rate=1.1, steer=0.2):
        for _ in range(count):
            self.put(0x100, 1, 3)
            for n in (1, 2, 3, 4):
                self.put(0x100 + n, WheelMode.RUN, steer, rate)
            self.tick(2)


def named(messages, name):
    return [values for n, values, _ in messages if n == name]


# -- wheels ----------------------------------------------------------------------------------------------------


def test_drive_slews_at_one_radian_per_second_squared():
    bench = Bench()
    bench.run_wheels(25)
    assert bench.nodes.drives()[2].rate_radps == pytest.approx(0.5, abs=0.011)
    assert bench.nodes.drives()[2].steer_rad == pytest.approx(0.2)


def test_a_wheel_without_command_ramps_to_zero_from_100_ms_on_and_holds_its_steering():
    bench = Bench()
    bench.run_wheels(100)
    moving = tuple(WheelTruth(0.15, 3.0, 1.1, 2.0) for _ in range(4))
    messages = bench.tick(8, wheels=moving)  # 100 ms after the last command
    assert bench.nodes.drives()[0].rate_radps == pytest.approx(1.1, abs=1e-3)
    assert named(messages, "WHEEL_1_FEEDBACK")[-1].state == NodeState.RUNNING
    messages = bench.tick(1, wheels=moving)
    assert bench.nodes.drives()[0].rate_radps == pytest.approx(1.09, abs=1e-3)
    assert bench.nodes.drives()[0].steer_rad == 0.15
    assert named(messages, "WHEEL_1_FEEDBACK")[-1].state == NodeState.COMMAND_TIMEOUT
    bench.tick(110, wheels=moving)
    assert bench.nodes.drives()[0].rate_radps == 0.0


def test_without_drive_enable_nothing_turns():
    bench = Bench()
    for _ in range(50):
        bench.put(0x101, WheelMode.RUN, 0.1, 1.0)
        bench.tick(2)
    assert bench.nodes.drives()[0] == pytest.approx((0.1, 0.0), abs=1e-4)


def test_a_command_with_a_bad_checksum_or_counter_is_no_command():
    bench = Bench()
    data = bytearray(bench.sender.encode(0x101, WheelMode.RUN, 0.1, 1.0))
    data[2] ^= 4
    bench.nodes.receive(Frame(0x101, bytes(data)), 0)
    bench.tick(3)
    assert bench.nodes.wheels[0].timed_out and bench.nodes.wheels[0].guard.counts(0x101).crc == 1


def test_encoder_counts_wrap_at_16_bits():
    bench = Bench()
    turn = [WheelTruth(0.0, p, 0.0, 0.0) for p in (-0.001, 16 * math.tau + 0.01, 0.0, 1.0)]
    messages = bench.tick(1, wheels=tuple(turn))
    assert ENCODER_COUNTS_PER_TURN == 4096
    counts = [named(messages, f"WHEEL_{n}_FEEDBACK")[0].encoder_count for n in (1, 2, 3, 4)]
    assert counts == [65535, int(0.01 / math.tau * 4096), 0, int(1 / math.tau * 4096)]


def test_current_follows_torque():
    bench = Bench()
    messages = bench.tick(20, wheels=(WheelTruth(0.0, 0.0, 0.0, 4.0),) * 4)
    currents = [v.drive_current_a for v in named(messages, "WHEEL_3_STATUS")]
    assert len(currents) == 4 and np.mean(currents) == pytest.approx(5.0, abs=0.05)


def test_a_silent_node_sends_and_hears_nothing_and_its_wheel_stops():
    bench = Bench()
    bench.run_wheels(60)
    bench.nodes.wheels[1].silent = True
    bench.run_wheels(70)
    assert bench.nodes.drives()[1].rate_radps == 0.0 and bench.nodes.drives()[0].rate_radps > 1.0
    assert not any(f.can_id == 0x182 and f.stamp_ns > 1_210_000_000 for f in bench.frames)


def told_of(bench, can_id):
    """What the newest frame of an id says."""
    return TABLE[can_id].decode([f for f in bench.frames if f.can_id == can_id][-1].data)


def test_a_stuck_steering_stays_and_the_motor_of_a_jammed_drive_draws_its_stall_current():
    bench = Bench()
    one, two, *_ = bench.nodes.wheels
    one.drive_stuck, two.steer_stuck_rad = True, -0.3
    bench.run_wheels(70)
    assert bench.nodes.drives()[1].steer_rad == -0.3
    assert told_of(bench, 0x1A1).drive_current_a == pytest.approx(10.0, abs=0.1)
    assert abs(told_of(bench, 0x1A3).drive_current_a) < 0.2


# -- emergency stop --------------------------------------------------------------------------------------------


def test_emergency_stop_latches_until_the_two_steps_with_one_nonce():
    bench = Bench()
    bench.run_wheels(50)
    bench.put(0x010, StopReason.OPERATOR, 0)
    bench.run_wheels(60)
    assert all(d.rate_radps == 0.0 for d in bench.nodes.drives())
    for step, nonce in ((2, 5), (1, 5), (2, 6)):  # no first step; another nonce
        bench.put(0x020, nonce, step)
        bench.run_wheels(5)
        assert all(d.rate_radps == 0.0 for d in bench.nodes.drives())
    bench.put(0x020, 9, 1)
    armed = bench.tick(1)
    bench.put(0x020, 9, 2)
    released = bench.tick(1)
    for messages, state in ((armed, NodeState.RESET_ARMED), (released, NodeState.COMMAND_TIMEOUT)):
        beats = [(n, v.state) for n, v, _ in messages if n.startswith("NODE_HEARTBEAT")]
        assert len(beats) == 7
        assert [s for n, s in beats if "WHEEL" in n] == [state] * 4 or state == NodeState.COMMAND_TIMEOUT
    bench.run_wheels(10)
    assert bench.nodes.drives()[0].rate_radps > 0.1


def test_a_stop_after_the_first_step_disarms():
    bench = Bench()
    bench.put(0x010, 1, 0)
    bench.put(0x020, 9, 1)
    bench.put(0x01F, StopReason.GUARD, 0)
    bench.put(0x020, 9, 2)
    assert all(node.latched for node in bench.nodes.all)


def test_a_node_that_stops_the_rover_tells_all_others_at_10_hz():
    bench = Bench()
    bench.nodes.tilt.assert_stop(StopReason.BUTTON, 3)
    messages = bench.tick(50)
    stops = named(messages, "EMERGENCY_STOP_TILT")
    assert len(stops) == 5 and stops[0] == (StopReason.BUTTON, 3)
    assert all(node.latched for node in bench.nodes.all)


# -- tilt ------------------------------------------------------------------------------------------------------


def sync_and_sweep(bench, segments):
    """Segments of (start_ms, start_deg, end_deg, rate_degps), all bus time."""
    bench.put(0x080, bench.now_ns // 1000)
    for start_ms, start, end, rate in segments:
        bench.put(0x120, start * DEG, end * DEG, rate * DEG, start_ms & 0xFFFF, TiltMode.SWEEP)


def test_tilt_segments_join_within_a_tenth_of_a_degree():
    bench = Bench()
    sync_and_sweep(bench, [(2500, 60, 50, 20.0), (3000, 50, 45, 10.0)])
    bench.tick(251)
    sync_and_sweep(bench, [(3500, 45, 35, 20.0)])
    bench.tick(200)
    times = np.arange(2510, 4000, 5)
    wanted = np.interp(times, [2500, 3000, 3500, 4000], [60, 50, 45, 35])
    angles = bench.nodes.tilt.angles_at(times * 1_000_000) / DEG
    assert np.abs(angles - wanted).max() < 0.1
    states = {v.state for v in (TABLE[0x1C0].decode(f.data) for f in bench.frames if f.can_id == 0x1C0)}
    assert TiltState.SWEEPING in states and TiltState.GAP not in states


def test_a_hole_between_segments_is_shown_as_a_gap():
    bench = Bench()
    sync_and_sweep(bench, [(2500, 60, 50, 20.0), (3300, 50, 45, 10.0)])
    bench.tick(320)
    assert bench.nodes.tilt.state is TiltState.GAP


def test_repeats_of_a_segment_are_one_command():
    bench = Bench()
    for _ in range(3):
        sync_and_sweep(bench, [(2500, 60, 50, 20.0)])
    bench.tick(310)
    assert bench.nodes.tilt.state is TiltState.PARKED
    sync_and_sweep(bench, [(2500, 60, 50, 20.0)])
    bench.tick(10)
    assert bench.nodes.tilt.state is TiltState.PARKED


def test_start_times_wrap_by_the_half_window_rule():
    bench = Bench()
    bench.tick(6500)  # 65.0 s: the start lies behind the wrap of 16 bits
    sync_and_sweep(bench, [(67500, 10, 20, 20.0)])
    bench.tick(275)
    angle = float(bench.nodes.tilt.angles_at(np.array([67_750_000_000]))[0])
    assert angle == pytest.approx(15 * DEG, abs=0.1 * DEG)


def test_tilt_feedback_is_200_hz_moving_and_10_hz_parked():
    bench = Bench()
    bench.tick(1)
    assert len(named(bench.tick(100), "TILT_FEEDBACK")) == 10
    bench.put(0x120, 0.5, 0.5, 10 * DEG, 0, TiltMode.PARK)
    assert len(named(bench.tick(100), "TILT_FEEDBACK")) == 200
    assert bench.nodes.tilt.angles_at(np.array([bench.now_ns]))[0] == pytest.approx(10 * DEG, abs=0.1 * DEG)


def test_a_stalled_axis_stays_where_it_is():
    bench = Bench()
    bench.nodes.tilt.stalled = True
    bench.put(0x120, 0.5, 0.5, 10 * DEG, 0, TiltMode.PARK)
    bench.tick(100)
    assert bench.nodes.tilt.angles_at(np.array([bench.now_ns]))[0] == 0.0


# -- sensors ---------------------------------------------------------------------------------------------------


def test_imu_measures_with_its_noise_at_100_hz():
    bench = Bench()
    messages = bench.tick(1000, gyro=(0.1, -0.2, 0.3), force=(0.5, 0.0, 1.62))
    gyro = np.array([v[:3] for v in named(messages, "IMU_GYRO")])
    accel = np.array([v[:3] for v in named(messages, "IMU_ACCEL")])
    assert gyro.shape == accel.shape == (1000, 3)
    assert np.abs(gyro.mean(0) - (0.1, -0.2, 0.3)).max() < 0.003
    assert np.abs(accel.mean(0) - (0.5, 0.0, 1.62)).max() < 0.05
    assert np.abs(gyro.std(0) / 0.001 - 1).max() < 0.1


def test_imu_says_when_it_is_saturated():
    messages = Bench().tick(1, gyro=(9.0, 0.0, 0.0))
    values = named(messages, "IMU_GYRO")[0]
    assert values.status == 1 and values.x_radps == pytest.approx(3.2767)


def test_energy_is_the_integral_of_power():
    bench = Bench()
    bench.nodes.power.charge_ratio = 0.5
    bench.tick(6000, wheels=(WheelTruth(0.0, 0.0, 2.0, 3.0),) * 4)  # 35 W + 4 * 6 W / 0.6 for a minute
    assert (0.5 - bench.nodes.power.charge_ratio) * 500 * 3600 == pytest.approx(75 * 60, rel=1e-6)


def test_brown_out_is_told_by_the_switch_bit():
    bench = Bench()
    bench.nodes.power.sag_v = 12.0
    values = named(bench.tick(20), "POWER_STATUS")[0]
    assert values.voltage_v < 20.0 and values.switches & 0x80


# -- the whole -------------------------------------------------------------------------------------------------


def test_frame_rates_at_rest_are_those_of_the_dbc():
    bench = Bench()
    bench.tick(1000)
    rates = {TABLE[i].name: sum(f.can_id == i for f in bench.frames) / 10 for i in {f.can_id for f in bench.frames}}
    for name, rate in rates.items():
        row = next(r for r in TABLE.values() if r.name == name)
        assert rate == pytest.approx(1e9 / row.cycle_ns, abs=0.1), name
    assert len(rates) == 19


def test_same_seed_same_frames_and_another_seed_others():
    def run(seed):
        bench = Bench(seed)
        bench.run_wheels(50)
        return bench.frames

    assert run(3) == run(3) != run(4)


def test_frames_of_a_tick_are_ordered_by_stamp_then_id():
    bench = Bench()
    bench.put(0x120, 0.5, 0.5, 10 * DEG, 0, TiltMode.PARK)
    bench.tick(1)
    keys = [(f.stamp_ns, f.can_id) for f in bench.frames]
    assert keys == sorted(keys) and keys[0] == (5_000_000, 0x1C0)
