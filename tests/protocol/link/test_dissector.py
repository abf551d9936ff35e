"""The Wireshark dissector: current, and what tshark reads by it is what our own decoders read."""

import json
import math
import shutil
import struct
import subprocess

import pytest

from ground.gateway.frames import mavlink as m
from protocol.generated import eldorado_dialect as dialect
from protocol.link import bulk, bulk_wire, events, transactions
from protocol.link.datagrams import DOWNLINK_KEY_ID, DatagramKind, Sealer
from protocol.tables import commands
from tools import make_dissector

TSHARK = shutil.which("tshark")
needs_tshark = pytest.mark.skipif(TSHARK is None, reason="tshark is not installed (Debian: apt install tshark)")
USER0, RAW_IP = 147, 101
TYPED = {"goto": {"x_m": 1.5, "y_m": -2.0}}


def pcap(packets: list[bytes], link_type: int) -> bytes:
    """A capture file: the classic format, one packet a second."""
    out = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65_535, link_type)
    for second, packet in enumerate(packets):
        out += struct.pack("<IIII", second, 0, len(packet), len(packet)) + packet
    return out


def udp(payload: bytes, port: int) -> bytes:
    """An IPv4 datagram of loopback; the checksums are left 0."""
    head = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 28 + len(payload), 1, 0, 64, 17, 0, b"\x7f\0\0\1", b"\x7f\0\0\1")
    return head + struct.pack(">HHHH", 40_000, port, 8 + len(payload), 0) + payload


def read(tmp_path, packets: list[bytes], link_type: int = USER0) -> list[dict]:
    """Per packet: each field of ours or of MAVLink's by name, with all its values as tshark shows them."""
    file = tmp_path / "capture.pcap"
    file.write_bytes(pcap(packets, link_type))
    done = subprocess.run(
        [TSHARK, "-r", file, "-X", f"lua_script:{make_dissector.TARGET}", "-T", "ek"],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert "Lua" not in done.stderr.replace("lua_script", ""), done.stderr
    found = []
    for line in done.stdout.splitlines():
        tree = json.loads(line)
        if "layers" in tree:
            flat: dict[str, list] = {}
            _flatten(tree["layers"], flat)
            found.append(flat)
    assert len(found) == len(packets)
    return found


def _flatten(tree, into: dict[str, list]) -> None:
    for key, value in tree.items() if isinstance(tree, dict) else ():
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, dict):
                _flatten(one, into)
            else:
                into.setdefault(key, []).append(one)


def one(fields: dict[str, list], name: str) -> str:
    hits = [values for key, values in fields.items() if key.endswith(name.replace(".", "_"))]
    assert hits, (name, sorted(fields))
    return hits[0][0]


def up(kind: DatagramKind, payload: bytes, counter: int = 77) -> bytes:
    return Sealer(b"k" * 32, 2, 5, counter).seal(kind, payload)


def down(kind: DatagramKind, payload: bytes) -> bytes:
    return Sealer(b"k" * 32, DOWNLINK_KEY_ID, 5, 1 << 33).seal(kind, payload)


def test_the_committed_dissector_is_what_the_tables_make():
    assert make_dissector.TARGET.read_text() == make_dissector.generate(), "run `make codec`"


def test_a_struct_with_an_unnamed_field_stops_the_generator(monkeypatch):
    rows = {**make_dissector.STRUCTS, "chunk": (bulk_wire.CHUNK, ("object_id", "serial"))}
    monkeypatch.setattr(make_dissector, "STRUCTS", rows)
    with pytest.raises(RuntimeError, match="chunk: <IIH has 3 fields, 2 are named"):
        make_dissector.generate()


@needs_tshark
def test_the_header_and_every_command_are_read_as_they_were_sent(tmp_path):
    sent, packets = [], []
    for n, row in enumerate(commands.TABLE):
        arguments = TYPED.get(row.name) or commands.parse([*row.typed.split(), *row.example.split()])[1]
        sent.append((row, arguments))
        packets.append(
            up(
                DatagramKind.TELECOMMAND,
                commands.encode(commands.Telecommand(900 + n, 11, 13, row.name, arguments, 17)),
                1000 + n,
            )
        )
    for n, (fields, (row, arguments)) in enumerate(zip(read(tmp_path, packets), sent)):
        assert [one(fields, f"eldorado.header.{name}") for name in ("kind", "key_id", "counter", "boot_id")] == [
            "4",
            "2",
            str(1000 + n),
            "5",
        ]
        assert one(fields, "eldorado.telecommand.request_id") == str(900 + n)
        assert one(fields, "eldorado.telecommand.command") == str(row.id)
        assert [one(fields, f"telecommand.{name}_ns") for name in ("issued", "expiry", "start")] == ["11", "13", "17"]
        told = [v for key, values in fields.items() if key.endswith("telecommand_argument") for v in values]
        assert [line.split(" = ")[0] for line in told] == [a.name for a in row.arguments]
        for line, argument in zip(told, row.arguments):
            _is(line.split(" = ")[1], arguments.get(argument.name), argument.unit)
        assert not [key for key in fields if key.endswith("eldorado_bad")]


def _is(told: str, value, unit: str) -> None:
    if value is None:
        assert told == "left out"
    elif isinstance(value, str):
        assert told == value
    elif isinstance(value, tuple):
        assert [float(word) for word in told.removesuffix(unit).split()] == pytest.approx(list(value))
    else:
        assert float(told.removesuffix(unit)) == pytest.approx(value)


@needs_tshark
def test_reports_chunks_bitmaps_and_acknowledgements_are_read(tmp_path):
    report = transactions.Report(41, 2, 3, transactions.RequestState.FAILED, 2, "kein Weg – no way", (1.5, -2.0))
    sender, receiver = bulk.Sender(600), bulk.Receiver(600)
    sender.offer("ldem", bytes(range(256)) * 8, "ldem1", 0)
    chunks = sender.send(0, 1e6)
    for chunk in chunks[:3]:
        receiver.receive(chunk, 0)
    bitmap = receiver.send(1_000_000_000)[0]
    heard = events.EventReceiver()
    for serial in (1, 2, 5):
        heard.receive(serial)
    packets = [
        down(DatagramKind.REPORT, transactions.encode_report(report)),
        *(down(DatagramKind.BULK_CHUNK, chunk) for chunk in chunks[:2]),
        up(DatagramKind.BULK_BITMAP, bitmap),
        up(DatagramKind.REPORT, heard.send(0)[0]),
    ]
    told = read(tmp_path, packets)
    assert [one(told[0], f"report.{name}") for name in ("request_id", "station", "state", "code", "text")] == [
        "41",
        "2",
        "6",
        "2",
        report.text,
    ]
    values = next(values for key, values in told[0].items() if key.endswith("report_value"))
    assert [float(v) for v in values] == [1.5, -2.0]
    assert one(told[0], "header.counter") == str(1 << 33)
    assert (one(told[1], "announcement.name"), one(told[1], "announcement.codec")) == ("ldem", "ldem1")
    assert one(told[1], "announcement.length") == "2048"
    assert one(told[2], "chunk.index") == "0"
    assert one(told[2], "eldorado.data").replace(":", "") == chunks[1][10:].hex()
    assert one(told[3], "bitmap.object_id") == one(told[2], "chunk.object_id")
    assert one(told[4], "acknowledgement.base") == "2"
    assert one(told[4], "eldorado.bits").replace(":", "") == "04"


@needs_tshark
def test_a_bundle_of_the_rover_s_messages_is_read_message_by_message(tmp_path):
    writer = dialect.MAVLink(None)
    bundle = b"".join(
        message.pack(writer)
        for message in (
            writer.rover_state_encode(1234, 0, 1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 4, 2, 1),
            writer.local_position_ned_encode(1234, 3.0, 12.0, -0.5, 0.0, 0.0, 0.0),
            writer.event_encode(5_000_000, 9, 4, b"HAZARD", b"a hole ahead"),
        )
    )
    fields = read(tmp_path, [down(DatagramKind.MAVLINK, bundle)])[0]
    assert float(one(fields, "ROVER_STATE_goal_north")) == 2.0
    assert float(one(fields, "LOCAL_POSITION_NED_y")) == 12.0
    assert one(fields, "EVENT_serial") == "9"
    assert one(fields, "EVENT_text").rstrip("\0") == "a hole ahead"


@needs_tshark
def test_the_gateway_s_port_is_read_as_mavlink(tmp_path):
    writer = m.MAVLink(None, srcSystem=255, srcComponent=190)
    goto = m.MAVLink_command_long_message(1, 1, m.MAV_CMD_DO_REPOSITION, 0, -1, 0, 0, math.nan, 38.25, 140.5, 1)
    ack = m.MAVLink_command_ack_message(m.MAV_CMD_DO_REPOSITION, m.MAV_RESULT_IN_PROGRESS, 255, 0, 255, 190)
    told = read(tmp_path, [udp(goto.pack(writer), 14551), udp(ack.pack(writer), 14551)], RAW_IP)
    assert one(told[0], "COMMAND_LONG_command") == str(m.MAV_CMD_DO_REPOSITION)
    assert float(one(told[0], "param5")) == 38.25
    assert one(told[1], "COMMAND_ACK_result") == str(m.MAV_RESULT_IN_PROGRESS)


@needs_tshark
def test_what_is_cut_off_is_named_and_nothing_fails(tmp_path):
    whole = up(
        DatagramKind.TELECOMMAND, commands.encode(commands.Telecommand(1, 0, 0, "goto", {"x_m": 1.0, "y_m": 2.0}))
    )
    bodies = [whole[:n] for n in range(1, len(whole))]
    told = read(tmp_path, bodies)
    assert all(any(key.endswith("eldorado_bad") for key in fields) for fields in told)
