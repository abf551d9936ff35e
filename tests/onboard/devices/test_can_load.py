"""How full the bus is: frame lengths against a plain twin, load and response times over the DBC's cycle times."""

import random
import re

import pytest

from onboard.bringup.can import load
from onboard.bringup.can.bits import wire_bits, worst_bits
from protocol.generated.can_frames import FRAMES


def plain_bits(can_id, data):
    """The frame as a string of digits: remainder of CRC-15 by long division, stuffing by replacement."""
    digits = f"0{can_id:011b}000{len(data):04b}" + "".join(f"{byte:08b}" for byte in data)
    rest = int(digits, 2) << 15
    for at in range(rest.bit_length() - 1, 14, -1):
        if rest >> at & 1:
            rest ^= 0b1100010110011001 << at - 15
    digits, sent = digits + f"{rest:015b}", ""
    while run := re.match(r"(.*?)(00000|11111)", digits):
        bit = "1" if run[2][0] == "0" else "0"
        sent, digits = sent + run[0], bit + digits[run.end() :]
    return len(sent + digits) + 1 + 2 + 7 + 3


def test_a_frame_is_as_long_as_its_digits_written_out():
    draw = random.Random(1)
    for _ in range(300):
        data = bytes(draw.choice((0, 0, 255, draw.randrange(256))) for _ in range(draw.randrange(9)))
        can_id = draw.choice((0, 0x7FF, draw.randrange(0x800)))
        assert wire_bits(can_id, data) == plain_bits(can_id, data)


def test_no_frame_is_longer_than_the_worst_and_some_come_near():
    assert worst_bits(8) == 135
    lengths = [wire_bits(0x0F8 ^ n, bytes([0x3C ^ n]) * 8) for n in (0, 0xFF)]
    assert 120 < max(lengths) <= 135


def test_worst_case_load_is_below_forty_percent():
    assert load.total(load.analyse(load.Case.EVERYTHING)) < 0.40


@pytest.mark.parametrize("case", [load.Case.OPERATION, load.Case.EMERGENCY])
def test_every_frame_meets_its_period(case):
    assert all(r.response_s <= r.period_s for r in load.analyse(case))


def test_the_computers_stop_is_on_the_wire_within_half_a_millisecond_of_blocking():
    stop = load.analyse(load.Case.EVERYTHING)[0]
    assert stop.name == "EMERGENCY_STOP_COMPUTER" and stop.response_s == pytest.approx(2 * 270e-6)


def test_no_release_of_all_frames_at_once_takes_longer_than_was_computed():
    """The critical instant played on a bus: all frames released together just after the longest lower one began."""
    rows, now_s = load.analyse(load.Case.OPERATION), 270e-6
    released = {row.name: 0.0 for row in rows}
    slowest = {}
    while now_s < 0.02:
        ready = [row for row in rows if released[row.name] <= now_s + 1e-12]
        if not ready:
            now_s = min(released.values())
            continue
        row = ready[0]
        now_s += row.wire_s
        slowest[row.name] = max(slowest.get(row.name, 0.0), now_s - released[row.name])
        released[row.name] += row.period_s
    assert all(slowest[row.name] <= row.response_s + 1e-9 for row in rows)
    assert slowest["WHEEL_4_COMMAND"] == pytest.approx(next(r.response_s for r in rows if r.name == "WHEEL_4_COMMAND"))


def test_a_bus_that_is_too_slow_and_a_frame_without_interval_are_refused():
    with pytest.raises(ValueError, match="overloaded"):
        load.analyse(load.Case.OPERATION, bits_per_s=125_000)
    lone = FRAMES[0x080]._replace(cycle_ms=0)
    with pytest.raises(ValueError, match="TIME_SYNC has neither"):
        load.analyse(load.Case.OPERATION, {0x080: lone})
