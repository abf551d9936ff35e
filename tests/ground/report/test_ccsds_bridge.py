"""`ground bridge ccsds`: what it says is read by a library with the XTCE file alone; what it hears is asked.

space_packet_parser shares no code with us and knows nothing of our tables. XTCE 1.2's own schema comes with it.
"""

import json
import math
import socket

import numpy as np
import pytest

from ground.__main__ import run
from ground.ccsds.bridge import Bridge
from ground.ccsds.ports import BridgeShell, Port, parse_address
from ground.link.news import EventHeard, Item, ReportHeard
from ground.link.session import Session
from ground.link.telemetry import TelemetryReceiver, Value
from ground.station.clock import ClockTurn
from ground.station.station import StationError
from onboard.core.telemetry import Packer, TelemetryInputs
from onboard.records import Estimate, Pose, PowerState, WheelState
from protocol.ccsds import packet_table, space_packets
from protocol.ccsds.packet_table import COMMAND_APID, EVENT_APID, NO_PACKET, REPORT_APID
from protocol.link.datagrams import bench_keys
from protocol.link.transactions import Report, RequestState
from protocol.tables.commands import TABLE as COMMANDS
from protocol.tables.commands import check, command, parse
from protocol.tables.modes import Mode, Phase
from protocol.tables.telemetry import MESSAGES
from protocol.tables.telemetry import TABLE as ITEMS
from tests.ground.virtual_station import S, VirtualClock, VirtualStation
from tests.ground.xtce_reader import CommandWriter
from tools.make_docs import DOCS

FILE = DOCS / "eldorado.xtce.xml"


@pytest.fixture(scope="module")
def reader():
    """Packets -> their fields by name, by the committed XTCE file alone."""
    definitions = pytest.importorskip("space_packet_parser.xtce.definitions", reason="space_packet_parser is not there")
    definition = definitions.XtcePacketDefinition.from_xtce(FILE, root_container_name="space_packet")

    def read(packet: bytes) -> dict:
        return dict(definition.parse_bytes(packet))

    return read


@pytest.fixture(scope="module")
def writer():
    return CommandWriter(FILE.read_text())


def bridge() -> Bridge:
    return Bridge(Session(bench_keys(7), 1))


def heard(news, now_ns=0) -> list[bytes]:
    made = bridge()
    made.turn(news, now_ns)
    return made.send()


def onboard_s(fields: dict) -> float:
    assert int(fields["time_p_field"]) == 0x2F
    return int(fields["time_seconds"]) + int(fields["time_fraction"]) / 2**24


def same(read, sent) -> bool:
    return math.isnan(read) if math.isnan(sent) else float(read) == float(sent)


# -- the file --------------------------------------------------------------------------------------------------


def test_the_file_is_what_xtce_1_2_demands():
    validation = pytest.importorskip("space_packet_parser.xtce.validation", reason="space_packet_parser is not there")
    result = validation.validate_xtce(FILE, level="all")
    assert bool(result), str(result)


def test_the_file_has_every_item_and_every_command_with_its_arguments(writer):
    text = FILE.read_text()
    assert all(f'<Parameter name="{row.name}" ' in text for row in ITEMS)
    assert set(writer.commands) == {row.name for row in COMMANDS}


# -- telemetry -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("row", [row for row in packet_table.TABLE if row.apid < EVENT_APID], ids=lambda row: row.name)
def test_a_frame_of_telemetry_is_read_field_by_field_as_it_was_heard(row, reader):
    generator = np.random.default_rng(row.apid)
    values = {field.name: float(generator.normal(0, 100)) for field in row.fields}
    for field in row.fields:
        if field.names is not None:
            values[field.name] = float(sorted(field.names)[-1])
        elif field.form == "u64":
            values[field.name] = 2**63 + 5
    values[row.fields[-1].name] = math.nan if row.fields[-1].form == "f64" else values[row.fields[-1].name]
    news = [Item(5, 12_345_678_000, name, value) for name, value in values.items()]
    (packet,) = heard(news)
    fields = reader(packet)
    assert int(fields["ccsds_apid"]) == row.apid and onboard_s(fields) == pytest.approx(12.345678, abs=31e-9)
    for field in row.fields:
        read = fields[field.name]
        if field.names is not None:
            assert read == field.names[int(values[field.name])]
        else:
            assert same(read, values[field.name]) if field.form == "f64" else int(read) == values[field.name]


def test_everything_that_the_rovers_own_packer_says_comes_through_the_reader(reader):
    """From the samplers over MAVLink and the session to packets: no item is lost, none is another's."""
    covariance = np.diag([0.01, 0.02, 0.03, 1e-4, 1e-4, 1e-4])
    view = TelemetryInputs(
        mode=Mode.AUTONOMOUS,
        phase=Phase.DRIVING,
        estimate=Estimate(Pose(1.5, -2.5, 0.25, 0.1, -0.2, 0.3), covariance, 0.1, 0.02),
        goal_m=(12.0, 3.0),
        stop=7,
        wheels=tuple(WheelState(0.1 * n, 0.0, 0.2 * n, n, 0) for n in range(4)),
        power=PowerState(27.5, 3.25, 0.75, 21.0, 0),
        fault_ids=(5, 63),
        lidar_good=1000,
        job="plan",
        job_ratio=0.5,
    )
    packer, receiver = Packer(), TelemetryReceiver()
    bundle = b"".join(frame for name in MESSAGES for frame in packer.message(name, view, 9 * S))
    news = [Item(1, *one) for one in receiver.receive(bundle, 1) if isinstance(one, Value)]
    packets = [reader(packet) for packet in heard(news)]
    read = {name: value for fields in packets for name, value in fields.items()}
    assert {one.name for one in news} == {row.name for row in ITEMS}
    assert len(packets) == len([row for row in packet_table.TABLE if row.apid < EVENT_APID])
    assert (read["mode"], read["phase"]) == ("AUTONOMOUS", "DRIVING")
    assert int(read["faults"]) == 1 << 63 | 1 << 5
    for one in news:
        if one.name not in ("mode", "phase", "faults"):
            assert same(read[one.name], one.value), one


def test_an_event_is_read_with_its_words_whatever_they_are(reader):
    (packet,) = heard([EventHeard(1, 2_500_000_000, 4_000_000_000, "warning", "FAULT", "Schräglage über 25° an Rad 3")])
    fields = reader(packet)
    assert int(fields["ccsds_apid"]) == EVENT_APID and onboard_s(fields) == 2.5
    assert (int(fields["event_serial"]), fields["event_severity"]) == (4_000_000_000, "warning")
    assert (fields["event_name"], fields["event_text"]) == ("FAULT", "Schräglage über 25° an Rad 3")


def test_a_text_of_the_longest_kind_is_cut_at_a_whole_character_and_stays_readable(reader):
    (packet,) = heard([EventHeard(1, 0, 1, "info", "MODE", "°" * 200)])
    assert reader(packet)["event_text"] == "°" * 56


def test_a_report_is_read_with_state_text_and_numbers(reader):
    report = Report(70_000, 1, 3, RequestState.COMPLETED, 0, "there", (1.5, -2.0))
    (packet,) = heard([ReportHeard(1, "goto", report)])
    fields = reader(packet)
    assert (int(fields["report_request"]), fields["report_command"], fields["report_state"]) == (
        70_000,
        "goto",
        "COMPLETED",
    )
    assert (fields["report_text"], int(fields["report_numbers"])) == ("there", 2)
    assert [float(fields[f"report_number_{n}"]) for n in (0, 1)] == [1.5, -2.0]
    assert math.isnan(fields["report_number_2"])
    assert int(fields["report_packet"]) == NO_PACKET


def test_sequence_counts_rise_by_one_for_each_apid_and_wrap():
    made = bridge()
    for serial in range(1, 16_390):
        made.turn([EventHeard(1, 0, serial, "info", "MODE", "")], 0)
    made.turn([ReportHeard(1, "stop", Report(1, 1, 1, RequestState.ACCEPTED))], 0)
    counts = [(p.apid, p.sequence) for p in map(space_packets.decode, made.send())]
    assert counts[:2] == [(EVENT_APID, 0), (EVENT_APID, 1)]
    assert counts[16_383:16_386] == [(EVENT_APID, 16_383), (EVENT_APID, 0), (EVENT_APID, 1)]
    assert counts[-1] == (REPORT_APID, 0)


def test_a_frame_that_does_not_come_whole_makes_no_packet_and_is_counted():
    made = bridge()
    made.turn([Item(1, 1 * S, "x_m", 1.0), Item(1, 2 * S, "x_m", 2.0), Item(1, 2 * S, "y_m", 2.0)], 0)
    assert made.send() == [] and made.counts["incomplete"] == 1


# -- telecommands ----------------------------------------------------------------------------------------------


class Operation:
    """A bridge on a station with a toy rover, in virtual time."""

    def __init__(self, **rover) -> None:
        self.station = VirtualStation(**rover)
        self.bridge = Bridge(self.station.session)
        self.packets, self._tick = [], 0

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            now_ns = self._tick * 10_000_000
            self.bridge.turn(self.station.turn(ClockTurn(now_ns, None)), now_ns)
            self.station.flush(now_ns)
            self.packets += self.bridge.send()
            self._tick += 1

    def say(self, packet: bytes) -> None:
        self.bridge.receive(packet, self._tick * 10_000_000)


def example(row) -> dict:
    """The arguments of a row's example, as the dictionary reads them."""
    return parse([*row.typed.split(), *row.example.split()])[1]


def as_typed(value):
    return " ".join(repr(float(v)) for v in value) if isinstance(value, tuple) else value


@pytest.mark.parametrize("row", COMMANDS, ids=lambda row: row.name)
def test_every_command_that_the_file_describes_is_asked_as_it_was_meant(row, writer):
    arguments = example(row)
    operation = Operation()
    operation.run(1.0)
    operation.say(writer.packet(row.name, start_s=7.0, **{name: as_typed(v) for name, v in arguments.items()}))
    (request,) = operation.station.session.requester.requests.values()
    assert request.telecommand.name == row.name
    assert request.telecommand.arguments == check(row.name, arguments)
    assert request.telecommand.start_ns == 7 * S
    assert (request.telecommand.expiry_ns > 0) == command(row.name).moves


def test_what_is_left_out_of_a_command_is_left_out_of_the_request(writer):
    operation = Operation()
    operation.run(1.0)
    operation.say(writer.packet("goto", x_m=12, y_m=3))
    operation.say(writer.packet("get", product="ldem"))
    operation.say(writer.packet("fence_clear"))
    asked = [request.telecommand.arguments for request in operation.station.session.requester.requests.values()]
    assert asked == [{"x_m": 12.0, "y_m": 3.0}, {"product": "ldem"}, {}]


def test_a_command_is_carried_out_and_each_report_names_its_packet(writer, reader):
    operation = Operation()
    operation.run(1.0)
    packet = bytearray(writer.packet("goto", x_m=12, y_m=3))
    packet[2:4] = (0xC000 | 77).to_bytes(2, "big")  # sequence count 77, as the other system numbers them
    operation.say(bytes(packet))
    operation.run(6.0)
    fields = [f for f in map(reader, operation.packets) if int(f["ccsds_apid"]) == REPORT_APID]
    assert operation.station.rover.executed == ["goto"]
    assert [f["report_state"] for f in fields][-1] == "COMPLETED"
    assert {int(f["report_packet"]) for f in fields} == {77}
    assert {f["report_command"] for f in fields} == {"goto"}


def test_a_packet_that_is_no_command_is_answered_and_nothing_is_asked(writer, reader):
    operation = Operation()
    operation.run(1.0)
    good = writer.packet("turn", heading_rad=1.0)
    far = bytearray(writer.packet("goto", x_m=12, y_m=3))
    far[15:23] = b"\x7f\xf0" + bytes(6)  # x_m = inf
    other = bytearray(good)
    other[1] ^= 1
    unknown = bytearray(good)
    unknown[6] = 250
    for packet in (good[:-1], good + b"x", b"", b"\xff" * 30, bytes(far), bytes(other), bytes(unknown)):
        operation.say(packet)
    operation.run(0.01)
    fields = [f for f in map(reader, operation.packets) if int(f["ccsds_apid"]) == REPORT_APID]
    assert len(fields) == 7 and {f["report_state"] for f in fields} == {"NOT_SENT"}
    assert all(f["report_text"] for f in fields)
    assert "no command has the id 250" in fields[-1]["report_text"]
    assert not operation.station.session.requester.requests


def test_before_the_rover_is_heard_a_command_is_not_kept_for_later(writer, reader):
    operation = Operation(silent=((0.0, 100.0),))
    operation.run(0.1)
    operation.say(writer.packet("stop"))
    operation.run(0.01)
    assert "the rover was not heard yet" in reader(operation.packets[-1])["report_text"]
    assert not operation.station.session.requester.requests


# -- the ports -------------------------------------------------------------------------------------------------

EVENT = EventHeard(1, S, 1, "info", "MODE", "STANDBY -> AUTONOMOUS")


def shell(tm: str, tc: str | None) -> BridgeShell:
    return BridgeShell(bridge(), parse_address(tm), None if tc is None else parse_address(tc))


def test_over_udp_a_datagram_is_a_packet_both_ways(writer, reader):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as yamcs:
        yamcs.settimeout(10.0)
        yamcs.bind(("127.0.0.1", 0))
        with shell(f"udp:127.0.0.1:{yamcs.getsockname()[1]}", "udp:127.0.0.1:0") as ports:
            ports.turn([EVENT], 0)
            assert reader(yamcs.recv(2000))["event_text"] == EVENT.text
            yamcs.sendto(writer.packet("stop"), ports.telecommands.bound)
            answer = b""
            for _ in range(2000):  # loopback has it at once; the bound is of this test
                ports.turn([], 0)
                yamcs.setblocking(False)
                try:
                    answer = yamcs.recv(2000)
                    break
                except BlockingIOError:
                    continue
    assert "not heard yet" in reader(answer)["report_text"]


def test_over_tcp_packets_follow_each_other_and_a_client_that_speaks_something_else_is_hung_up_on(writer, reader):
    with (
        shell("tcp:127.0.0.1:0", "tcp:127.0.0.1:0") as ports,
        socket.create_connection(ports.telemetry.bound, 10.0) as down,
        socket.create_connection(ports.telecommands.bound, 10.0) as up,
        socket.create_connection(ports.telecommands.bound, 10.0) as stranger,
    ):
        splitter, found = space_packets.Splitter(), []
        up.sendall(writer.packet("stop") + writer.packet("safe")[:9])
        up.sendall(writer.packet("safe")[9:])
        stranger.sendall(b"GET / HTTP/1.1\r\n\r\n")
        down.settimeout(0.01)
        for _ in range(1000):
            ports.turn([EVENT], 0)
            try:
                found += splitter.receive(down.recv(65_536))
            except TimeoutError:
                continue
            told = [f for f in map(reader, found) if int(f["ccsds_apid"]) == REPORT_APID]
            if len(told) == 2 and ports.telecommands.damaged:
                break
        stranger.settimeout(10.0)
        assert stranger.recv(10) == b""  # hung up
    assert ["stop" in f["report_text"] for f in told] == [True, False]
    assert ["safe" in f["report_text"] for f in told] == [False, True]


@pytest.mark.parametrize("error", [BlockingIOError, ConnectionAbortedError, OSError(24, "Too many open files")])
def test_a_client_that_cannot_be_accepted_ends_no_bridge(error):
    class Listener:
        def accept(self):
            raise error

    port = Port(parse_address("tcp:127.0.0.1:0"), listen=True)
    port.close()
    port._at = Listener()
    assert port.read() == []


def test_a_port_that_is_taken_is_one_line():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(StationError, match="name another port"):
            shell("udp:127.0.0.1:9", f"udp:127.0.0.1:{taken.getsockname()[1]}")


@pytest.mark.parametrize("text", ["127.0.0.1:1", "udp:localhost:1", "udp:127.0.0.1:99999", "tcp:127.0.0.1", "sctp:1:1"])
def test_an_address_that_is_none_is_said_with_what_is_allowed(text):
    with pytest.raises(ValueError, match=r"should be like udp:127\.0\.0\.1:10015"):
        parse_address(text)


# -- the command -----------------------------------------------------------------------------------------------


def test_the_command_says_what_it_heard_and_sent_and_ends_with_the_carrier(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ground.toml").write_text("bench_seed = 7\n")
    monkeypatch.setattr("ground.cli.operations.operate.Station", lambda *_: VirtualStation(closed_s=4.0))
    monkeypatch.setattr("ground.cli.operations.operate.WallClock", VirtualClock)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as yamcs:
        yamcs.bind(("127.0.0.1", 0))
        code = run(["bridge", "ccsds", "--tm", f"udp:127.0.0.1:{yamcs.getsockname()[1]}", "--tc", "none", "--json"])
        yamcs.setblocking(False)
        packets = [space_packets.decode(yamcs.recv(2000)) for _ in range(10)]
    streams = capsys.readouterr()
    assert code == 69 and "the link's carrier has closed" in streams.err
    assert "packets: " in streams.err and " sent" in streams.err
    assert all(json.loads(line) for line in streams.out.splitlines())
    assert {packet.apid for packet in packets} <= set(packet_table.BY_APID)
    assert COMMAND_APID not in packet_table.BY_APID


@pytest.mark.parametrize(("argv", "part"), [
    (["--tm", "nowhere"], "nowhere should be like udp:"),
    (["--tc", "udp:0.0.0.0:10025"], "whoever reaches this port commands the rover"),
])  # fmt: skip
def test_a_wrong_bridge_is_one_line_and_exit_code_64(capsys, argv, part):
    assert run(["bridge", "ccsds", *argv]) == 64
    told = capsys.readouterr().err
    assert part in told and told.count("\n") == 1


def test_the_file_is_written_for_who_has_the_program_alone(tmp_path, capsys):
    out = tmp_path / "e.xml"
    assert run(["bridge", "ccsds", "--write-xtce", str(out)]) == 0
    assert out.read_text() == FILE.read_text()
    assert "e.xml written" in capsys.readouterr().err
