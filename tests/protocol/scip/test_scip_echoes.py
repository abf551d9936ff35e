"""Several echoes of a beam: `R`, `R&R`, `R&R&R`, with intensity `RI&RI`."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError, scip
from tests.oracles.scip import verdict

CALM = settings(max_examples=60, deadline=None, derandomize=True)


def asked_of(code, beams):
    return scip.ScanRequest(code, 0, beams - 1)


def values_of(beams, channels, seed=1):
    """(beams, 3, channels) with one to three echoes each."""
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 2**18, (beams, 3, channels)).astype(np.int32)
    values[np.arange(3)[None] >= rng.integers(1, 4, beams)[:, None]] = scip.MISSING
    return values


def frame_of(asked, values):
    return scip.scan_reply(asked, asked.line(), 7, values)[:-2]


def test_three_beams_by_hand():
    asked = asked_of("ND", 3)
    values = np.full((3, 3, 1), scip.MISSING, np.int32)
    values[0, 0], values[1, :2, 0], values[2, :, 0] = 1, (5432, 1), (0, 1, 2)
    text = b"0011Dh&001000&001&002"
    assert frame_of(asked, values).split(b"\n")[3] == text + scip.checksum(text)
    assert np.array_equal(scip.parse_scan(scip.parse_reply(frame_of(asked, values)), asked).values, values)


@pytest.mark.parametrize("code", ["ND", "NE", "HD", "HE"])
@pytest.mark.parametrize("beams", [1, 21, 22, 1081])
def test_what_is_written_is_read_back(code, beams):
    asked = asked_of(code, beams)
    values = values_of(beams, asked.channels)
    assert np.array_equal(scip.parse_scan(scip.parse_reply(frame_of(asked, values)), asked).values, values)


def test_an_and_may_begin_a_block():
    asked = asked_of("ND", 22)
    values = np.full((22, 3, 1), scip.MISSING, np.int32)
    values[:, 0] = 7
    values[0, 1] = values[19, 1] = 8  # 7 characters, 19 beams of 3: 64
    lines = frame_of(asked, values).split(b"\n")[3:]
    assert len(lines[0]) == 65 and lines[1].startswith(b"&008")
    assert np.array_equal(scip.parse_scan(scip.parse_reply(frame_of(asked, values)), asked).values, values)


@pytest.mark.parametrize("text", [
    b"&001", b"001&", b"001&&002", b"0&01", b"001&02", b"001&001&001&001", b"001002", b"00", b"00~",
])  # fmt: skip
def test_echoes_out_of_order_are_refused(text):
    with pytest.raises(WireError) as caught:
        scip.decode_echoes(text + scip.checksum(text), 1, (3, 1, 3))
    assert caught.value.kind in ("length", "character")


def test_a_beam_without_its_first_echo_cannot_be_written():
    with pytest.raises(ValueError, match="first echo"):
        scip.encode_echoes(np.full((1, 3, 1), scip.MISSING, np.int32), 3)


@CALM
@given(st.text("01ao&&", min_size=1, max_size=150), st.integers(1, 40), st.sampled_from(["ND", "NE"]))
def test_any_characters_with_fitting_sums_are_taken_or_refused_as_the_oracle_says(text, beams, code):
    asked = asked_of(code, beams)
    blocks = [text[k : k + 64].encode() for k in range(0, len(text), 64)]
    body = scip.stamp_line(7) + b"".join(block + scip.checksum(block) + b"\n" for block in blocks)
    frame = scip.reply(asked.line(), "99", body)[:-2]
    try:
        got = scip.parse_scan(scip.parse_reply(frame), asked).values
    except WireError:
        got = None
    want = verdict(frame, asked.line(), beams, asked.channels, 3)
    assert (got is None) == (want is None)
    if got is not None:
        assert [[e.tolist() for e in beam if e[0] >= 0] for beam in got] == want.beams
