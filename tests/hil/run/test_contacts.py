"""A contact that lasts is one entry with begin, end, wheel, rock and place; two at once are two."""

import io
import json

import numpy as np
import pytest
from mcap.reader import make_reader
from rich.console import Console

from hil.records import PlantState, Touch, WheelTruth
from hil.run.options import Watch
from hil.run.options import line as progress_line
from hil.world.contacts import Contact, Contacts, line, lines
from hil.world.truth import Truth
from hil.world.world import Progress

MS = 1_000_000
ONE = Touch(1, 0.09, (7.0, 3.0), (7.1, 3.0))
TWO = Touch(2, 0.09, (7.0, 3.0), (6.9, 3.1))
BELLY = Touch(0, 0.0, None, (1.0, -2.0))


def joined(*spans):
    """(begin, end in ms, touch): contacts of a plant that touches so, and the numbers told of, by time."""
    found, told = Contacts(), {}
    for at_ms in range(0, 6000, 10):
        numbers = found.add(at_ms * MS, [touch for begin, end, touch in spans if begin <= at_ms < end])
        if numbers:
            told[at_ms] = numbers
    return found, told


def test_a_contact_that_lasts_is_one_entry_with_begin_end_wheel_rock_and_place():
    found, told = joined((1000, 3000, ONE))
    assert found.found == [Contact(1.0, 2.99, 1, 0.09, 7.1, 3.0)]
    assert told == {1000: (0,), 3990: (0,)}  # begun; over


def test_a_wheel_that_bounces_makes_one_contact_and_one_that_comes_back_makes_two():
    found, _ = joined((1000, 1100, ONE), (1700, 1800, ONE), (4000, 4100, ONE))
    assert [(contact.begin_s, contact.end_s) for contact in found.found] == [(1.0, 1.79), (4.0, 4.09)]


def test_contacts_that_overlap_stay_apart():
    found, _ = joined((1000, 3000, ONE), (1500, 2000, TWO), (1600, 1700, BELLY))
    assert [(c.wheel, c.begin_s, c.end_s) for c in found.found] == [(1, 1.0, 2.99), (2, 1.5, 1.99), (0, 1.6, 1.69)]


def test_contacts_are_said_in_words_and_none_as_well():
    assert lines([]) == ["contacts: none"]
    wheel, body = Contact(613.5, 614.8, 1, 0.08, 7.47, 3.13), Contact(2.0, 2.0, 0, 0.0, 1.0, -2.0)
    assert lines([wheel, body])[0] == "contacts: 2"
    assert line(wheel) == "613.5 to 614.8 s: wheel 1 on a rock of 0.08 m at (7.47, 3.13)"
    assert "body on the ground" in line(body)


def state(at_ms, touches):
    zero = np.zeros(3)
    wheels = (WheelTruth(0.0, 0.0, 0.0, 0.0),) * 4
    return PlantState(at_ms * MS, zero, np.array([0, 0, 0, 1.0]), zero, zero, zero, wheels, touches)


@pytest.mark.parametrize("last_ms", [2000, 5000])
def test_the_file_of_the_truth_holds_each_contact_with_its_end(tmp_path, last_ms):
    """Also of one that goes on when the run ends."""
    truth = Truth(tmp_path / "truth.mcap")
    for at_ms in range(0, last_ms, 10):
        truth.add(state(at_ms, (ONE,) if 1000 <= at_ms < 3000 else ()))
    truth.close()
    with (tmp_path / "truth.mcap").open("rb") as file:
        rows = [json.loads(message.data) for _, _, message in make_reader(file).iter_messages(["/contact"])]
    assert [row["number"] for row in rows] == [0, 0]
    assert (rows[0]["begin_s"], rows[0]["end_s"]) == (1.0, 1.0)
    assert (rows[1]["begin_s"], rows[1]["end_s"]) == (1.0, min(last_ms - 10, 2990) / 1e3)
    assert (rows[1]["wheel"], rows[1]["rock_height_m"], rows[1]["x_m"], rows[1]["y_m"]) == (1, 0.09, 7.1, 3.0)


def test_a_contact_is_printed_once_when_it_begins_and_counted_in_the_live_line(monkeypatch):
    file, watch, progress = io.StringIO(), Watch(live=True), Progress(now_s=1.0)
    monkeypatch.setattr(watch, "_console", Console(file=file))
    with watch.showing("starting") as show:
        show(progress, 1.0)
        progress.contacts = [Contact(1.2, 1.2, 2, 0.09, 7.0, 3.0)]
        show(progress, 2.0)
        progress.contacts = [Contact(1.2, 3.2, 2, 0.09, 7.0, 3.0)]
        show(progress, 12.0)
    told = file.getvalue()
    assert told.count("contact at 1.2 s: wheel 2 on a rock of 0.09 m at (7.00, 3.00)") == 1
    assert told.rstrip().endswith("contacts 1")
    assert watch.contacts[0].end_s == 3.2


def test_the_live_line_names_no_contacts_where_there_are_none():
    assert "contact" not in progress_line(Progress(), 1.0).plain


@pytest.mark.parametrize(("seen", "word"), [
    ({}, "standing"), ({"turning": True}, "turning"), ({"driving": True, "turning": True}, "driving"),
    ({"sweeping": True}, "scanning"),
])  # fmt: skip
def test_the_live_line_says_what_the_rover_does(seen, word):
    assert f" {word} " in progress_line(Progress(**seen), 1.0).plain
