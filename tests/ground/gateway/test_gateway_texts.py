"""Lines for people as ground programs get them: joined by who knows MAVLink 2, between words for MAVLink 1."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ground.gateway.frames import mavlink as m
from ground.gateway.texts import Texts, between_words
from tests.ground.gateway_bed import Bed, Client

WORDS = "WHEEL_STUCK: command, rate and current of wheel 2 disagree, and have done so for three seconds now"


def joined(messages) -> str:
    """As a program of MAVLink 2 joins them: a piece that is not full ends the line."""
    raw = [one._text_raw for one in messages]
    assert all(len(piece) == 50 for piece in raw[:-1]) and len(raw[-1]) < 50
    assert [one.chunk_seq for one in messages] == list(range(len(messages)))
    assert len({one.id for one in messages}) == 1 and messages[0].id
    return b"".join(raw).decode()


@pytest.mark.parametrize("size", [51, 99, 100, 101, 150, 199, 200])
def test_pieces_of_mavlink_2_join_to_the_line_byte_for_byte(size):
    text = (WORDS * 3)[: size - 1] + "x"
    assert joined(Texts().say("info", text).messages(joins=True)) == text


def test_each_line_has_a_number_of_its_own():
    texts = Texts()
    first, second = (texts.say("info", WORDS).messages(joins=True) for _ in range(2))
    assert first[0].id != second[0].id


def test_a_line_that_fits_has_no_number():
    for joins in (True, False):
        (only,) = Texts().say("info", WORDS[:50]).messages(joins=joins)
        assert (only.id, only.chunk_seq, only.text) == (0, 0, WORDS[:50])


def test_a_line_that_is_too_long_ends_with_a_whole_word():
    text = joined(Texts().say("info", WORDS * 9).messages(joins=True))
    assert 150 < len(text) <= 200 and (WORDS * 9).startswith(text + " ")


@given(st.text(st.sampled_from("ab °ü€ "), max_size=200))
def test_between_words_nothing_is_lost_and_no_word_is_cut_that_fits(text):
    pieces = [piece.decode() for piece in between_words(text.encode())]  # raises where a character is cut
    assert all(len(piece.encode()) <= 50 for piece in pieces)
    assert "".join("".join(pieces).split()) == "".join(text.split())
    if all(len(word.encode()) <= 50 for word in text.split()):
        assert [word for piece in pieces for word in piece.split()] == text.split()


def test_a_program_of_mavlink_1_gets_lines_that_end_between_words_and_one_of_mavlink_2_what_it_joins():
    bed = Bed()
    new, old = Client(bed), Client(bed, ("127.0.0.1", 40_002))
    beat = m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)
    bed.receive(beat.pack(old.mav, force_mavlink1=True), old.address)
    bed.step(1.0)
    bed.rover.event(bed.now_ns, "FAULT", WORDS)
    bed.step(1.0)
    assert "".join(one.text for one in new.heard("STATUSTEXT")) == f"FAULT: {WORDS}"
    lines = [one.text for one in old.heard("STATUSTEXT")]
    assert " ".join(lines) == f"FAULT: {WORDS}" and len(lines) == 3
    assert [one.id for one in old.heard("STATUSTEXT")] == [0] * 3
    old.say(beat)  # it has heard MAVLink 2 by now
    bed.rover.event(bed.now_ns, "FAULT", WORDS)
    bed.step(1.0)
    assert old.heard("STATUSTEXT")[-1].id
