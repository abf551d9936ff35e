"""`hil can`: a stand that does what its nodes are told, and a command that serves it, says what is wrong and ends."""

import json
import os
import signal
import socket
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hil.__main__ import app
from hil.devices.can.command import faulty, serve
from hil.devices.can.hub import CanHub
from hil.devices.can.socket import CanSocket
from hil.devices.can.wheels_off_ground import FAULTS, TICK_NS, Stand
from onboard.config import ConfigError
from onboard.records import Frame
from protocol.can.guard import Guard, Sender
from protocol.generated.can_codec import TABLE, NodeState, WheelMode

ROOT = Path(__file__).parents[3]


def driven(stand, ticks, rate_radps, steer_rad):
    """A stand whose wheel 1 is told so at 50 Hz; all that it sent."""
    sender, frames = Sender(), []
    for n in range(1, ticks + 1):
        heard = [Frame(0x100, sender.encode(0x100, 1, 1))] if n % 10 == 1 else []
        heard += [Frame(0x101, sender.encode(0x101, WheelMode.RUN, steer_rad, rate_radps))] if n % 2 else []
        frames += stand.step(heard, n * TICK_NS)
    return [(frame, TABLE[frame.can_id].decode(frame.data)) for frame in frames if len(frame.data) == 8]


def test_a_wheel_on_the_stand_steers_and_turns_as_it_is_told():
    told = [values for frame, values in driven(Stand(), 300, 0.8, 0.5) if frame.can_id == 0x181]
    assert told[99].steer_rad == pytest.approx(0.5 * 0.98, abs=0.02)  # at 0.5 rad/s
    assert told[-1].steer_rad == pytest.approx(0.5, abs=0.005)
    assert told[-1].rate_radps == pytest.approx(0.8, abs=0.015)
    counts = (told[-1].encoder_count - told[0].encoder_count) % 65536
    assert counts / 4096 * 6.2832 == pytest.approx(0.8 * 2.99 - 0.8**2 / 2, abs=0.02)  # ramp of 1 rad/s^2
    assert told[-1].state == NodeState.RUNNING


def test_frames_of_a_stand_pass_every_check():
    guard = Guard()
    assert all(guard.accept(frame) for frame, _ in driven(Stand(), 200, 0.5, 0.0))


@pytest.mark.parametrize(("fault", "shows"), [
    ("silent=WHEEL_1", lambda rows: not any(frame.can_id == 0x181 for frame, _ in rows)),
    ("foreign=IMU", lambda rows: {v.dbc_version for f, v in rows if f.can_id == 0x306} == {99}),
    ("twice=WHEEL_1", lambda rows: sum(f.can_id == 0x181 for f, _ in rows) == 400),
    ("damaged=WHEEL_1", lambda rows: not all(map(Guard().accept, [f for f, _ in rows if f.can_id == 0x181]))),
    ("stuck=WHEEL_1", lambda rows: abs([v for f, v in rows if f.can_id == 0x181][-1].rate_radps) < 0.02),
    ("reversed=WHEEL_1", lambda rows: [v for f, v in rows if f.can_id == 0x181][-1].rate_radps < -0.4),
    ("stop=TILT", lambda rows: any(f.can_id == 0x015 for f, _ in rows)),
])  # fmt: skip
def test_a_fault_shows_on_the_bus(fault, shows):
    healthy, ill = Stand(), faulty(Stand(), [fault])
    assert shows(driven(ill, 200, 0.5, 0.0)) and not shows(driven(healthy, 200, 0.5, 0.0))


def test_every_fault_is_tried_above_and_one_that_is_none_is_refused():
    assert len(FAULTS) == 7
    for wrong in ("silent", "silent=WHEEL_5", "loud=TILT", "stuck=TILT"):
        with pytest.raises(ConfigError):
            faulty(Stand(), [wrong])


def test_the_server_gives_every_tick_its_frames_even_when_it_is_late():
    hub, ticks = CanHub(), []
    serve(hub, Stand(), lambda now_ns: ticks.append(now_ns) or now_ns < 5 * TICK_NS)
    hub.close()
    assert ticks == [n * TICK_NS for n in range(6)]


def test_a_wrong_fault_is_one_line_and_exit_64_and_a_taken_port_69():
    got = CliRunner().invoke(app, ["can", "--fault", "loud=TILT"])
    assert got.exit_code == 64 and got.stderr.startswith("hil can: --fault 'loud=TILT' should be KIND=NODE")
    hub = CanHub()
    port = hub.uri.rpartition("/")[0].rpartition(":")[2]
    got = CliRunner().invoke(app, ["can", "--port", port])
    hub.close()
    assert got.exit_code == 69
    assert got.stderr == (
        f"hil can: cannot serve port {port}: Address already in use; is another one running? "
        "--port 0 takes a free one\n"
    )


def test_it_tells_its_address_serves_a_client_and_ends_with_ctrl_c():
    words = [sys.executable, "-m", "hil", "can", "--port", "0", "--json"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT, env=environment
    ) as process:
        uri = json.loads(process.stdout.readline())["uri"]
        info = [sys.executable, "-m", "onboard", "can", "info", "--bus", uri, "--seconds", "1.5", "--json"]
        told = subprocess.run(info, capture_output=True, text=True, cwd=ROOT, check=False, timeout=60)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=30)
    report = json.loads(told.stdout)
    assert {node["name"] for node in report["nodes"] if node["beat"]} == {
        "WHEEL_1",
        "WHEEL_2",
        "WHEEL_3",
        "WHEEL_4",
        "TILT",
        "IMU",
        "POWER",
    }
    assert (process.returncode, said) == (0, "hil can: ended by Ctrl-C\n")


class Raw:
    """Stands in for a raw CAN socket where the kernel has none: whole frames, in order, through a pair of sockets."""

    AF_CAN = SOCK_RAW = CAN_RAW = 0

    def __init__(self):
        self._near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)

    def socket(self, *_):
        return self

    def bind(self, address):
        self.bound = address

    def __getattr__(self, name):
        return getattr(self._near, name)


def test_the_stand_serves_an_interface_of_the_kernel_as_it_serves_the_hub(monkeypatch):
    monkeypatch.setattr("hil.devices.can.socket.socket", raw := Raw())
    wire, stand, layout = CanSocket("socketcan:vcan0"), Stand(), struct.Struct("=IB3x8s")
    order = Sender().encode(0x101, WheelMode.HOLD, 0.3, 0.0)
    raw.far.send(layout.pack(0x101, 8, order))
    assert wire.read(7) == [Frame(0x101, order, 7)] and wire.read(8) == [] and wire.received == 1
    raw.far.send(layout.pack(0x101, 8, order))
    serve(wire, stand, lambda now_ns: now_ns < 3 * TICK_NS)
    twin = Stand()
    expected = [frame for n in (1, 2, 3) for frame in twin.step((), n * TICK_NS)]
    got = [layout.unpack(raw.far.recv(16)) for _ in range(wire.sent)]
    assert raw.bound == ("vcan0",) and [can_id for can_id, _, _ in got] == [f.can_id for f in expected]
    assert stand.nodes.wheels[0].drive().steer_rad == pytest.approx(0.3)
    wire.close()
    raw.far.close()
