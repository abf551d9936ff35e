"""Space packets and the time code: literal bytes, another library's reading of the header, damage."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError
from protocol.ccsds.packet_table import COMMAND_APID, CommandPacket, decode_command, fields_of
from protocol.ccsds.space_packets import (
    MOST_BYTES,
    P_FIELD,
    TELECOMMAND,
    TELEMETRY,
    Packet,
    Splitter,
    decode,
    encode,
    stamp,
)
from protocol.tables.commands import TABLE as COMMANDS
from tests.protocol.wire import bytewise, whole

S = 1_000_000_000
packets = st.builds(
    Packet,
    st.integers(0, 1),
    st.integers(0, 0x7FF),
    st.integers(0, 0x3FFF),
    st.binary(min_size=1, max_size=300),
    st.booleans(),
)


def test_a_header_is_laid_out_as_133_0_b_has_it():
    made = encode(Packet(TELECOMMAND, 0x0C8, 5, b"\xaa\xbb", secondary=True))
    assert made.hex() == "18c8" + "c005" + "0001" + "aabb"


@given(packets)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_another_library_reads_the_same_header(packet):
    ccsds = pytest.importorskip("space_packet_parser.generators.ccsds", reason="space_packet_parser is not there")
    read = ccsds.CCSDSPacketBytes(encode(packet))
    assert (read.version_number, read.type, read.secondary_header_flag) == (0, packet.kind, packet.secondary)
    assert (read.apid, read.sequence_flags, read.sequence_count) == (packet.apid, 3, packet.sequence)
    assert (read.data_length, bytes(read.user_data)) == (len(packet.data) - 1, packet.data)


@given(packets)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_a_packet_comes_back(packet):
    assert decode(encode(packet)) == packet


def test_the_longest_packet_is_the_longest():
    assert len(encode(Packet(TELEMETRY, 1, 0, bytes(65_536)))) == MOST_BYTES
    for data in (b"", bytes(65_537)):
        with pytest.raises(ValueError, match="B of data"):
            encode(Packet(TELEMETRY, 1, 0, data))


@pytest.mark.parametrize(("onboard_ns", "fields"), [
    (0, "2f 00000000 000000"), (S, "2f 00000001 000000"), (3 * S // 2, "2f 00000001 800000"),
    (S - 1, "2f 00000001 000000"),  # rounded to the nearest 60 ns, into the next second
    (258 * S + 250_000_000, "2f 00000102 400000"),
])  # fmt: skip
def test_a_time_is_a_cuc_of_4_and_3_octets_with_its_p_field(onboard_ns, fields):
    assert P_FIELD == 0x2F
    assert stamp(onboard_ns, 7) == bytes.fromhex(fields) + struct.pack(">I", 7)


@given(st.integers(0, 2**32 * S - S))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_a_time_is_at_most_30_ns_off(onboard_ns):
    made = stamp(onboard_ns, 1)
    seconds, fraction = int.from_bytes(made[1:5], "big"), int.from_bytes(made[5:8], "big")
    assert abs((seconds * 2**24 + fraction) * S - onboard_ns * 2**24) <= 30 * 2**24


@pytest.mark.parametrize("feed", [whole, bytewise])
def test_packets_are_cut_out_of_a_stream_however_it_comes(feed):
    sent = [encode(Packet(TELEMETRY, n, n, bytes([n]) * (n + 1))) for n in range(5)]
    splitter = Splitter()
    assert [packet for piece in feed(b"".join(sent)) for packet in splitter.receive(piece)] == sent


def test_a_stream_of_something_else_is_an_error():
    with pytest.raises(WireError, match="version"):
        Splitter().receive(b"GET / HTTP/1.1\r\n")


@given(st.binary(max_size=60))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_any_bytes_are_a_packet_or_a_clear_error(noise):
    try:
        decode(noise)
    except WireError as error:
        assert error.kind == "packet"


@given(st.sampled_from(COMMANDS), st.data())
@settings(max_examples=200, deadline=None, derandomize=True)
def test_any_content_of_a_telecommand_is_something_asked_or_a_clear_error(row, data):
    size = sum(field.bits for field in fields_of(row)) // 8
    content = bytes([row.id]) + bytes(8) + data.draw(st.binary(min_size=size - 9, max_size=size - 9))
    cut = data.draw(st.integers(0, size))
    for bad in (content, content[:cut], content + b"x"):
        try:
            assert isinstance(decode_command(bad), CommandPacket)
        except WireError as error:
            assert error.kind == "packet"
    assert 0 < COMMAND_APID < 0x7FF  # 2047 is the idle packet's
