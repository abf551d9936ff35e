"""CAN frames: generated codec against cantools, checksum against its published check value, guard, load of the bus."""

from pathlib import Path

import cantools
import crccheck
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.records import Frame
from protocol import WireError
from protocol.can_codec import TABLE, TiltMode
from protocol.can_guard import Guard, Sender, crc8
from tools import can_load, make_can_codec

ROOT = Path(__file__).resolve().parent.parent.parent
DBC = cantools.database.load_file(ROOT / "protocol" / "rover.dbc")
MESSAGES = sorted(DBC.messages, key=lambda m: m.frame_id)
WHEEL = 0x101


def test_committed_codec_is_what_the_generator_writes():
    assert make_can_codec.generate(ROOT / "protocol" / "rover.dbc") == (ROOT / "protocol" / "can_codec.py").read_text()


def test_crc_gives_the_check_value_of_sae_j1850():
    assert crc8(b"123456789") == 0x4B


def test_every_frame_is_protected_and_described():
    for message in MESSAGES:
        by_name = {s.name: s for s in message.signals}
        assert (by_name["counter"].start, by_name["counter"].length) == (52, 4), message.name
        assert (by_name["crc"].start, by_name["crc"].length) == (56, 8), message.name
        assert message.length == 8 and message.comment, message.name
        for signal in message.signals:
            assert signal.byte_order == "little_endian" and signal.minimum < signal.maximum
            assert signal.comment or signal.name in ("counter", "crc"), f"{message.name}.{signal.name}"


def values_of(signal):
    if signal.conversion.scale == 1:
        return st.integers(int(signal.minimum), int(signal.maximum))
    ends = st.sampled_from([signal.minimum, signal.maximum, 0.0])
    return ends | st.floats(signal.minimum, signal.maximum, allow_nan=False)


def expected(message, values, counter):
    """cantools' bytes with the checksum of an independent library."""
    data = bytearray(message.encode({**values, "counter": counter, "crc": 0}))
    data[7] = crccheck.crc.Crc8SaeJ1850.calc(message.frame_id.to_bytes(2, "big") + data[:7])
    return bytes(data)


@pytest.mark.parametrize("message", MESSAGES, ids=lambda m: m.name)
def test_codec_is_bit_equal_to_cantools(message):
    row = TABLE[message.frame_id]
    signals = [s for s in message.signals if s.name in row.fields]

    @settings(max_examples=40, deadline=None, derandomize=True, database=None)
    @given(st.fixed_dictionaries({s.name: values_of(s) for s in signals}), st.integers(0, 15))
    def equal(values, counter):
        data = row.encode(*(values[f] for f in row.fields), counter)
        assert data == expected(message, values, counter)
        theirs = message.decode(data, decode_choices=False)
        assert row.decode(data)._asdict() == {f: theirs[f] for f in row.fields}

    equal()
    for end in ("minimum", "maximum"):
        values = {s.name: getattr(s, end) for s in signals}
        assert row.encode(*(values[f] for f in row.fields), 15) == expected(message, values, 15)


@pytest.mark.parametrize("message", MESSAGES, ids=lambda m: m.name)
def test_a_value_beyond_its_range_is_refused_by_name(message):
    row = TABLE[message.frame_id]
    good = [DBC.get_message_by_name(row.name).get_signal_by_name(f).minimum for f in row.fields]
    for index, field in enumerate(row.fields):
        signal = message.get_signal_by_name(field)
        for bad in (signal.minimum - 1, signal.maximum + 1, float("nan")):
            with pytest.raises(ValueError, match=f"{row.name}.{field} = "):
                row.encode(*good[:index], bad, *good[index + 1 :], 0)


def test_a_raw_value_beyond_its_range_is_a_wire_error():
    data = (3).to_bytes(1, "little") + bytes(7)  # mode 3 does not exist
    with pytest.raises(WireError, match="out_of_range"):
        TABLE[WHEEL].decode(data)
    with pytest.raises(WireError, match="length"):
        TABLE[WHEEL].decode(bytes(7))


def test_value_tables_are_enumerations():
    assert [m.name for m in TiltMode] == ["OFF", "PARK", "SWEEP"]


# -- the guard -------------------------------------------------------------------------------------------------


def frames(count, period_ns=20_000_000):
    sender = Sender()
    return [Frame(WHEEL, sender.encode(WHEEL, 2, 0.1, 1.0), n * period_ns) for n in range(count)]


def test_a_clean_stream_is_accepted_through_the_counter_wrap():
    guard = Guard()
    assert all(guard.accept(f) for f in frames(40))
    assert guard.counts(WHEEL) == guard.total() == (40, 0, 0, 0, 0, 0, 0)


def test_every_burst_of_up_to_eight_bits_is_found():
    good = frames(1)[0]
    whole = int.from_bytes(good.data, "big")
    for length in range(1, 9):
        for at in range(64 - length + 1):
            for inside in range(0, 1 << max(0, length - 2), 7):
                burst = 1 if length == 1 else (1 << (length - 1)) | inside << 1 | 1
                bad = (whole ^ burst << at).to_bytes(8, "big")
                assert not Guard().accept(Frame(WHEEL, bad))


def test_a_frame_under_another_id_is_found():
    guard = Guard()
    assert not guard.accept(Frame(0x102, frames(1)[0].data))
    assert guard.counts(0x102).crc == 1


def test_repeated_lost_and_late_frames_are_counted():
    guard, stream = Guard(), frames(10)
    assert guard.accept(stream[0])
    assert not guard.accept(stream[0])
    assert guard.accept(stream[4])
    counts = guard.counts(WHEEL)
    assert (counts.accepted, counts.repeated, counts.lost, counts.late, counts.bad) == (2, 1, 3, 1, 1)
    assert (guard.bad, guard.lost) == (1, 3)


def test_unknown_ids_short_frames_and_values_out_of_range_are_dropped():
    guard = Guard()
    assert not guard.accept(Frame(0x7FF, bytes(8)))
    assert not guard.accept(Frame(WHEEL, b"\x00"))
    data = bytes([3, 0, 0, 0, 0, 0, 0])
    assert not guard.accept(Frame(WHEEL, data + bytes([crc8(WHEEL.to_bytes(2, "big") + data)])))
    assert guard.bad == guard.total().bad == 2
    assert (guard.unknown, guard.counts(WHEEL).length, guard.counts(WHEEL).out_of_range) == (1, 1, 1)


# -- the load --------------------------------------------------------------------------------------------------


def test_worst_case_load_is_below_forty_percent():
    assert sum(r.load_ratio for r in can_load.analyse(can_load.Case.EVERYTHING)) < 0.40
    assert can_load.worst_bits(8) == 135


@pytest.mark.parametrize("case", [can_load.Case.OPERATION, can_load.Case.EMERGENCY])
def test_every_frame_meets_its_period(case):
    assert all(r.response_s <= r.period_s for r in can_load.analyse(case))


def test_the_computers_stop_is_on_the_wire_within_half_a_millisecond_of_blocking():
    stop = can_load.analyse(can_load.Case.EVERYTHING)[0]
    assert stop.name == "EMERGENCY_STOP_COMPUTER" and stop.response_s == pytest.approx(2 * 270e-6)
