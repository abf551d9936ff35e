"""Programs that exist, against the gateway's real sockets: pymavlink's own connection, and MAVProxy without a window.

pymavlink runs in this thread, in virtual time. MAVProxy is a process of its own with clocks of its own: the bed then
goes on by a tick whenever its sockets have waited for one.
"""

import hashlib
import math
import os
import select
import shutil
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from ground.gateway.clients import Door
from ground.gateway.frames import mavlink as m
from ground.gateway.origin import e7
from ground.gateway.shell import GatewayShell, Marks
from ground.gateway.signing import Verifier
from ground.station.station import StationError
from protocol.tables.modes import Mode
from tests.ground.gateway_bed import NOON, OPEN, ORIGIN, Bed

ROOT = Path(__file__).parents[3]
CLIENTS = ROOT / "build" / "clients"
ARM, GOTO = m.MAV_CMD_COMPONENT_ARM_DISARM, m.MAV_CMD_DO_REPOSITION
KEY = hashlib.sha256(b"a key").digest()
GOALS = ((4.0, 0.0), (8.0, 3.0))
TICK_S = 0.01


class UdpBed(Bed):
    """The bed with the gateway's real sockets; `clients` are called once a turn."""

    def __init__(self, stack: ExitStack, door: Door = OPEN, marks: Marks | None = None, **options) -> None:
        super().__init__(door, **options)
        self.shell = stack.enter_context(GatewayShell(self.gateway, marks, lambda: self.stamp))
        self.port = self.shell.open(door, ("127.0.0.1", 0))[1]
        self.pumps: list = []

    def turn(self) -> None:
        self.shell.turn(self.arrived(), self.now_ns)
        for datagram in self.session.send(self.now_ns):
            self._fly("up", datagram)
        for pump in self.pumps:
            pump()


class Connection:
    """mavutil's connection, polled by the bed; keeps every message."""

    def __init__(self, bed: UdpBed, monkeypatch, key: bytes | None = None) -> None:
        monkeypatch.setenv("MAVLINK20", "1")
        from pymavlink import mavutil

        mavutil.set_dialect("common")
        self.bed = bed
        self.conn = mavutil.mavlink_connection(f"udpout:127.0.0.1:{bed.port}", source_system=255, dialect="common")
        if key is not None:
            self.conn.setup_signing(key, initial_timestamp=NOON)
        self.got: list = []
        bed.pumps.append(self._pump)
        self._beats = 0

    def _pump(self) -> None:
        if self.bed.now_ns // 1_000_000_000 >= self._beats:
            self._beats += 1
            self.conn.mav.heartbeat_send(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        while (message := self.conn.recv_msg()) is not None:
            self.got.append(message)

    def all(self, kind: str) -> list:
        return [message for message in self.got if message.get_type() == kind]

    def results(self, command: int) -> list[int]:
        return [ack.result for ack in self.all("COMMAND_ACK") if ack.command == command]


@pytest.fixture
def stack():
    with ExitStack() as stack:
        yield stack


def connected(stack, monkeypatch, bed: UdpBed, key: bytes | None = None) -> Connection:
    client = Connection(bed, monkeypatch, key)
    stack.callback(client.conn.close)
    bed.until(lambda: client.all("HEARTBEAT") and client.all("GLOBAL_POSITION_INT"))
    return client


# -- pymavlink --------------------------------------------------------------------------------------------------


def test_pymavlink_sees_the_rover_lists_and_sets_a_parameter(stack, monkeypatch):
    bed = UdpBed(stack)
    client = connected(stack, monkeypatch, bed)
    conn = client.conn
    assert (conn.target_system, conn.mav_type) == (1, m.MAV_TYPE_GROUND_ROVER)
    conn.param_fetch_all()
    bed.until(lambda: client.all("PARAM_VALUE") and len(conn.params) == client.all("PARAM_VALUE")[0].param_count)
    assert conn.params["MOT_CRUISE_MPS"] == pytest.approx(bed.rover.settings.config.motion.cruise_mps, rel=1e-6)
    conn.param_set_send("MOT_CRUISE_MPS", 0.09)
    bed.until(lambda: conn.params["MOT_CRUISE_MPS"] == pytest.approx(0.09))
    assert bed.rover.settings.config.motion.cruise_mps == 0.09


def test_pymavlink_arms_uploads_starts_and_disarms(stack, monkeypatch):
    bed = UdpBed(stack, drive_s=20.0)
    client = connected(stack, monkeypatch, bed)
    conn = client.conn
    conn.arducopter_arm()
    bed.until(conn.motors_armed)
    conn.waypoint_count_send(len(GOALS))
    answered = 0
    while not client.all("MISSION_ACK"):
        bed.step()
        for request in client.all("MISSION_REQUEST_INT")[answered:]:
            answered += 1
            lat, lon, height_m = ORIGIN.globe(*GOALS[request.seq], 0.0)
            conn.mav.mission_item_int_send(
                1,
                1,
                request.seq,
                m.MAV_FRAME_GLOBAL_INT,
                m.MAV_CMD_NAV_WAYPOINT,
                0,
                1,
                0,
                0,
                0,
                math.nan,
                e7(lat),
                e7(lon),
                height_m,
            )
    assert client.all("MISSION_ACK")[0].type == m.MAV_MISSION_ACCEPTED
    conn.mav.command_long_send(1, 1, m.MAV_CMD_MISSION_START, 0, 0, 1, 0, 0, 0, 0, 0)
    bed.until(lambda: client.results(m.MAV_CMD_MISSION_START)[-1:] == [m.MAV_RESULT_ACCEPTED])
    assert bed.rover.mode is Mode.AUTONOMOUS
    conn.arducopter_disarm()
    bed.until(lambda: not conn.motors_armed())
    assert bed.rover.executed == ["mission", "stop"]
    assert bed.rover.mode is Mode.STANDBY


def test_over_a_lunar_delay_a_stale_acknowledgement_confirms_no_other_command(stack, monkeypatch):
    bed = UdpBed(stack, delay_s=1.3, drive_s=60.0)
    client = connected(stack, monkeypatch, bed)
    client.conn.arducopter_arm()
    bed.until(client.conn.motors_armed)
    for n, x_m in enumerate((5.0, 6.0)):
        lat, lon, _ = ORIGIN.globe(x_m, 0.0, 0.0)
        client.conn.mav.command_int_send(
            1, 1, m.MAV_FRAME_GLOBAL_INT, GOTO, 0, 0, -1, 0, 0, math.nan, e7(lat), e7(lon), 0
        )
        bed.step(0.3 + n)
    accepted = []
    while len(accepted) < 2:
        bed.step(0.05)
        accepted = [r for r in client.results(GOTO) if r == m.MAV_RESULT_ACCEPTED]
        begun = [round(a["x_m"]) for name, a in bed.rover.orders if name == "goto"]
        assert len(accepted) <= len(begun)
        assert begun == [5, 6][: len(begun)]


def test_pymavlink_flies_by_the_signed_door_and_an_unsigned_one_gets_no_answer(stack, monkeypatch, tmp_path):
    marks = Marks(tmp_path / "gateway-signing.json")
    bed = UdpBed(stack, Door("signed", Verifier(KEY), KEY), marks)
    client = connected(stack, monkeypatch, bed, KEY)
    client.conn.mav.command_long_send(1, 1, ARM, 0, 0, 0, 0, 0, 0, 0, 0)
    bed.until(lambda: m.MAV_RESULT_ACCEPTED in client.results(ARM))
    assert bed.rover.executed == ["stop"]
    assert list(marks.read()) == ["0/255/0"]
    stranger = Connection(bed, monkeypatch)
    stack.callback(stranger.conn.close)
    stranger.conn.mav.command_long_send(1, 1, m.MAV_CMD_USER_1, 0, 0, 0, 0, 0, 0, 0, 0)
    bed.step(3.0)
    assert stranger.got == []
    assert bed.rover.executed == ["stop"]
    assert bed.gateway.clients.counts["unsigned"] >= 2


def test_a_port_that_is_taken_is_one_clear_line(stack):
    bed = UdpBed(stack)
    with pytest.raises(StationError, match=rf"UDP 127.0.0.1:{bed.port}: .*; name another port"):
        GatewayShell(bed.gateway).open(Door("unsigned"), ("127.0.0.1", bed.port))


def test_a_client_named_at_the_start_is_told_of_the_rover_without_a_word(stack, monkeypatch):
    monkeypatch.setenv("MAVLINK20", "1")
    from pymavlink import mavutil

    listening = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="common")
    stack.callback(listening.close)
    bed = UdpBed(stack)
    bed.gateway.clients.know(bed.door, ("127.0.0.1", listening.port.getsockname()[1]))
    got = []
    bed.pumps.append(lambda: got.extend(filter(None, [listening.recv_msg()])))
    bed.until(lambda: any(message.get_type() == "HEARTBEAT" for message in got))
    listening.mav.command_long_send(1, 1, m.MAV_CMD_USER_1, 0, 0, 0, 0, 0, 0, 0, 0)
    bed.until(lambda: bed.rover.mode is Mode.SAFE)


# -- MAVProxy ---------------------------------------------------------------------------------------------------


def _mavproxy() -> list[str] | None:
    script = CLIENTS / "bin" / "mavproxy.py"
    if script.exists():
        return [sys.executable, str(script)]
    found = shutil.which("mavproxy.py")
    return [found] if found else None


class MavProxy:
    """The process, its words, and lines typed into it."""

    def __init__(self, stack: ExitStack, bed: UdpBed, folder: Path) -> None:
        env = {**os.environ, "PYTHONUNBUFFERED": "1", "HOME": str(folder)}
        if CLIENTS.exists():
            env["PYTHONPATH"] = str(CLIENTS)
        self.run = subprocess.Popen(
            [
                *_mavproxy(),
                f"--master=udpout:127.0.0.1:{bed.port}",
                "--mav20",
                "--dialect=common",
                "--default-modules=param,wp,arm,misc,cmdlong,mode",
                f"--state-basedir={folder}",
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            cwd=folder,
            env=env,
        )
        stack.callback(self._end)
        os.set_blocking(self.run.stdout.fileno(), False)
        self.text = ""
        bed.pumps.append(self._pump)

    def _end(self) -> None:
        self.run.kill()
        self.run.communicate()

    def _pump(self) -> None:
        """A tick of the bed takes at least a tick of the process' own clock, or ends when it speaks."""
        if select.select([self.run.stdout], [], [], TICK_S)[0]:
            self.text += os.read(self.run.stdout.fileno(), 65_536).decode(errors="replace")
        assert self.run.poll() is None, self.text

    def type(self, line: str) -> None:
        self.run.stdin.write(line.encode() + b"\n")
        self.run.stdin.flush()


@pytest.mark.skipif(_mavproxy() is None, reason="MAVProxy is not installed: `make clients` brings it")
def test_mavproxy_lists_sets_uploads_starts_and_stops(stack, tmp_path):
    bed = UdpBed(stack, drive_s=300.0)
    proxy = MavProxy(stack, bed, tmp_path)
    bed.until(lambda: "Received" in proxy.text and "parameters" in proxy.text, 120.0)  # it asks for them by itself
    proxy.type("param set MOT_CRUISE_MPS 0.09")
    bed.until(lambda: bed.rover.settings.config.motion.cruise_mps == 0.09, 60.0)
    proxy.type("arm throttle")
    bed.until(lambda: bed.gateway.desk.enabled, 60.0)
    lines = ["QGC WPL 110"]
    for n, goal in enumerate(GOALS):
        lat, lon, height_m = ORIGIN.globe(*goal, 0.0)
        lines.append(f"{n}\t0\t0\t16\t0\t0\t0\t0\t{lat:.9f}\t{lon:.9f}\t{height_m:.3f}\t1")
    (tmp_path / "goals.txt").write_text("\n".join(lines) + "\n")
    proxy.type("wp load goals.txt")
    bed.until(lambda: len(bed.gateway.missions.goals_m) == 2, 60.0)
    assert bed.gateway.missions.goals_m[1] == pytest.approx(GOALS[1], abs=0.05)
    proxy.type("long MISSION_START 0 1")
    bed.until(lambda: bed.rover.mode is Mode.AUTONOMOUS, 60.0)
    proxy.type("disarm")
    bed.until(lambda: "stop" in bed.rover.executed, 60.0)
    assert [name for name in bed.rover.executed if name != "param_list"] == ["param_set", "mission", "stop"]
    proxy.type("mode HOLD")  # ArduPilot's 4, which is no mode of ours
    bed.until(lambda: "104 ESTOP" in proxy.text, 60.0)
    assert bed.rover.mode is Mode.STANDBY and bed.rover.executed[-1] == "stop"
    proxy.type("long DO_FLIGHTTERMINATION 1")
    bed.until(lambda: bed.rover.mode is Mode.ESTOP, 60.0)
