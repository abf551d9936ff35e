"""`onboard can jog` and `home`: what is sent, what is refused, how a movement ends; the machine, and as commands."""

import json
import math
import os
import re
import signal
import threading

import pytest
from click.testing import CliRunner

from hil.devices.can.command import faulty
from hil.devices.can.hub import CanHub
from hil.devices.can.wheels_off_ground import TICK_NS, Stand
from onboard.__main__ import app
from onboard.bringup.can.moving import move
from onboard.bringup.can.moving.jog import Jog, Phase
from onboard.bus_guard.rules import BusGuard
from onboard.config import Can, Rover
from onboard.drivers.can.bus import open_bus
from onboard.records import Frame, WheelMode
from protocol.can.guard import Sender
from protocol.generated.can_codec import TABLE, StopReason
from tests.onboard.stand_clock import StandClock, VirtualEnd, handlers_kept

ROVER = Rover()
OFF, RUN = WheelMode.OFF, WheelMode.RUN


class Hand:
    """The machine and a stand on one wire, tick by tick; agreed as soon as it is ready."""

    def __init__(self, asked, faults=()):
        self.stand = faulty(Stand(), list(faults))
        self.jog = Jog(asked, ROVER, Can())
        self.sent, self.frames, self.phases, self.now_ns = [], [], [], 0
        self._out = ()

    def run(self, ticks=2000, at=None, extra=None):
        for _ in range(ticks):
            self.now_ns += TICK_NS
            if at and self.now_ns >= at[0] * 1e9:
                at[1](self)
                at = None
            frames = [*self.stand.step(self._out, self.now_ns), *((extra(self.now_ns),) if extra else ())]
            self._out = self.jog.tick(frames, self.now_ns)
            self.frames += [(self.now_ns, frame) for frame in self._out]
            self.sent += [(self.now_ns, f.can_id, TABLE[f.can_id].decode(f.data)) for f in self._out]
            if not self.phases or self.phases[-1] is not self.jog.phase:
                self.phases.append(self.jog.phase)
            if self.jog.phase is Phase.READY:
                self.jog.go(self.now_ns)
            if self.jog.phase is Phase.DONE:
                break
        return self.jog

    def of(self, can_id):
        return [(now_ns, values) for now_ns, sent_id, values in self.sent if sent_id == can_id]


def test_a_wheel_turns_as_far_as_rate_and_time_say_and_ends_off():
    hand = Hand(move.turn(2, 0.5, 2.0, ROVER))
    jog = hand.run()
    assert jog.problem == "" and hand.phases == [Phase.LISTENING, Phase.READY, Phase.MOVING, Phase.STOPPING, Phase.DONE]
    assert jog.turned_rad(2) == pytest.approx(0.5 * 2.0, abs=0.03)  # the ramp down makes up for the ramp up
    orders = [values for _, values in hand.of(0x102)]
    assert {(v.mode, v.rate_radps) for v in orders} == {(RUN, 0.5), (RUN, 0.0), (OFF, 0.0)}
    assert [v.mode for v in orders[-9:]] == [OFF] * 9
    assert all(values.mode == OFF for n in (1, 3, 4) for _, values in hand.of(0x100 + n))
    assert abs(hand.stand.nodes.drives()[1].rate_radps) < 0.01


def test_it_sends_what_the_flight_program_sends_and_nothing_before_it_is_told_to_go():
    hand = Hand(move.turn(1, 0.5, 1.0, ROVER))
    hand.run()
    assert hand.sent[0][0] >= 1.2e9
    span_s = (hand.sent[-1][0] - hand.sent[0][0]) / 1e9
    rates = {can_id: len(hand.of(can_id)) / span_s for can_id in (0x080, 0x100, 0x300, 0x101, 0x104)}
    assert rates == pytest.approx({0x080: 10, 0x100: 10, 0x300: 10, 0x101: 50, 0x104: 50}, rel=0.1)
    assert hand.of(0x100)[0][1].enable == 1 and hand.of(0x100)[-1][1].enable == 0
    assert not hand.of(0x120)  # the axis is nobody's business


def test_a_wheel_steers_to_its_angle_and_ends_before_the_time_is_over():
    hand = Hand(move.steer(3, -0.4, 5.0, ROVER))
    jog = hand.run()
    assert jog.problem == "" and jog.nodes.wheels[2].steer_rad == pytest.approx(-0.4, abs=0.02)
    assert hand.now_ns < 4e9
    assert {values.rate_radps for _, values in hand.of(0x103)} == {0.0}


def test_the_axis_tilts_and_home_brings_all_back():
    hand = Hand(move.tilt(0.3, 5.0))
    assert hand.run().problem == "" and hand.jog.nodes.tilt_angle_rad == pytest.approx(0.3, abs=0.02)
    again = Hand(move.home())
    again.stand = hand.stand
    again.now_ns = hand.now_ns
    assert again.run().problem == "" and again.jog.nodes.tilt_angle_rad == pytest.approx(0.0, abs=0.02)
    assert all(abs(wheel.steer_rad) < 0.02 for wheel in again.jog.nodes.wheels)


def test_the_guard_of_the_bus_has_no_objection_to_a_movement():
    for asked in (move.turn(2, -2.0, 3.0, ROVER), move.home(), move.steer(1, 1.8, 8.0, ROVER)):
        hand, guard = Hand(asked), BusGuard(ROVER, 0)
        hand.run()
        for now_ns in range(0, hand.now_ns, TICK_NS):
            frames = [f._replace(stamp_ns=now_ns) for at_ns, f in hand.frames if at_ns == now_ns]
            assert not guard.step(now_ns, frames) and guard.verdict is None


@pytest.mark.parametrize(("faults", "asked", "told"), [
    (["silent=WHEEL_2"], move.turn(2, 0.5, 1.0, ROVER), "WHEEL_2 is not heard on this bus"),
    (["foreign=WHEEL_2"], move.turn(2, 0.5, 1.0, ROVER), "WHEEL_2 has version 99 of rover.dbc, this program 1"),
    (["stop=POWER"], move.turn(2, 0.5, 1.0, ROVER), "POWER asserts an EMERGENCY_STOP (BUTTON)"),
    (["silent=TILT"], move.home(), "TILT is not heard"),
])  # fmt: skip
def test_a_movement_is_refused_with_its_reason_and_nothing_is_sent(faults, asked, told):
    hand = Hand(asked, faults)
    assert hand.run().problem.startswith(told)
    assert hand.phases[-1] is Phase.DONE and Phase.MOVING not in hand.phases and hand.sent == []


def test_a_stop_that_is_latched_though_its_sender_is_gone_is_refused():
    hand = Hand(move.turn(1, 0.5, 1.0, ROVER))
    hand.stand.nodes.power.assert_stop(StopReason.BUTTON)
    hand.stand.step((), 0)
    hand.stand.nodes.power.silent = True
    assert hand.run().problem.startswith("WHEEL_1 has an EMERGENCY_STOP latched")


@pytest.mark.parametrize("can_id", [0x300, 0x101, 0x080, 0x100])
def test_another_computer_on_the_bus_is_never_fought_over(can_id):
    sender = Sender()
    values = {0x300: (1, 0, 0), 0x101: (0, 0.0, 0.0), 0x080: (0,), 0x100: (0, 1)}[can_id]
    hand = Hand(move.turn(1, 0.5, 1.0, ROVER))
    jog = hand.run(extra=lambda now_ns: Frame(can_id, sender.encode(can_id, *values), now_ns))
    assert jog.problem.startswith(f"another computer commands this bus ({TABLE[can_id].name} is on it)")
    assert hand.sent == []


@pytest.mark.parametrize(("asked", "happens", "told"), [
    (move.turn(2, 0.5, 3.0, ROVER), lambda h: h.stand.nodes.imu.assert_stop(StopReason.FAULT), "IMU asserts an"),
    (move.turn(2, 0.5, 3.0, ROVER), lambda h: setattr(h.stand.nodes.wheels[1], "silent", True), "WHEEL_2 went silent"),
    (move.turn(2, 0.5, 3.0, ROVER), lambda h: h.stand.reversed.add("WHEEL_2"), "WHEEL_2 turns the other way"),
])  # fmt: skip
def test_what_goes_wrong_on_the_way_ends_it_with_zero_and_off(asked, happens, told):
    hand = Hand(asked)
    jog = hand.run(at=(2.2, happens))
    assert jog.problem.startswith(told) and hand.phases[-2:] == [Phase.STOPPING, Phase.DONE]
    stopped_ns = next(now_ns for now_ns, values in hand.of(0x102) if now_ns > 2.2e9 and not values.rate_radps)
    assert stopped_ns < 2.2e9 + 0.3e9
    assert all(values.rate_radps == 0.0 for now_ns, values in hand.of(0x102) if now_ns >= stopped_ns)
    assert hand.of(0x102)[-1][1].mode == OFF


def test_a_wheel_that_does_not_turn_is_told_of():
    assert Hand(move.turn(4, -0.5, 1.0, ROVER), ["stuck=WHEEL_4"]).run().problem.startswith("WHEEL_4 did not turn")


def test_an_axis_that_does_not_arrive_is_told_of():
    hand = Hand(move.steer(1, 0.5, 2.0, ROVER))
    hand.stand.nodes.wheels[0].steer_stuck_rad = 0.1
    assert re.fullmatch(r"WHEEL_1 stands at \+0\.(09|10).? rad, asked were \+0\.500", hand.run().problem)


def test_stop_ends_it_at_the_next_tick():
    hand = Hand(move.turn(2, 1.0, 10.0, ROVER))
    jog = hand.run(at=(2.0, lambda h: h.jog.stop()))
    assert jog.stopped and jog.problem == ""
    assert all(values.rate_radps == 0.0 for now_ns, values in hand.of(0x102) if now_ns >= 2.02e9)
    assert 2.7e9 < hand.now_ns < 3.2e9  # it had 0.8 rad/s, loses 1 rad/s a second, and 0.2 s of OFF


@pytest.mark.parametrize(("make", "told"), [
    (lambda: move.turn(1, 2.1, 1, ROVER), "--rate 2.1 should be within -2 and 2 rad/s"),
    (lambda: move.turn(1, math.nan, 1, ROVER), "--rate nan"),
    (lambda: move.turn(1, 0.0, 1, ROVER), "--rate 0 moves nothing"),
    (lambda: move.turn(1, 1.0, 11, ROVER), "--for 11 should be over 0 and at most 10 s"),
    (lambda: move.turn(1, 1.0, math.nan, ROVER), "--for nan"),
    (lambda: move.steer(1, 1.9, 1, ROVER), "--steer 1.9 should be within -1.83 and 1.83 rad"),
    (lambda: move.tilt(-1.3, 1), "--tilt -1.3 should be within -1.2 and 1.2 rad"),
])  # fmt: skip
def test_more_than_a_hand_may_ask_is_refused(make, told):
    with pytest.raises(move.BoundsError) as error:
        make()
    assert str(error.value).startswith(told)


# -- the commands ----------------------------------------------------------------------------------------------


class HubEnd:
    """The stand's end over the socketcand hub; its loop runs beside the blocking handshake of the client."""

    def __init__(self):
        self.hub = CanHub()
        self.uri = self.hub.uri

    def open(self, uri):
        thread = threading.Thread(target=self._greet)
        thread.start()
        self._bus = open_bus(uri)
        thread.join()
        return self._bus

    def _greet(self):
        while not self.hub.live:
            self.hub.wait(0.1)

    def exchange(self, frames, now_ns):
        self.hub.write(frames)
        return self.hub.read_upto(0, self._bus.sent, 5.0, now_ns)

    def close(self):
        self.hub.close()


class World:
    """`onboard can jog` and the stand, time by hand."""

    def __init__(self, end, monkeypatch):
        self.end, self.monkeypatch, self.clock = end, monkeypatch, None
        if isinstance(end, HubEnd):
            monkeypatch.setattr("onboard.bringup.can.shell.open_bus", end.open)

    def run(self, *words, faults=(), at=None, text=None, stand=None):
        self.clock = StandClock(stand or faulty(Stand(), list(faults)), self.end, at)
        self.monkeypatch.setattr("onboard.drivers.platform.clock.WallClock", lambda: self.clock)
        return CliRunner().invoke(app, ["can", *words, "--bus", self.end.uri], input=text)


@pytest.fixture(params=[VirtualEnd, HubEnd], ids=["virtual", "hub"])
def anywhere(request, monkeypatch):
    end = request.param()
    with handlers_kept():
        yield World(end, monkeypatch)
    end.close()


@pytest.fixture
def world(monkeypatch):
    end = VirtualEnd("jog")
    with handlers_kept():
        yield World(end, monkeypatch)
    end.close()


def test_jog_moves_the_wheel_and_tells_its_feedback(anywhere):
    got = anywhere.run("jog", "--wheel", "2", "--rate", "0.5", "--for", "1", "--yes", "--json")
    assert got.exit_code == 0, got.output
    rows = [json.loads(line) for line in got.stdout.splitlines()]
    assert [row["phase"] for row in rows][:: len(rows) - 1] == ["moving", "done"]
    assert rows[-1]["WHEEL_2"]["turned_rad"] == pytest.approx(0.5, abs=0.03)
    assert anywhere.clock.heard[-1].can_id in (0x104, 0x300) and abs(rows[-1]["WHEEL_2"]["rate_radps"]) < 0.02


def test_home_ends_where_it_should(anywhere):
    got = anywhere.run("home", "--yes")
    assert got.exit_code == 0, got.output
    assert got.stdout.splitlines()[-1].startswith("done      steering ")


@pytest.mark.parametrize(("answer", "code", "sent"), [("y\n", 0, True), ("n\n", 130, False), ("", 130, False)])
def test_it_asks_before_it_moves(world, answer, code, sent):
    got = world.run("jog", "--wheel", "1", "--steer", "0.1", text=answer)
    assert got.exit_code == code, got.output
    assert "wheel 1 will steer to +0.100 rad (+5.7 degrees). Are the wheels off the ground" in got.stderr
    assert bool(world.clock.heard) == sent
    assert sent or got.stderr.endswith("onboard: ended before anything moved\n")


def test_ctrl_c_stops_the_wheel_and_leaves_it_off(world):
    at = {250: lambda _: os.kill(os.getpid(), signal.SIGINT)}
    got = world.run("jog", "--wheel", "3", "--rate", "1", "--for", "10", "--yes", at=at)
    assert got.exit_code == 130 and got.stderr == "onboard: stopped by Ctrl-C; the wheels are off\n"
    orders = [TABLE[0x103].decode(frame.data) for frame in world.clock.heard if frame.can_id == 0x103]
    assert orders[-1].mode == OFF and orders[-1].rate_radps == 0.0
    assert abs(world.clock.stand.nodes.drives()[2].rate_radps) < 0.05
    assert world.clock.number < 450


def test_ctrl_c_while_it_listens_sends_nothing(world):
    at = {50: lambda _: os.kill(os.getpid(), signal.SIGINT)}
    got = world.run("jog", "--wheel", "3", "--rate", "1", "--yes", at=at)
    assert got.exit_code == 130 and world.clock.heard == []


def test_a_refusal_is_one_line_and_exit_69(world):
    got = world.run("jog", "--wheel", "1", "--rate", "1", "--yes", faults=["stop=IMU"])
    assert got.exit_code == 69
    assert got.stderr == (
        "onboard: refused, nothing was sent: IMU asserts an EMERGENCY_STOP (BUTTON): "
        "find out why, then `onboard can reset`\n"
    )
    assert world.clock.heard == []


@pytest.mark.parametrize(("words", "told"), [
    ((), "one movement at a time: --wheel N --rate W, --wheel N --steer A, or --tilt A"),
    (("--wheel", "1"), "one movement at a time"),
    (("--rate", "1"), "one movement at a time"),
    (("--wheel", "1", "--rate", "1", "--steer", "1"), "one movement at a time"),
    (("--wheel", "1", "--tilt", "1"), "one movement at a time"),
    (("--wheel", "1", "--rate", "3"), "--rate 3 should be within -2 and 2 rad/s"),
])  # fmt: skip
def test_what_may_not_be_asked_is_one_line_and_exit_64(world, words, told):
    got = world.run("jog", *words)
    assert got.exit_code == 64 and got.stderr.startswith(f"onboard: {told}")
    assert world.clock.number == 0


def test_reset_releases_every_node_and_the_wheel_turns_again(anywhere):
    stand = faulty(Stand(), ["stop=IMU"])
    got = anywhere.run("reset", "--yes", stand=stand)
    assert (got.exit_code, got.stdout) == (0, "released: WHEEL_1, WHEEL_2, WHEEL_3, WHEEL_4, TILT, IMU, POWER\n")
    assert not any(node.latched for node in stand.nodes.all)
    steps = [TABLE[0x020].decode(f.data) for f in anywhere.clock.heard if f.can_id == 0x020]
    assert [v.step for v in steps] == sorted(v.step for v in steps) and len({v.nonce for v in steps}) == 1


def test_reset_names_who_does_not_let_go_and_refuses_where_nothing_is_stopped(world):
    stand = faulty(Stand(), ["stop=TILT"])
    stand.by_name["WHEEL_4"]._reset = lambda nonce, step: None
    got = world.run("reset", "--yes", stand=stand)
    assert got.exit_code == 1 and "WHEEL_4" in got.stderr and "did not let go" in got.stderr
    got = world.run("reset", "--yes")
    assert got.exit_code == 69 and "no node is stopped: there is nothing to release" in got.stderr
    assert world.clock.heard == []


def test_a_bus_that_goes_away_is_one_line(monkeypatch):
    end = HubEnd()
    with handlers_kept():
        world = World(end, monkeypatch)
        got = world.run("jog", "--wheel", "1", "--rate", "1", "--yes", at={60: lambda _: end.hub.disconnect(0)})
    end.close()
    assert got.exit_code == 69 and "is gone: its server has ended" in got.stderr
