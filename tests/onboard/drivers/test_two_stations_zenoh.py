"""Two stations with key files on a real zenoh link to the real core: the lease passes, stop works, a boot is followed.

Rover and stations tick on a clock of the test; only the link between them is real.
"""

import json
from contextlib import ExitStack, contextmanager
from dataclasses import replace

import pytest
import zenoh

from ground.archive.store import Archive
from ground.cli.verbs.keys import write_keys
from ground.station.clock import ClockTurn
from ground.station.settings import StationSettings
from ground.station.station import Station
from hil.processes import free_ports
from onboard import config
from onboard.drivers.link.port import LinkPort, link_keys
from onboard.drivers.link.saved_state import MARKS, LinkMemory
from protocol.link import carrier
from protocol.link.datagrams import KEY_DOWN, KEY_UP
from protocol.tables.modes import Mode
from tests.onboard.core_bench import QUICK, CoreBench

MOST_TICKS = 20_000


@contextmanager
def carried():
    """Rover's and ground's end of a link that loses nothing: two sessions, each side's datagrams put on the other."""
    ends = [f"tcp/127.0.0.1:{port}" for port in free_ports(2)]
    with ExitStack() as stack:
        sessions = []
        for end in ends:
            settings = zenoh.Config()
            for key, text in carrier.settings(listen=end):
                settings.insert_json5(key, text)
            sessions.append(stack.enter_context(zenoh.open(settings)))
        for side, (mine, other), key in ((carrier.ROVER, sessions, KEY_DOWN), (carrier.GROUND, sessions[::-1], KEY_UP)):

            def carry(sample, other=other, key=key):
                other.put(key, sample.payload.to_bytes(), congestion_control=zenoh.CongestionControl.BLOCK)

            def answer(sample, mine=mine, side=side):
                if sample.payload.to_bytes() != carrier.READY:
                    mine.put(carrier.answer_key(side), sample.payload.to_bytes())

            stack.callback(mine.declare_subscriber(key, carry).undeclare)
            stack.callback(mine.declare_subscriber(carrier.question_key(side), answer).undeclare)
        yield ends


class World:
    def __init__(self, tmp_path, stack):
        self._stack, self._rover_end = stack, None
        write_keys(tmp_path / "keys", 2, 3)
        self._rover_end, ground_end = stack.enter_context(carried())
        self.config = config.load(
            overrides={
                "link.command_keys": str(tmp_path / "keys/rover/command.keys"),
                "link.lease_s": 10.0,
                "link.downlink_key": str(tmp_path / "keys/rover/downlink.key"),
                "state.folder": str(tmp_path / "rover"),
                "can.uri": "socketcan:can0",
            }
        )
        self.port = None
        self.boot(1)
        self.stations = {}
        for n in (1, 2):
            folder = tmp_path / "keys" / f"station-{n}"
            settings = StationSettings(
                endpoint=ground_end,
                station=n,
                command_keys=str(folder / "command.key"),
                downlink_key=str(folder / "downlink.key"),
                state=str(tmp_path / f"ground-{n}"),
            )
            archive = stack.enter_context(Archive(":memory:"))
            self.stations[n] = stack.enter_context(Station(settings, archive))
            self.stations[n].wait_open(20.0, 20.0)

    def boot(self, boot_id):
        if self.port is not None:
            self.port.close()
        keys = link_keys(self.config)
        memory = LinkMemory(self.config.state.folder, keys)
        self.port = self._stack.enter_context(LinkPort(self._rover_end, keys, boot_id, memory))
        self.port.wait_open(20.0)
        self.bench = CoreBench(settings=replace(QUICK, link=replace(self.config.link, boot_count=boot_id)))

    def step(self):
        for message in self.port.read(self.bench.now_ns):
            self.bench.hear(message)
        self.bench.saved = (*self.bench.saved, *self.port.collect())
        outputs = self.bench.step()
        self.port.start(outputs.saves)
        self.port.write(outputs.link_payloads)
        for station in self.stations.values():
            station.turn(ClockTurn(self.bench.now_ns, None))
            station.flush(self.bench.now_ns)

    def until(self, condition):
        for _ in range(MOST_TICKS):
            if condition():
                return
            self.step()
        raise AssertionError(f"not within {MOST_TICKS} ticks: {self.bench.events[-4:]}")

    def ask(self, n, name, **arguments):
        return n, self.stations[n].session.request(name, arguments, self.bench.now_ns)

    def outcome(self, asked):
        request = self.stations[asked[0]].session.requester.requests[asked[1]]
        self.until(lambda: request.state.final)
        return request.state.name, request.report.text


@pytest.fixture
def world(tmp_path):
    with ExitStack() as stack:
        yield World(tmp_path, stack)


def test_the_lease_passes_over_a_goto_is_refused_by_name_stop_works_and_a_reboot_is_followed(world, tmp_path):
    assert world.outcome(world.ask(1, "lease_ask")) == ("COMPLETED", "station 1 holds it")
    waiting = world.ask(2, "lease_ask")
    state, text = world.outcome(world.ask(2, "goto", x_m=1.0, y_m=0.0))
    assert state == "FAILED" and text.startswith("goto: station 1 holds the lease")
    assert world.outcome(world.ask(1, "lease_release"))[0] == "COMPLETED"
    assert world.outcome(waiting) == ("COMPLETED", "station 1 released it")
    world.ask(2, "drive", vx_mps=0.1, vy_mps=0.0, yaw_radps=0.0, duration_s=60.0, distance_m=9.0)
    world.until(lambda: world.bench.mode is Mode.TELEOP)
    assert world.outcome(world.ask(1, "stop")) == ("COMPLETED", "stopped")
    assert world.outcome(world.ask(2, "keys_rotate", epoch=1.0))[0] == "COMPLETED"
    marks = json.loads((tmp_path / "rover" / MARKS).read_bytes())
    assert [mark for name, mark in marks.items() if not name.endswith(" asked")] == [0]
    world.boot(2)
    assert world.outcome(world.ask(1, "safe")) == ("COMPLETED", "SAFE")
    assert world.bench.mode is Mode.SAFE
    assert world.outcome(world.ask(1, "resume")) == ("COMPLETED", "STANDBY")
    assert [station.session.kept.epoch for station in world.stations.values()] == [1, 1]
    assert world.port._sealer.epoch == 1
