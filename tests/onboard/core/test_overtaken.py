"""An order that a stop has overtaken on its way does not move the rover: whole ticks, any order of arrival."""

import itertools
import json

import pytest

from onboard.config import Link
from onboard.core.downlink import Downlink
from onboard.core.telemetry import TelemetryInputs
from onboard.drivers.link.saved_state import LinkMemory
from onboard.records import LinkMessage
from protocol.link.datagrams import DatagramKind
from protocol.link.keyring import bench_keys
from protocol.link.transactions import RequestState
from protocol.tables import commands
from protocol.tables.commands import HALTING, Telecommand
from protocol.tables.modes import Mode
from tests.onboard.core_bench import STATION, CoreBench, first_map

DRIVE = {"vx_mps": 0.1, "vy_mps": 0.0, "yaw_radps": 0.0, "duration_s": 5.0, "distance_m": 1.0}
OTHER = STATION + 1


@pytest.fixture(scope="module")
def known():
    return first_map()


def standing(known):
    rover = CoreBench(memory=known)
    rover.settle()
    return rover


def message(request_id, name, issued_ns=0, station=STATION):
    sent = Telecommand(request_id, issued_ns, 0, name, DRIVE if name == "drive" else {})
    return LinkMessage(0, True, "ok", station, DatagramKind.TELECOMMAND, commands.encode(sent))


@pytest.mark.parametrize("halt", HALTING)
def test_whatever_comes_first_the_rover_stands_after_a_stop_that_was_asked_last(known, halt):
    names = {11: "drive", 12: "resume", 13: halt}
    for order in itertools.permutations(names):
        rover = standing(known)
        for request_id in order:
            rover.hear(message(request_id, names[request_id]))
            rover.run(0.2)
        rover.run(2.0)  # what the stop has ended rolls out
        place = list(rover.pose)
        rover.run(1.0)
        assert rover.mode is {"stop": Mode.STANDBY, "safe": Mode.SAFE, "emergency_stop": Mode.ESTOP}[halt]
        assert rover.rates == [0.0] * 4 and rover.pose == place
        if order.index(13) < order.index(11):
            assert rover.states(11)[-1] is RequestState.CANCELLED and place[:2] == [0.0, 0.0]
            assert rover.text(11).startswith(f"asked before the {commands.command(halt).typed} of request 13")


def test_what_is_asked_after_the_stop_moves_the_rover_and_the_same_inputs_make_the_same_bytes(known):
    digests = []
    for _ in range(2):
        rover = standing(known)
        for request_id, name in ((12, "stop"), (11, "drive"), (13, "drive")):
            rover.hear(message(request_id, name))
            rover.run(0.5)
        rover.run(2.0)
        assert rover.mode is Mode.TELEOP and rover.pose[0] > 0.05
        digests.append(rover.digests)
    assert digests[0] == digests[1]


def test_an_order_of_another_station_that_did_not_know_of_the_stop_does_not_move_the_rover(known):
    rover = standing(known)
    rover.hear(message(500, "stop", station=OTHER))
    rover.run(0.5)
    before_ns = rover.now_ns - 600_000_000
    rover.hear(message(11, "drive", before_ns))
    rover.run(0.5)
    assert rover.mode is Mode.STANDBY and f"the stop of station {OTHER} came at" in rover.text(11)
    rover.hear(message(12, "drive", rover.now_ns))
    rover.run(0.5)
    assert rover.mode is Mode.TELEOP


def test_what_halted_before_a_restart_comes_to_the_core_as_a_kept_thing(tmp_path):
    memory = LinkMemory(str(tmp_path), bench_keys(1))
    assert memory.mark(1, 0, 9).result() and memory.mark(1, 1, 7).result()
    kept = json.dumps(LinkMemory(str(tmp_path), bench_keys(1)).halted).encode()
    assert kept == b'{"1": 9}'
    core = Downlink(Link(), kept)
    core.sample(TelemetryInputs(mode=Mode.STANDBY), 0)
    found = [core.receive([message(n, "drive", station=1)], 0) for n in (8, 10)]
    assert [[order.name for order in orders] for orders in found] == [[], ["drive"]]
