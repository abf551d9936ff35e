"""The computer's end of the bus, alone with hand-made frames and then against the emulated nodes."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest

from hil.devices.can.nodes import build_nodes
from hil.records import PlantState, WheelTruth
from onboard.config import Can, Rover
from onboard.devices.nodes import NODES, Nodes
from onboard.devices.tilt import orders
from onboard.records import Frame, WheelCommand, WheelMode
from protocol.can.guard import Sender
from protocol.generated.can_codec import TABLE, StopReason, TiltMode, TiltState

TICK_NS = 10_000_000
DEG = math.pi / 180


class Segment(NamedTuple):
    start_rad: float
    end_rad: float
    rate_radps: float
    duration_ns: int


def profile():
    """A sweep from +60 to -20 degrees in 24 segments whose rates span 1.6 to 20 degrees a second."""
    ends = np.concatenate([np.linspace(60, 10, 9), np.linspace(8, 1, 12), np.array([-5.0, -10.0, -15.0, -20.0])])
    rates = np.concatenate([np.linspace(19.9, 8.3, 8), np.linspace(4.7, 1.63, 12), np.array([11.1, 15.3, 19.7, 20.0])])
    ends *= DEG
    rates *= DEG
    return [Segment(a, b, r, int(abs(b - a) / r * 1e9)) for a, b, r in zip(ends[:-1], ends[1:], rates)]


def nodes():
    return Nodes(Rover(), Can())


def decoded(frames):
    return [(TABLE[f.can_id].name, TABLE[f.can_id].decode(f.data)) for f in frames]


class Wire:
    """Encodes frames of the nodes for the computer."""

    def __init__(self, computer):
        self.computer, self.sender = computer, Sender()

    def give(self, now_ns, *messages):
        self.computer.receive([Frame(i, self.sender.encode(i, *v), now_ns) for i, *v in messages], now_ns)


# -- what it hears ---------------------------------------------------------------------------------------------


def test_before_the_first_frame_nothing_is_known():
    computer = nodes()
    assert computer.wheels == (None,) * 4 and computer.power is None and computer.imu == ()
    assert computer.tilt_angle_rad is None and not computer.tilt_moving
    assert computer.wheel_age_ns(1, 50) == computer.heartbeat_age_ns("IMU", 50) == 50
    assert len(computer.tilt_track(0).times_ns) == 0


def test_encoder_is_unwrapped_both_ways():
    computer, wire = nodes(), None
    wire = Wire(computer)
    for tick, position in enumerate([100, 30000, 60000, 24464, 60000, 30000, 100, 65036]):
        wire.give(tick * TICK_NS, (0x181, 0.1, position, 0.5, 1))
    state = computer.wheels[0]
    assert state.position_rad == pytest.approx((65036 - 65536 - 100) / 4096 * math.tau)
    assert (state.steer_rad, state.rate_radps, state.state, state.age_ns) == pytest.approx((0.1, 0.5, 1, 0))


def test_age_counts_from_arrival():
    computer = nodes()
    Wire(computer).give(TICK_NS, (0x182, 0.1, 1, 0.5, 1), (0x200, 28.0, 1.5, 0.8, 15, 7), (0x305, 1, 9, 0, 0, 1, 1))
    computer.receive([], 5 * TICK_NS)
    assert computer.wheels[1].age_ns == computer.power.age_ns == 4 * TICK_NS == computer.wheel_age_ns(2, 5 * TICK_NS)
    assert computer.heartbeat_age_ns("TILT", 6 * TICK_NS) == 5 * TICK_NS
    assert computer.power[:4] == pytest.approx((28.0, 1.5, 0.8, 15.0))


def test_imu_samples_are_those_of_this_tick_and_need_both_frames():
    computer = nodes()
    wire = Wire(computer)
    wire.give(TICK_NS, (0x1D0, 0.1, 0.2, 0.3, 0), (0x1D1, 1.0, 2.0, 3.0, 0))
    (sample,) = computer.imu
    assert sample.stamp_ns == TICK_NS
    assert sample.gyro_radps == pytest.approx((0.1, 0.2, 0.3)) and sample.accel_mps2 == pytest.approx((1, 2, 3))
    wire.give(2 * TICK_NS, (0x1D1, 1.0, 2.0, 3.0, 0))
    assert computer.imu == ()


def test_bad_frames_change_nothing_and_are_counted():
    computer = nodes()
    good = Sender().encode(0x181, 0.1, 5, 0.0, 1)
    computer.receive([Frame(0x181, bytes(8)), Frame(0x7F0, good), Frame(0x181, b"")], 0)
    assert computer.wheels[0] is None and computer.unknown_frames == 1
    assert computer.guard_counts.crc == computer.guard_counts.length == 1 == computer.counts_of(0x181).crc


# -- what it says ----------------------------------------------------------------------------------------------


def test_frame_rates_are_50_and_10_hertz():
    computer = nodes()
    said = [name for tick in range(100) for name, _ in decoded(computer.send(tick * TICK_NS, 3))]
    assert {name: said.count(name) for name in said} == {
        "TIME_SYNC": 10,
        "DRIVE_ENABLE": 10,
        "COMPUTER_HEARTBEAT": 10,
        **{f"WHEEL_{n}_COMMAND": 50 for n in (1, 2, 3, 4)},
    }


def test_an_order_to_stand_leaves_with_the_next_send_and_one_to_go_on_in_its_turn():
    computer, moving = nodes(), WheelCommand(WheelMode.RUN, 0.0, 1.0)
    sent = []
    for tick, rate_radps in enumerate([1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0]):
        computer.set_wheels([moving._replace(rate_radps=rate_radps)] * 4)
        rates = {v.rate_radps for name, v in decoded(computer.send(tick * TICK_NS, 0)) if name == "WHEEL_1_COMMAND"}
        sent.append(rates.pop() if rates else None)
    assert sent == [1.0, None, 1.0, 0.0, None, 0.0, None, 1.0]


def test_wheel_orders_are_clipped_to_the_rover_and_nan_is_refused():
    computer = nodes()
    computer.set_wheels([WheelCommand(WheelMode.RUN, 9.0, -9.0)] * 4)
    orders_ = dict(decoded(computer.send(0, 3)))
    assert orders_["WHEEL_4_COMMAND"] == pytest.approx((WheelMode.RUN, 105 * DEG, -4.0), abs=1e-4)
    with pytest.raises(ValueError, match="wheel 2"):
        good = WheelCommand(WheelMode.RUN, 0.0, 0.0)
        computer.set_wheels([good, good._replace(rate_radps=math.nan), good, good])


def test_a_sweep_in_the_frames_resolution_joins_and_keeps_its_time():
    segments = profile()
    made = orders(segments, 1_000_000_123)
    assert made[0].start_ns == 1_001_000_000
    for one, two in pairwise(made):
        assert one.end_ns == two.start_ns and one.end_rad == two.start_rad
        node_end_ns = one.start_ns + abs(one.end_rad - one.start_rad) / one.rate_radps * 1e9
        assert 0 <= two.start_ns - node_end_ns < 1_000_001
    planned = np.cumsum([s.duration_ns for s in segments])
    ends = np.array([o.end_ns - made[0].start_ns for o in made])
    assert np.abs(ends - planned).max() < 40_000_000


def test_an_empty_or_motionless_sweep_is_refused():
    with pytest.raises(ValueError, match="at least one"):
        nodes().sweep([], 0)
    with pytest.raises(ValueError, match="segment 0"):
        nodes().sweep([Segment(0.1, 0.1, 0.1, 10**9)], 0)


def test_each_segment_is_sent_at_least_200_ms_ahead_and_repeated():
    computer = nodes()
    computer.sweep(profile(), 0)
    seen: dict[int, list[int]] = {}
    for tick in range(1700):
        for name, values in decoded(computer.send(tick * TICK_NS, 3)):
            if name == "TILT_COMMAND" and values.mode == TiltMode.SWEEP:
                seen.setdefault(values.start_ms, []).append(tick * 10)
    assert len(seen) == 24
    assert all(start - sent[0] >= 200 and len(sent) >= 2 for start, sent in seen.items())


def test_after_a_sweep_the_axis_is_held_so_no_old_start_time_is_repeated():
    computer = nodes()
    computer.sweep([Segment(0.0, 0.2, 0.2, 10**9)], 0)
    late = [decoded(computer.send(tick * TICK_NS, 3)) for tick in range(400)][200:]
    modes = {v.mode for tick in late for name, v in tick if name == "TILT_COMMAND"}
    assert modes == {TiltMode.PARK}


def test_parking_again_and_again_at_one_angle_is_said_at_10_hz():
    computer, said = nodes(), []
    for tick in range(100):
        computer.park_tilt(0.5)
        said += [name for name, _ in decoded(computer.send(tick * TICK_NS, 3))]
    assert said.count("TILT_COMMAND") == 10


def test_an_own_emergency_stop_leaves_at_once_and_at_10_hz():
    computer = nodes()
    computer.send(0, 3)
    computer.emergency_stop(StopReason.OPERATOR)
    said = [name for tick in range(1, 101) for name, _ in decoded(computer.send(tick * TICK_NS, 3))]
    assert said[0] == "EMERGENCY_STOP_COMPUTER" and said.count("EMERGENCY_STOP_COMPUTER") == 10
    assert computer.emergency == ("COMPUTER", StopReason.OPERATOR, 0)


# -- against the emulated nodes --------------------------------------------------------------------------------


class Loop:
    """Computer and emulated nodes with one tick of transport each way; wheels follow their drives at once."""

    def __init__(self, seed=5):
        self.computer, self.bench = nodes(), build_nodes(seed)
        self.now_ns = 0
        self.orders = ()
        self.position = [0.0] * 4

    def tick(self, count=1):
        for _ in range(count):
            self.now_ns += TICK_NS
            for frame in self.orders:
                self.bench.receive(frame, self.now_ns)
            drives = self.bench.drives()
            self.position = [p + d.rate_radps * 0.01 for p, d in zip(self.position, drives)]
            wheels = tuple(WheelTruth(d.steer_rad, p, d.rate_radps, 1.0) for d, p in zip(drives, self.position))
            zero = np.zeros(3)
            self.bench.step(self.now_ns, PlantState(self.now_ns, zero, zero, zero, zero, zero, wheels))
            self.computer.receive(self.bench.send(), self.now_ns)
            self.orders = self.computer.send(self.now_ns, 3)


def test_wheels_follow_and_the_encoders_tell_the_way():
    loop = Loop()
    loop.tick()
    loop.computer.set_wheels([WheelCommand(WheelMode.RUN, 0.1 * n, 1.0) for n in (1, 2, 3, 4)])
    loop.tick(4000)
    for wheel, position, n in zip(loop.computer.wheels, loop.position, (1, 2, 3, 4)):
        assert wheel.position_rad == pytest.approx(position, abs=math.tau / 4096) and position > 38
        assert wheel.steer_rad == pytest.approx(0.1 * n, abs=0.01) and wheel.age_ns == 0
    assert loop.computer.guard_counts.bad == loop.computer.guard_counts.lost == loop.computer.guard_counts.late == 0
    assert all(loop.computer.heartbeat_age_ns(node, loop.now_ns) <= 500_000_000 for node in NODES)


def test_a_dead_computer_stops_the_wheels():
    loop = Loop()
    loop.computer.set_wheels([WheelCommand(WheelMode.RUN, 0.0, 1.0)] * 4)
    loop.tick(150)
    loop.computer.send = lambda _now_ns, _mode: ()
    loop.tick(120)
    assert [d.rate_radps for d in loop.bench.drives()] == [0.0] * 4


def test_reset_releases_every_node_in_two_steps_and_then_the_rover_drives():
    loop = Loop()
    loop.computer.set_wheels([WheelCommand(WheelMode.RUN, 0.0, 1.0)] * 4)
    loop.tick(120)
    loop.bench.power.assert_stop(StopReason.FAULT, 2)
    loop.tick(100)
    assert loop.computer.emergency == ("POWER", StopReason.FAULT, 2)
    assert all(n.latched for n in loop.bench.all) and loop.bench.drives()[0].rate_radps == 0.0
    loop.computer.reset(nonce=77)
    loop.tick(20)
    assert not loop.computer.resetting and loop.computer.emergency is None
    assert not any(n.latched for n in loop.bench.all)
    loop.tick(50)
    assert loop.bench.drives()[0].rate_radps > 0.3


def test_a_reset_that_a_node_does_not_answer_ends_after_3_s_and_leaves_the_stop():
    loop = Loop()
    loop.tick(60)
    loop.computer.emergency_stop(StopReason.OPERATOR)
    loop.tick(5)
    loop.bench.imu.hears.discard(0x020)
    loop.computer.reset(1)
    loop.tick(310)
    assert not loop.computer.resetting and loop.computer.emergency is not None
    assert all(n.latched for n in loop.bench.all)


def test_a_commanded_sweep_is_followed_within_a_tenth_of_a_degree_and_so_is_its_track():
    loop = Loop()
    loop.tick(20)
    loop.computer.sweep(profile(), loop.now_ns + 2_500_000_000)
    made = loop.computer.tilt._sweep
    begun_ns, states = loop.now_ns, set()
    while not loop.computer.sweep_done(loop.now_ns):
        loop.tick()
        states.add(loop.computer.tilt.state)
        assert loop.now_ns < 30_000_000_000
    transport_ns = TICK_NS  # bus time reaches the node one tick late
    times_ns = np.arange(made[0].start_ns + 20 * TICK_NS // 10, made[-1].end_ns, 3_000_000)
    knots = [made[0].start_ns, *(o.end_ns for o in made)], [made[0].start_rad, *(o.end_rad for o in made)]
    truth_rad = loop.bench.tilt.angles_at(times_ns + transport_ns)
    assert np.abs(truth_rad - np.interp(times_ns, *knots)).max() < 0.1 * DEG
    track = loop.computer.tilt_track(begun_ns)
    assert np.all(np.diff(track.times_ns) > 0)
    inside = (track.times_ns > times_ns[0]) & (track.times_ns < times_ns[-1])
    assert inside.sum() > 1600
    told_rad, at_ns = track.angles_rad[inside], track.times_ns[inside]
    assert np.abs(told_rad - loop.bench.tilt.angles_at(at_ns)).max() < 0.1 * DEG
    assert TiltState.GAP not in states and TiltState.SWEEPING in states


def test_a_sweep_begun_in_the_middle_of_another_replaces_it():
    loop = Loop()
    loop.tick(20)
    loop.computer.sweep(profile(), loop.now_ns + 2_500_000_000)
    loop.tick(400)
    loop.computer.sweep([Segment(-0.2, 0.2, 0.2, 2 * 10**9)], loop.now_ns + 2_000_000_000)
    loop.tick(300)
    assert loop.computer.tilt.state is TiltState.SWEEPING
    assert float(loop.bench.tilt.angles_at(np.array([loop.now_ns]))[0]) == pytest.approx(0.0, abs=0.01)
    loop.tick(120)
    assert loop.computer.sweep_done(loop.now_ns) and not loop.computer.tilt_moving


def test_parking_ends_a_sweep():
    loop = Loop()
    loop.tick(20)
    loop.computer.sweep(profile(), loop.now_ns + 2_500_000_000)
    loop.tick(400)
    loop.computer.park_tilt(40 * DEG)
    loop.tick(250)
    assert not loop.computer.sweep_done(loop.now_ns) and not loop.computer.tilt_moving
    assert loop.computer.tilt_angle_rad == pytest.approx(40 * DEG, abs=0.1 * DEG)


def test_a_lost_tilt_command_is_made_good_by_its_repeat():
    loop = Loop()
    loop.tick(20)
    loop.computer.sweep(profile(), loop.now_ns + 2_500_000_000)
    states, lost = set(), set()
    while not loop.computer.sweep_done(loop.now_ns):
        loop.tick()
        states.add(loop.computer.tilt.state)
        kept = []
        for frame in loop.orders:
            start_ms = TABLE[0x120].decode(frame.data).start_ms if frame.can_id == 0x120 else None
            if start_ms is None or start_ms in lost:
                kept.append(frame)
            else:
                lost.add(start_ms)
        loop.orders = tuple(kept)
    assert len(lost) >= 24 and TiltState.GAP not in states


def test_a_jump_of_the_nodes_clock_is_counted_and_the_track_goes_on():
    loop = Loop()
    loop.tick(50)
    loop.bench.tilt.clock_jump_us = 3_000_000
    loop.computer.park_tilt(0.5)
    loop.tick(200)
    track = loop.computer.tilt_track(0)
    assert loop.computer.tilt.clock_jumps == 1 and np.all(np.diff(track.times_ns) > 0)
    assert abs(track.times_ns[-1] - loop.now_ns) < 100_000_000
    assert loop.computer.tilt_angle_rad == pytest.approx(0.5, abs=2e-3)


def test_the_track_keeps_the_last_40_seconds():
    computer = nodes()
    wire = Wire(computer)
    for k in range(20_000):
        wire.give(k * 5_000_000, (0x1C0, (k * 5000 + 123) & 0xFFFFFF, 0.1, 0.0, 3))
    track = computer.tilt_track(0)
    assert 40e9 <= track.times_ns[-1] - track.times_ns[0] <= 80.1e9
    assert len(computer.tilt_track(99_000_000_000).times_ns) == pytest.approx(200, abs=2)


def test_state_digest_is_of_plain_values_and_the_same_for_the_same_run():
    def run():
        loop = Loop()
        loop.tick(60)
        return loop.computer.digest_items()

    assert run() == run() and all(type(item) in (int, float) for item in run())
