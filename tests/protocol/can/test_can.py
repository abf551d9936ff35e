"""CAN frames: the DBC against the design, generated codec against cantools, checksum, guard."""

import random
from pathlib import Path

import cantools
import crccheck
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.records import Frame
from protocol import WireError
from protocol.can.guard import Counts, Guard, Sender, crc8
from protocol.generated.can_codec import TABLE, TiltMode
from protocol.generated.can_frames import BITS_PER_S, FRAMES
from tools import make_can_codec, make_can_frames

ROOT = Path(__file__).resolve().parents[3]
DBC = cantools.database.load_file(ROOT / "protocol" / "rover.dbc")
MESSAGES = sorted(DBC.messages, key=lambda m: m.frame_id)
WHEEL = 0x101


@pytest.mark.parametrize("make", [make_can_codec, make_can_frames])
def test_the_committed_module_is_what_the_generator_writes(make):
    name = make.__name__.rpartition("make_")[2] + ".py"
    assert make.generate(ROOT / "protocol" / "rover.dbc") == (ROOT / "protocol" / "generated" / name).read_text()


WHEELS, EVERY = (1, 2, 3, 4), ("COMPUTER", "WHEEL_1", "WHEEL_2", "WHEEL_3", "WHEEL_4", "TILT", "IMU", "POWER", "GUARD")
DEMANDED = {  # id: (name, sender, regular interval in ms, the fast one, whether on events), as the bus was designed
    **{0x010 + n: (f"EMERGENCY_STOP_{name}", name, 100, 0, True) for n, name in enumerate(EVERY[:-1])},
    0x01F: ("EMERGENCY_STOP_GUARD", "GUARD", 100, 0, True),
    0x020: ("RESET_REQUEST", "COMPUTER", 0, 0, True),
    0x080: ("TIME_SYNC", "COMPUTER", 100, 0, False),
    0x100: ("DRIVE_ENABLE", "COMPUTER", 100, 0, False),
    **{0x100 + n: (f"WHEEL_{n}_COMMAND", "COMPUTER", 20, 0, False) for n in WHEELS},
    0x120: ("TILT_COMMAND", "COMPUTER", 100, 0, False),
    **{0x180 + n: (f"WHEEL_{n}_FEEDBACK", f"WHEEL_{n}", 10, 0, False) for n in WHEELS},
    **{0x1A0 + n: (f"WHEEL_{n}_STATUS", f"WHEEL_{n}", 50, 0, False) for n in WHEELS},
    0x1C0: ("TILT_FEEDBACK", "TILT", 100, 5, False),
    0x1D0: ("IMU_GYRO", "IMU", 10, 0, False),
    0x1D1: ("IMU_ACCEL", "IMU", 10, 0, False),
    0x200: ("POWER_STATUS", "POWER", 200, 0, False),
    0x300: ("COMPUTER_HEARTBEAT", "COMPUTER", 100, 0, False),
    **{0x300 + n: (f"NODE_HEARTBEAT_{name}", name, 500, 0, False) for n, name in enumerate(EVERY[1:-1], 1)},
}


def test_the_dbc_has_every_frame_that_the_design_demands_and_no_other():
    found = {
        layout.can_id: (layout.name, layout.sender, layout.cycle_ms, layout.fast_ms, layout.event)
        for layout in FRAMES.values()
    }
    assert found == DEMANDED
    assert {m.frame_id: m.name for m in MESSAGES} == {can_id: row[0] for can_id, row in DEMANDED.items()}
    assert BITS_PER_S == 500_000 and not any(message.is_extended_frame for message in MESSAGES)


@pytest.mark.parametrize("message", MESSAGES, ids=lambda m: m.name)
def test_the_frame_in_words_says_what_cantools_reads(message):
    layout = FRAMES[message.frame_id]
    assert (layout.comment, layout.receivers) == (message.comment, tuple(message.signals[0].receivers))
    for mine, theirs in zip(layout.signals, sorted(message.signals, key=lambda s: s.start), strict=True):
        assert mine[:5] == (theirs.name, theirs.start, theirs.length, theirs.is_signed, theirs.conversion.scale)
        assert (mine.low, mine.high, mine.unit) == (theirs.minimum, theirs.maximum, theirs.unit or "")
        assert dict(enumerate(mine.choices)) == {k: str(v) for k, v in (theirs.choices or {}).items()}


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
def test_any_eight_bytes_decode_as_in_cantools_or_hold_a_value_out_of_its_range(message):
    row = TABLE[message.frame_id]

    @settings(max_examples=40, deadline=None, derandomize=True, database=None)
    @given(st.binary(min_size=8, max_size=8))
    def equal(data):
        theirs = message.decode(data, decode_choices=False)
        wrong = [s.name for s in message.signals if not s.minimum <= theirs[s.name] <= s.maximum]
        try:
            assert row.decode(data)._asdict() == {f: theirs[f] for f in row.fields}
            assert not wrong
        except WireError as error:
            assert wrong and error.kind == "out_of_range"

    equal()


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
    assert guard.counts(WHEEL) == guard.total() == Counts(accepted=40)


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


def test_two_senders_of_one_id_are_told_from_each_other_and_not_as_loss():
    guard, one, other = Guard(), Sender(), Sender()
    for _ in range(7):
        other.encode(WHEEL, 2, 0.1, 1.0)
    for n in range(20):
        guard.accept(Frame(WHEEL, (one if n % 2 else other).encode(WHEEL, 2, 0.1, 1.0), n * 10_000_000))
    counts = guard.counts(WHEEL)
    assert (counts.accepted, counts.twin) == (20, 18)


@pytest.mark.parametrize("lost_ratio", [0.05, 0.1, 0.3])
def test_plain_loss_however_much_is_hardly_ever_taken_for_a_twin(lost_ratio):
    rng, guard = random.Random(5), Guard()
    for frame in frames(20_000):
        if rng.random() > lost_ratio:
            guard.accept(frame)
    counts = guard.counts(WHEEL)
    assert counts.lost > 0.9 * 20_000 * lost_ratio
    assert counts.twin <= 1
