"""The bus guard: what it tolerates, what makes it stop the rover, that it can do nothing else."""

import json
import os
import signal
import threading
import uuid

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.devices.can.nodes import build_nodes
from onboard.__main__ import app
from onboard.bus_guard.command import watch
from onboard.bus_guard.rules import MARGIN, ORDERS, STOP, BusGuard, Offence
from onboard.config import Can, Rover
from onboard.devices.nodes import Nodes
from onboard.drivers.can.bus import open_bus
from onboard.records import Frame, PortState, WheelCommand, WheelMode
from protocol.can.crc import crc8
from protocol.can.guard import Sender
from protocol.generated.can_codec import TABLE, NodeState, StopReason

TICK_NS = 10_000_000
MOVE = WheelCommand(WheelMode.RUN, 0.2, 1.1)


class Bench:
    """The flight program's own orders, tick by tick, under the guard's eyes; `spoil` may change what it hears."""

    def __init__(self):
        self.computer, self.guard = Nodes(Rover(), Can()), BusGuard(Rover())
        self.now_ns = 0
        self.computer.set_wheels([MOVE] * 4)

    def tick(self, count=1, spoil=lambda frames, now_ns: frames):
        """What the guard sent in so many ticks."""
        sent = []
        for _ in range(count):
            self.now_ns += TICK_NS
            frames = [f._replace(stamp_ns=self.now_ns) for f in self.computer.send(self.now_ns, 3)]
            sent += self.guard.step(self.now_ns, spoil(frames, self.now_ns))
        return sent

    @property
    def offence(self):
        return self.guard.verdict and self.guard.verdict.offence


@pytest.fixture
def bench():
    bench = Bench()
    assert bench.tick(200) == []
    return bench


def resealed(frame, change):
    """A frame changed and given a good checksum again, as a program gone mad would send it."""
    data = bytearray(change(bytearray(frame.data)))
    data[7] = crc8(data[:7], TABLE[frame.can_id].seed)
    return frame._replace(data=bytes(data))


def only(name, change):
    """Spoils the frames of one name."""

    def spoil(frames, now_ns):
        return [new for old in frames for new in (change(old) if TABLE[old.can_id].name == name else [old])]

    return spoil


def test_an_hour_of_the_flight_programs_own_orders_is_left_alone(bench):
    for _ in range(36):
        bench.computer.set_wheels([WheelCommand(WheelMode.RUN, -1.8, -4.0)] * 4)
        assert bench.tick(100) == [] and bench.offence is None


def test_a_standing_rover_needs_no_heartbeat():
    guard = BusGuard(Rover())
    assert guard.step(60_000_000_000, []) == []


def test_motion_without_heartbeat_is_stopped_after_three_beats(bench):
    begun = bench.now_ns
    mute = only("COMPUTER_HEARTBEAT", lambda f: [])
    sent = next(sent for _ in range(50) if (sent := bench.tick(1, mute)))
    assert bench.offence is Offence.HEARTBEAT
    assert 0.25e9 <= bench.now_ns - begun <= 0.46e9
    assert [f.can_id for f in sent] == [STOP]
    assert TABLE[STOP].decode(sent[0].data) == (StopReason.GUARD, Offence.HEARTBEAT << 12 | 0x104)


def test_motion_with_the_drive_not_enabled_is_stopped(bench):
    bench.tick(20, only("DRIVE_ENABLE", lambda f: [resealed(f, lambda d: bytes([d[0] & 0xFE]) + d[1:])]))
    assert bench.offence is Offence.ENABLE and "says no" in bench.guard.verdict.text


def test_motion_with_a_stale_enable_is_stopped(bench):
    bench.tick(50, only("DRIVE_ENABLE", lambda f: []))
    assert bench.offence is Offence.ENABLE and "s old" in bench.guard.verdict.text


def test_an_order_that_comes_twice_as_often_is_stopped(bench):
    sender = Sender()

    def chatter(frames, now_ns):
        return [Frame(0x102, sender.encode(0x102, WheelMode.HOLD, 0.0, 0.0), now_ns)]

    assert bench.tick(30, chatter)
    assert bench.offence is Offence.RATE and "WHEEL_2_COMMAND came 18 times" in bench.guard.verdict.text


@pytest.mark.parametrize(("steer", "rate", "word"), [(2.2, 0.0, "steer_rad = 2.2"), (0.0, -4.2, "rate_radps = -4.2")])
def test_what_this_rover_cannot_do_is_stopped_at_the_first_frame(steer, rate, word):
    data, guard = TABLE[0x103].encode(WheelMode.RUN, steer, rate, 5), BusGuard(Rover())
    assert [f.can_id for f in guard.step(TICK_NS, [Frame(0x103, data, TICK_NS)])] == [STOP]
    assert guard.verdict.offence is Offence.RANGE and word in guard.verdict.text


def test_a_value_that_the_dbc_does_not_allow_is_stopped(bench):
    bench.tick(2, only("WHEEL_1_COMMAND", lambda f: [resealed(f, lambda d: bytes([d[0] | 3]) + d[1:])]))
    assert bench.offence is Offence.RANGE and "does not allow" in bench.guard.verdict.text


def test_a_second_master_is_stopped(bench):
    other = Sender()
    other.encode(0x101, WheelMode.RUN, 0.0, 0.0)

    def both(frames, now_ns):
        mine = [Frame(0x101, other.encode(0x101, WheelMode.RUN, 0.5, 0.5), now_ns) for f in frames if f.can_id == 0x101]
        return frames + mine[:1] * (now_ns // TICK_NS % 4 < 2)  # every second order: the rate alone is no offence

    bench.tick(100, both)
    assert bench.offence is Offence.COUNTER


def test_a_line_that_damages_orders_is_stopped_and_a_single_damaged_one_is_not(bench):
    damaged = only("WHEEL_4_COMMAND", lambda f: [f._replace(data=f.data[:7] + bytes([f.data[7] ^ 1]))])
    bench.tick(10, damaged)
    bench.tick(200)
    assert bench.offence is None
    bench.tick(20, damaged)
    assert bench.offence is Offence.CHECKSUM


def test_a_stop_is_repeated_ten_times_a_second_until_both_steps_of_a_reset_came(bench):
    bench.tick(50, only("DRIVE_ENABLE", lambda f: []))
    assert len(bench.tick(100)) == 10
    reset = Sender()

    def step(number, nonce):
        frame = Frame(0x020, reset.encode(0x020, nonce, number), bench.now_ns)
        bench.guard.step(bench.now_ns, [frame])
        return bench.guard.verdict

    assert step(2, 7) and step(1, 7) and step(2, 8)
    assert step(1, 9) and step(2, 9) is None
    assert bench.tick(100) == []


def test_an_offence_that_goes_on_is_stopped_again_after_a_reset(bench):
    mute = only("COMPUTER_HEARTBEAT", lambda f: [])
    bench.tick(50, mute)
    reset = Sender()
    for number in (1, 2):
        bench.guard.step(bench.now_ns, [Frame(0x020, reset.encode(0x020, 1, number), bench.now_ns)])
    assert bench.offence is None
    bench.tick(50, mute)
    assert bench.offence is Offence.HEARTBEAT


# -- the edges, by hand -------------------------------------------------------------------------------------------


MS = 1_000_000
SAYS = {"DRIVE_ENABLE": (1, 3), "COMPUTER_HEARTBEAT": (3, 1, 1)}


class Master:
    """Orders sealed one by one, at times in ms."""

    def __init__(self, rover=None):
        self.guard, self.sender = BusGuard(rover or Rover()), Sender()

    def wheel(self, at_ms, rate=1.0, mode=WheelMode.RUN):
        return Frame(0x101, self.sender.encode(0x101, mode, 0.0, rate), round(at_ms * MS))

    def says(self, at_ms, name, *values):
        can_id = next(i for i, row in TABLE.items() if row.name == name)
        return Frame(can_id, self.sender.encode(can_id, *values), round(at_ms * MS))

    def hears(self, at_ms, *frames):
        self.guard.step(round(at_ms * MS), frames)
        return self.guard.verdict and (self.guard.verdict.offence, self.guard.verdict.text)


@pytest.mark.parametrize(("last_ms", "stopped"), [(1000.0, False), (999.0, True)])
def test_eight_damaged_orders_are_too_many_within_a_second_and_not_in_one(last_ms, stopped):
    master = Master()
    for at_ms in (0, 100, 200, 300, 400, 500, 600, last_ms):
        frame = master.wheel(at_ms, 0.0, WheelMode.HOLD)
        told = master.hears(at_ms, frame._replace(data=frame.data[:7] + bytes([frame.data[7] ^ 1])))
        assert (told is not None) == (stopped and at_ms == last_ms)


def test_eight_replayed_orders_within_a_second_are_stopped_and_a_single_one_is_not():
    master = Master()
    for tick in range(40):
        frame = master.wheel(20 * tick, 0.0, WheelMode.HOLD)
        assert master.hears(20 * tick, frame, *[frame] * (tick == 3)) is None
    for tick in range(100, 116):
        frame = master.wheel(20 * tick, 0.0, WheelMode.HOLD)
        told = master.hears(20 * tick, frame, *[frame] * (tick % 2))
        assert told is None or tick == 115
    assert told == (Offence.COUNTER, "WHEEL_1_COMMAND came out of sequence 8 times within 1 s")


def test_an_order_of_motion_needs_a_beat_350_ms_old_at_most():
    master = Master()
    for at_ms in (100, 300):
        enable = master.says(at_ms, "DRIVE_ENABLE", *SAYS["DRIVE_ENABLE"])
        assert master.hears(at_ms, enable, master.wheel(at_ms)) is None
    assert master.hears(350) is None
    told = master.hears(351)
    assert told == (Offence.HEARTBEAT, "WHEEL_1_COMMAND orders motion, the computer has not beaten for 0.35 s")


def test_the_silence_that_is_told_counts_from_the_last_beat_and_the_last_enable():
    for late, offence, words in (
        ("DRIVE_ENABLE", Offence.ENABLE, "WHEEL_1_COMMAND orders motion, DRIVE_ENABLE is 0.36 s old"),
        (
            "COMPUTER_HEARTBEAT",
            Offence.HEARTBEAT,
            "WHEEL_1_COMMAND orders motion, the computer has not beaten for 0.36 s",
        ),
    ):
        master = Master()
        assert master.hears(200, *(master.says(200, name, *said) for name, said in SAYS.items())) is None
        other = next(name for name in SAYS if name != late)
        assert master.hears(500, master.says(500, other, *SAYS[other]), master.wheel(500)) is None
        assert master.hears(550) is None
        assert master.hears(560) == (offence, words)


def test_an_order_of_motion_counts_for_100_ms():
    for at_ms, stopped in ((400, True), (401, False)):
        master = Master()
        assert master.hears(300, master.wheel(300)) is None
        assert (master.hears(at_ms) is not None) == stopped


def test_an_order_at_its_limit_and_the_margin_is_let_pass():
    master = Master(Rover(wheel_rate_limit_radps=2.0 - MARGIN))
    frame = master.wheel(10, 2.0)
    assert TABLE[0x101].decode(frame.data).rate_radps == 2.0 == 2.0 - MARGIN + MARGIN
    assert master.hears(10, frame) is None


@pytest.mark.parametrize("as_json", [False, True])
def test_the_command_tells_what_it_watches_and_why_it_stops(as_json):
    uri = f"virtual:guard-{uuid.uuid4()}"
    data = TABLE[0x103].encode(WheelMode.RUN, 2.2, 0.0, 5)
    master = open_bus(uri)

    def order_until_stopped():
        while not any(frame.can_id == STOP for frame in master.read(0)):
            master.write([Frame(0x103, data)])
        os.kill(os.getpid(), signal.SIGTERM)

    ordering = threading.Thread(target=order_until_stopped)
    kept = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    ordering.start()
    told = CliRunner().invoke(app, ["guard", "--bus", uri, *["--json"] * as_json])
    ordering.join(60.0)
    for number, handler in kept.items():
        signal.signal(number, handler)
    master.close()
    assert told.exit_code == 0
    text = f"WHEEL_3_COMMAND.steer_rad = 2.200, this rover has {Rover().steer_limit_rad:.3f}"
    if as_json:
        assert [json.loads(line) for line in told.stdout.splitlines()] == [
            {"event": f"watching {uri}"},
            {"event": "STOP", "offence": "RANGE", "can_id": 0x103, "text": text},
        ]
    else:
        assert told.stdout.splitlines() == [f"guard: watching {uri}", f"guard: STOP: RANGE: {text}"]


IDS = st.integers(0, 0x7FF) | st.sampled_from(sorted(ORDERS))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(IDS, st.binary(max_size=8), st.integers(0, 10**9)), max_size=60))
def test_whatever_it_hears_it_can_only_stop(frames):
    guard, now_ns = BusGuard(Rover()), 0
    for can_id, data, wait_ns in frames:
        now_ns += wait_ns
        if len(data) == 8 and can_id in TABLE:
            data = data[:7] + bytes([crc8(data[:7], TABLE[can_id].seed)])
        assert {f.can_id for f in guard.step(now_ns, [Frame(can_id, data, now_ns)])} <= {STOP}


def test_its_stop_latches_every_node_and_the_computer_says_who_stopped_it(bench):
    nodes = build_nodes(1)
    stop = bench.tick(50, only("DRIVE_ENABLE", lambda f: []))[0]
    nodes.receive(stop, bench.now_ns)
    assert {wheel.node_state for wheel in nodes.wheels} == {NodeState.EMERGENCY_STOP}
    bench.computer.receive([stop], bench.now_ns)
    assert bench.computer.emergency == ("GUARD", StopReason.GUARD, Offence.ENABLE << 12 | 0x104)


def test_on_a_bus_it_stops_a_master_without_heartbeat_and_ends_with_the_bus():
    name = f"virtual:guard-{uuid.uuid4()}"
    master, port = open_bus(name), open_bus(name)
    sender, told, heard, ticks = Sender(), [], [], iter(range(1, 10_000))

    def now_ns():
        now = next(ticks) * TICK_NS
        master.write([Frame(0x101, sender.encode(0x101, WheelMode.RUN, 0.0, 1.0))] if now % (2 * TICK_NS) else [])
        heard.extend(frame.can_id for frame in master.read(now))
        if len(heard) == 3:
            port.close()
        return now

    guarding = threading.Thread(
        target=watch,
        args=(port, BusGuard(Rover()), lambda *words: told.append(words), lambda: False),
        kwargs={"now_ns": now_ns},
    )
    guarding.start()
    guarding.join(60.0)
    assert not guarding.is_alive() and port.state is PortState.CLOSED
    assert heard == [STOP] * 3
    assert [(event, verdict.offence) for event, verdict in told] == [("STOP", Offence.HEARTBEAT)]
    master.close()


def test_a_bus_that_cannot_be_opened_is_named():
    result = CliRunner().invoke(app, ["guard", "--bus", "socketcand:127.0.0.1:1/rover"])
    assert result.exit_code == 69 and "socketcand:127.0.0.1:1/rover cannot be opened" in result.stderr
    result = CliRunner().invoke(app, ["guard", "--bus", "canbus0"])
    assert result.exit_code == 78 and "names no bus" in result.stderr
