"""SCIP 2.0 against literal bytes of real sensors, and against whatever a bad line may deliver."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError, scip
from tests.protocol import wire

CALM = settings(max_examples=40, deadline=None, derandomize=True)
ALL = scip.ScanRequest("MD", 0, 1080, 1, 0, 0)

VV = (
    b"VV\n00P\nVEND:Hokuyo Automatic Co.,Ltd.;[\nPROD:SOKUIKI Sensor TOP-URG UTM-30LX;P\n"
    b"FIRM:P.1.05(17/Apr./2009);M\nPROT:SCIP 2.0;N\nSERI:00903971;:\n\n"
)
PP = (
    b"PP\n00P\nMODL:UTM-30LX(Hokuyo Automatic Co.,Ltd.);U\nDMIN:23;7\nDMAX:60000;J\nARES:1440;^\n"
    b"AMIN:0;?\nAMAX:1080;Z\nAFRT:540;0\nSCAN:2400;U\n\n"
)


def frames_of(pieces, echo=b"", stamps=None):
    splitter, out = scip.Splitter(), []
    splitter.echo = echo
    for k, piece in enumerate(pieces):
        out += splitter.receive(k if stamps is None else stamps[k], piece)
    return out


def scan_bytes(seed=1, stamp_ms=123456, asked=ALL, remaining=0):
    values = np.random.default_rng(seed).integers(0, 60_000, asked.values).astype(np.int32)
    echo = asked.line(remaining) if asked.streams else asked.line()
    return values, scip.scan_reply(asked, echo, stamp_ms, values)


def test_status_lines_carry_the_sums_of_real_sensors():
    for line in b"00P 99b 01Q 02R 03S 04T 05U 10Q 0Cc 0Dd 0Ee 0Ll".split():
        assert scip.checksum(line[:2]) == line[2:]


@pytest.mark.parametrize("logged", [VV, PP])
def test_logged_utm_30lx_text_replies_are_read_and_written_byte_for_byte(logged):
    ((_, frame),) = frames_of([logged])
    answer = scip.parse_reply(frame)
    pairs = scip.parse_text(answer)
    assert scip.reply(answer.echo, "00", b"".join(scip.text_line(*pair) for pair in pairs.items())) == logged


def test_logged_utm_30lx_parameters_are_those_of_the_manual():
    pairs = scip.parse_text(scip.parse_reply(PP[:-2]))
    assert (pairs["ARES"], pairs["AMAX"], pairs["AFRT"], pairs["SCAN"]) == ("1440", "1080", "540", "2400")


def test_default_setting_suffix_and_leading_blank_are_part_of_the_value():
    text = b"SCSP:Initial(2400[rpm])<-Default setting by user"
    body = text + b";" + scip.checksum(text) + b"\n" + scip.text_line("DMIN", " 20")[:-1]
    pairs = scip.parse_text(scip.Reply(b"II", "00", body))
    assert pairs == {"SCSP": "Initial(2400[rpm])<-Default setting by user", "DMIN": "20"}


def test_values_of_the_standard_are_coded_as_printed():
    assert scip.encode_value(1234, 2) == b"CB"
    assert scip.encode_value(5432, 3) == b"1Dh"
    assert scip.encode_value(16_000_000, 4) == b"m2@0"
    assert [scip.decode_value(t) for t in (b"CB", b"1Dh", b"m2@0")] == [1234, 5432, 16_000_000]


def test_a_full_md_frame_has_3372_bytes_and_a_full_me_frame_6717():
    assert len(ALL.line()) == 15
    assert len(scan_bytes()[1]) == 3372
    assert len(scan_bytes(asked=scip.ScanRequest("ME", 0, 1080))[1]) == 6717


def test_an_md_frame_by_hand():
    asked = scip.ScanRequest("MD", 44, 46, 1, 0, 3)
    made = scip.scan_reply(asked, asked.line(2), 16_000_000, np.array([5432, 1, 0], np.int32))
    assert made == b"MD0044004601002\n99b\nm2@0?\n1Dh001000n\n\n"


@pytest.mark.parametrize("code", ["MD", "MS", "ME", "GD", "GS", "GE", "%MD", "%ME"])
def test_what_is_written_is_read_back_in_every_scan_command(code):
    asked = scip.ScanRequest(code, 100, 500, 1, 0, 9)
    values = np.random.default_rng(3).integers(0, 4096, asked.values).astype(np.int32)
    echo = asked.line(7) if asked.streams else asked.line()
    ((_, frame),) = frames_of([scip.scan_reply(asked, echo, (2**24 + 5) * (1000 if code[0] == "%" else 1), values)])
    scan = scip.parse_scan(scip.parse_reply(frame), asked)
    assert scan.stamp_ms == 5 and scan.remaining == (7 if asked.streams else 0)
    assert np.array_equal(scan.values, values)


@pytest.mark.parametrize("cut", [wire.whole, wire.bytewise, wire.ragged])
def test_frames_come_out_alike_however_the_stream_is_cut(cut):
    stream = VV + scan_bytes()[1] + PP
    assert [frame for _, frame in frames_of(cut(stream))] == [VV[:-2], scan_bytes()[1][:-2], PP[:-2]]


def test_a_frame_keeps_the_arrival_time_of_its_first_byte():
    frame = scan_bytes()[1]
    stream = frame + frame
    pieces = [stream[:1000], stream[1000:3371], stream[3371:3373], stream[3373:]]
    assert [rx for rx, _ in frames_of(pieces, stamps=(10, 20, 30, 40))] == [10, 30]


def test_noise_between_frames_costs_no_frame():
    stream = wire.with_noise([scan_bytes(k)[1] for k in range(5)], seed=2)
    good = [f for _, f in frames_of(wire.ragged(stream)) if f.startswith(b"MD")]
    assert good == [scan_bytes(k)[1][:-2] for k in range(5)]


def test_a_lost_end_of_frame_costs_one_scan_when_the_echo_is_known():
    first, second = scan_bytes(1)[1], scan_bytes(2)[1]
    for joined in (first[:-1] + second, first[:-2] + second, first[:1500] + second, b"MD00" + second):
        pieces = frames_of([joined], echo=ALL.line(0)[:13])
        values = scip.parse_scan(scip.parse_reply(pieces[-1][1]), ALL).values
        assert np.array_equal(values, scan_bytes(2)[0])


def test_endless_noise_is_dropped_and_counted_not_stored():
    splitter = scip.Splitter()
    for _ in range(300):
        splitter.receive(0, b"x" * 1000)
    assert splitter.overflows == (300_000 - scip.FRAME_LIMIT) // scip.FRAME_LIMIT
    splitter.receive(0, b"\n\n")
    assert splitter.receive(1, VV) == [(1, VV[:-2])]


def test_any_single_changed_byte_of_a_scan_is_noticed():
    values, frame = scan_bytes()
    rng = np.random.default_rng(5)
    for at in range(0, len(frame), 3):
        bad = wire.flipped(frame, at, int(rng.integers(1, 256)))
        good = 0
        for _, piece in frames_of([bad + b"\n\n"]):
            try:
                good += np.array_equal(scip.parse_scan(scip.parse_reply(piece), ALL).values, values)
                same = True
            except WireError:
                same = False
            assert not same or at in (13, 14) or at >= len(frame) - 2  # the remaining count has no sum


@pytest.mark.parametrize(("at", "kind"), [(3, "echo"), (18, "status_sum"), (22, "stamp_sum"), (200, "block_sum")])
def test_the_kind_of_a_bad_frame_names_its_fault(at, kind):
    frame = wire.flipped(scan_bytes()[1], at)[:-2]
    with pytest.raises(WireError) as caught:
        scip.parse_scan(scip.parse_reply(frame), ALL)
    assert caught.value.kind == kind


def test_a_data_byte_out_of_range_with_a_fitting_sum_is_refused():
    asked = scip.ScanRequest("MD", 0, 0)
    blocks = b"0p0" + scip.checksum(b"0p0")
    with pytest.raises(WireError, match="character"):
        scip.decode_blocks(blocks, asked.values, 3)


@CALM
@given(st.binary(max_size=300), st.integers(1, 50))
def test_arbitrary_bytes_give_frames_or_wire_errors_and_nothing_else(data, size):
    for _, frame in frames_of([data[k : k + size] for k in range(0, len(data), size)], echo=b"MD"):
        assert frame and b"\n\n" not in frame
        for parse in (lambda r: scip.parse_scan(r, ALL), scip.parse_text, lambda r: scip.parse_stamp(r.body)):
            try:
                parse(scip.parse_reply(frame))
            except WireError as error:
                assert error.kind


@CALM
@given(st.lists(st.integers(0, 2**18 - 1), min_size=1, max_size=200), st.integers(0, 2**24 - 1))
def test_values_survive_the_wire(values, stamp_ms):
    asked = scip.ScanRequest("GD", 0, len(values) - 1)
    frame = scip.scan_reply(asked, asked.line(), stamp_ms, np.array(values, np.int32))
    scan = scip.parse_scan(scip.parse_reply(frame[:-2]), asked)
    assert scan.stamp_ms == stamp_ms and scan.values.tolist() == values


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (b"MD0000108001000", ALL),
        (b"GD0000108001", scip.ScanRequest("GD", 0, 1080)),
        (b"MD00001080010", "0C"),
        (b"MD00001080010000", "0D"),
        (b"MDx000108001000", "01"),
        (b"MD0000x08001000", "02"),
        (b"MD000010800x000", "03"),
        (b"MD0000108101000", "04"),
        (b"MD0500010001000", "05"),
        (b"MD00001080010x0", "07"),
        (b"MD000010800100x", "07"),
        (b"MD0000108001x00", "06"),
    ],
)
def test_requests_are_read_or_refused_with_the_standards_status(line, expected):
    asked = scip.parse_request(line)
    assert scip.parse_scan_request(asked, 1080) == expected


@pytest.mark.parametrize(("line", "expected"), [
    (b"VV", "00"), (b"VVx", "0D"), (b"TM", "0C"), (b"TM1;key+1", "00"), (b"TM12", "0D"), (b"SS115200", "00"),
    (b"SS11520", "0C"), (b"CR01", "00"), (b"HS0", "00"), (b"DB10", "00"), (b"%ST", "00"), (b"%SL", "00"),
    (b"%TM1", "00"), (b"%MD0000108001000", "00"), (b"NE0000108001000", "00"), (b"HD000010800", "0C"), (b"RB", "00"),
    (b"SCIP2.0", "0E"), (b"XX", "0E"), (b"%XX", "0E"), (b"\xff\xfe", "0E"), (b"V", "0E"),
])  # fmt: skip
def test_each_command_has_its_length_and_unknown_ones_are_refused(line, expected):
    assert scip.refusal(scip.parse_request(line)) == expected


def test_a_status_has_a_meaning_for_its_command():
    assert scip.meaning("BM", "02") == "the laser is on already" and scip.succeeded("BM", "02")
    assert scip.meaning("MD", "05") == "last step lies before the first" and not scip.succeeded("MD", "05")
    assert scip.meaning("MD", "64") == "hardware trouble" and scip.meaning("VV", "0E") == "unknown command"
    assert scip.meaning("VV", "7Z") == "a status that no manual lists"
    assert not scip.succeeded("MD", "02") and not scip.succeeded("QT", "10")


def test_codes_below_dmin_are_those_of_the_model():
    utm, urg = (scip.codes_of(f"{model}(Hokuyo Automatic Co.,Ltd.)") for model in ("UTM-30LX", "URG-04LX"))
    assert [utm[k].name for k in range(1, 6)] == ["NO_OBJECT", "TOO_NEAR", "INTERFERENCE", "NEAR_END", "OTHER"]
    assert sorted(urg) == list(range(20)) and urg[18] is scip.Code.TOO_STRONG and urg[1] is scip.Code.TOO_WEAK


def test_request_strings_are_limited_to_16_of_the_allowed_letters():
    assert scip.request("TM", "1", "abc+1") == b"TM1;abc+1\n"
    assert scip.parse_request(b"VV;" + b"a" * 17).status == "0G"
    assert scip.parse_request(b"VV;a!").status == "0H"
    with pytest.raises(ValueError, match="at most 16"):
        scip.request("VV", "", "a!")


def test_a_flood_of_line_feeds_is_one_step_a_piece_and_the_frame_behind_it_comes(monkeypatch):
    splitter, cuts = scip.Splitter(), []
    whole = scip.Splitter._cut
    monkeypatch.setattr(scip.Splitter, "_cut", lambda self, *at: cuts.append(at) or whole(self, *at))
    frames = [frame for n in range(16) for frame in splitter.receive(n, b"\n" * 65_536)]
    assert frames == [] and len(cuts) <= 64 and splitter.overflows == 0
    assert splitter.receive(99, b"VV\n00P\n\n\n\n\nPP\n00P\n\n") == [(99, b"VV\n00P"), (99, b"PP\n00P")]


@pytest.mark.parametrize("feeds", range(1, 9))
def test_any_number_of_line_feeds_between_two_frames_is_no_frame(feeds):
    data = b"VV\n00P\n" + b"\n" * feeds + b"PP\n00P\n\n"
    for cut in range(len(data)):
        splitter = scip.Splitter()
        frames = [frame for part in (data[:cut], data[cut:]) for _, frame in splitter.receive(0, part)]
        assert frames == [b"VV\n00P", b"PP\n00P"]
