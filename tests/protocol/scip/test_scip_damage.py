"""Damage on the line: an undamaged scan comes out once, a damaged one only if it satisfies every check of SCIP."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError, scip
from tests.oracles.scip import verdict
from tests.protocol.scip.test_scip import PP, VV

FULL = scip.ScanRequest("MD", 0, 1080)
SHORT = scip.ScanRequest("MD", 500, 540)
SIZES = (1, 2, 3, 7, 64, 65, 66, 1000, 3371, 3372, 4096, 65_536)


def scan_of(asked, k):
    values = np.random.default_rng(k).integers(0, 60_000, asked.values).astype(np.int32)
    return scip.scan_reply(asked, asked.line(), 1000 + 25 * k, values)


def pieces_of(data, sizes):
    at, k = 0, 0
    while at < len(data):
        yield data[at : at + sizes[k % len(sizes)]]
        at += sizes[k % len(sizes)]
        k += 1


def frames_of(pieces, asked):
    splitter, out = scip.Splitter(), []
    splitter.echo = asked.line()[:13]
    for piece in pieces:
        out += [frame for _, frame in splitter.receive(0, piece)]
    return out, splitter.overflows


def accepted(pieces, asked):
    """(frame, stamp, values) of all that the driver takes, decoded as it does."""
    splitter, decoder, out = scip.Splitter(), scip.ScanDecoder(asked), []
    splitter.echo = asked.line()[:13]
    for piece in pieces:
        for _, frame in splitter.frames(0, piece):
            try:
                got = decoder.decode(frame)
            except WireError:
                continue
            out.append((bytes(frame), got.stamp_ms, got.values.tolist()))
    return out


@pytest.mark.parametrize("size", SIZES)
def test_reads_of_1_byte_to_64_kib_give_the_same_frames(size):
    noise = np.random.default_rng(4).integers(0, 256, 150_000, dtype=np.uint8).tobytes().replace(b"\n\n", b"..")
    stream = VV + scan_of(FULL, 1) + noise + b"\n\n" + PP + scan_of(FULL, 2)[:-1] + scan_of(FULL, 3) + b"\n\n\n" + VV
    whole = frames_of([stream], FULL)
    assert frames_of(pieces_of(stream, (size,)), FULL) == whole
    assert whole[0][0] == VV[:-2] and scan_of(FULL, 3)[:-2] in whole[0] and whole[0][-1] == VV[:-2] and whole[1] == 3


def test_a_change_of_the_echo_counts_from_the_next_frame_on_even_in_one_piece():
    splitter, seen = scip.Splitter(), []
    stream = VV + scan_of(FULL, 1)[:-1] + scan_of(FULL, 2)
    for _, frame in splitter.frames(0, stream):
        seen.append(bytes(frame))
        splitter.echo = FULL.line()[:13]
    assert seen == [VV[:-2], scan_of(FULL, 1)[:-1], scan_of(FULL, 2)[:-2]]


DAMAGE = st.lists(
    st.tuples(st.sampled_from(["flip", "set", "drop", "double", "insert"]), st.floats(0, 1, exclude_max=True),
              st.integers(0, 255)), max_size=8,
)  # fmt: skip


def damaged(stream, damage):
    data = bytearray(stream)
    for kind, where, what in damage:
        at = int(where * len(data))
        if kind == "flip":
            data[at] ^= 1 << what % 8
        elif kind == "set":
            data[at] = (0x0A, 0x30, 0x26, 0x4D, what)[what % 5]
        elif kind == "drop":
            del data[at : at + 1 + what]
        elif kind == "double":
            data[at:at] = data[at : at + 1 + what]
        else:
            data[at:at] = bytes((what, 0x0A, 0x4D))[: 1 + what % 3]
        data = data or bytearray(b"\n")
    return bytes(data)


@settings(max_examples=250, deadline=None, derandomize=True)
@given(DAMAGE, st.lists(st.integers(1, 300), min_size=1, max_size=4))
def test_undamaged_scans_come_out_once_and_others_only_if_the_oracle_finds_every_check_satisfied(damage, sizes):
    sent = [scan_of(SHORT, k) for k in range(6)]
    stream = damaged(b"".join(sent), damage)
    got = accepted(pieces_of(stream, sizes), SHORT)
    count = Counter(frame for frame, _, _ in got)
    for frame in sent:
        assert stream.count(frame) <= count[frame[:-2]] <= stream.count(frame[:-2])  # only its end may be lost
    for frame, stamp_ms, values in got:
        found = verdict(frame, SHORT.line(), SHORT.beams)
        assert found is not None and found.stamp == stamp_ms and [b[0][0] for b in found.beams] == values


def test_a_scan_that_lost_only_its_end_comes_out_where_the_next_one_begins():
    sent = [scan_of(SHORT, k) for k in range(3)]
    got = accepted([sent[0] + sent[1][:-2] + sent[2]], SHORT)
    assert [frame for frame, _, _ in got] == [frame[:-2] for frame in sent]


@settings(max_examples=150, deadline=None, derandomize=True)
@given(DAMAGE)
def test_decoder_and_oracle_take_the_same_frames(damage):
    frame = damaged(scan_of(SHORT, 1)[:-2], damage)
    try:
        taken = scip.ScanDecoder(SHORT).decode(frame).values.tolist()
    except WireError:
        taken = None
    found = verdict(frame, SHORT.line(), SHORT.beams)
    assert taken == (None if found is None else [beam[0][0] for beam in found.beams])


def test_two_changes_that_keep_a_sum_are_legal_and_taken():
    frame = bytearray(scan_of(SHORT, 1)[:-2])
    at = frame.index(b"\n", 20) + 10
    frame[at], frame[at + 1] = 0x31, 0x32
    line = bytes(frame[frame.rindex(b"\n", 0, at) + 1 : frame.index(b"\n", at) - 1])
    frame[frame.index(b"\n", at) - 1] = scip.checksum(line)[0]
    frame[at], frame[at + 1] = 0x32, 0x31
    assert verdict(bytes(frame), SHORT.line(), SHORT.beams) is not None
    scip.ScanDecoder(SHORT).decode(bytes(frame))


@pytest.mark.parametrize("asked", [SHORT, scip.ScanRequest("ME", 500, 540), scip.ScanRequest("MS", 500, 563),
                                   scip.ScanRequest("MD", 500, 563, 2), scip.ScanRequest("GD", 0, 63)])  # fmt: skip
def test_a_single_flipped_bit_is_never_taken(asked):
    frame, decoder = scan_of(asked, 7)[:-2], scip.ScanDecoder(asked)
    assert len(decoder.decode(frame).values) == asked.values
    taken = []
    for at in range(len(frame)):
        for bit in range(8):
            bad = frame[:at] + bytes((frame[at] ^ 1 << bit,)) + frame[at + 1 :]
            try:
                decoder.decode(bad)
                taken.append((at, bit))
            except WireError:
                pass
    assert not taken


def test_a_single_flipped_bit_in_the_stream_costs_that_scan_alone():
    sent = [scan_of(SHORT, k) for k in range(3)]
    stream, begin = b"".join(sent), len(sent[0])
    for at in range(begin, begin + len(sent[1])):
        bad = stream[:at] + bytes((stream[at] ^ 1 << at % 8,)) + stream[at + 1 :]
        assert [frame for frame, _, _ in accepted([bad], SHORT)] == [sent[0][:-2], sent[2][:-2]]


@pytest.mark.parametrize("beams", [1, 20, 21, 22, 42, 43, 64, 1081])
@pytest.mark.parametrize("code", ["MD", "ME", "MS", "GD", "GS", "GE", "ND", "%MD"])
def test_the_decoder_gives_what_the_plain_reader_gives(code, beams):
    asked = scip.ScanRequest(code, 0, beams - 1)
    values = np.random.default_rng(beams).integers(0, 4096, (asked.beams, asked.kind.echoes, asked.channels))
    frame = scip.scan_reply(asked, asked.line(), 2**23 + 3, values.astype(np.int32))[:-2]
    plain, fast = scip.parse_scan(scip.parse_reply(frame), asked), scip.ScanDecoder(asked).decode(frame)
    assert (plain.remaining, plain.stamp_ms) == (fast.remaining, fast.stamp_ms)
    assert np.array_equal(plain.values, fast.values)


def test_the_decoder_knows_the_string_of_its_request():
    echo = SHORT.line() + b";key 1"
    frame = scip.scan_reply(SHORT, echo, 5, np.zeros(SHORT.values, np.int32))[:-2]
    assert scip.ScanDecoder(SHORT, b"key 1").decode(frame).stamp_ms == 5
    with pytest.raises(WireError) as caught:
        scip.ScanDecoder(SHORT).decode(frame)
    assert caught.value.kind == "echo"
