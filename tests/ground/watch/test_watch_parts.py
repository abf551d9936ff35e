"""Parts of the terminal view: picture, rows of the state, stop line; nothing old looks fresh."""

import math

import numpy as np
import pytest
from virtual_station import S, VirtualClock, VirtualStation

from ground.session.news import Item, ProductHeard
from ground.shell.shell import Shell
from ground.shell.terminal import Live
from ground.watch.model import Stop, View, late, stop_words
from ground.watch.picture import FREE, GOAL, NOTHING, OBSTACLE, TRAIL, Scene, at, draw, window
from ground.watch.state import GOOD, LATE, ROWS, WRONG, headline, row_words, state
from ground.watch.terminal import ViewTeller, elsewhere, possible
from protocol.bulk import Product
from protocol.products import LdemProduct, MapGrid
from protocol.telemetry import TABLE


def live(**station):
    view, made = View(), VirtualStation(**station)
    teller = ViewTeller(view)
    teller.session = made.session
    return Live(made, VirtualClock(10_000.0), teller, Shell(elsewhere), lambda *_: None, 0.0), view


def until(session, true):
    while not true():
        session.turn()


def two_halves(cells=20, cell_m=0.5):
    """A map whose western half is free and whose eastern half is an obstacle, level."""
    sets = np.full((cells, cells), 3, np.uint8)
    sets[:, cells // 2 :] = 2
    return LdemProduct(MapGrid(0.0, 0.0, cell_m, cells, cells), np.zeros((cells, cells), np.float32), sets)


def colours(text, columns):
    """(row, column) -> (character, colour, background) of a drawn picture."""
    found = {}
    for number, line in enumerate(text.split("\n")):
        styles = [None] * columns
        for span in line.spans:
            styles[span.start : span.end] = [span.style] * (span.end - span.start)
        for column, (sign, style) in enumerate(zip(line.plain, styles, strict=True)):
            found[number, column] = sign, tuple(style.color.triplet), tuple(style.bgcolor.triplet)
    return found


@pytest.mark.parametrize(("columns", "rows"), [(40, 12), (120, 40), (7, 3)])
def test_the_map_is_drawn_with_east_to_the_right_and_as_many_characters_as_asked(columns, rows):
    scene = Scene(two_halves())
    seen = window(scene, columns, rows, 0)
    cells = colours(draw(scene, seen, columns, rows), columns)
    assert set(cells) == {(row, column) for row in range(rows) for column in range(columns)}
    for (row, column), (sign, upper, lower) in cells.items():
        assert sign == "▀"
        for half, colour in ((0, upper), (1, lower)):
            x_m = seen.x_m + (column + 0.5 - columns / 2) * seen.element_m
            y_m = seen.y_m - (2 * row + half + 0.5 - rows) * seen.element_m
            inside = -0.2 < x_m < 9.7 and -0.2 < y_m < 9.7
            if inside and abs(x_m - 4.75) > 0.05:
                assert (colour[0] > colour[1]) == (x_m > 4.75)  # the obstacle's orange, the free ground's green
            if not (-0.3 < x_m < 9.8 and -0.3 < y_m < 9.8):
                assert colour == NOTHING
    assert OBSTACLE[0] > OBSTACLE[1] and FREE[1] > FREE[0]


def test_all_that_is_known_lies_within_the_window_and_zoom_follows_the_rover():
    scene = Scene(two_halves(), (30.0, -12.0, 0.0), ((29.0, -12.0),), ((30.0, -12.0), (31.0, 20.0)), (31.0, 20.0))
    seen = window(scene, 60, 20, 0)
    for x_m, y_m in ((0.0, 0.0), (9.5, 9.5), (30.0, -12.0), (31.0, 20.0)):
        row, column = at(x_m, y_m, seen, 60, 20)
        assert 0 <= row < 40 and 0 <= column < 60
    near = window(scene, 60, 20, 2)
    assert (near.x_m, near.y_m, near.element_m) == (30.0, -12.0, pytest.approx(seen.element_m / 4))


@pytest.mark.parametrize(("yaw_deg", "arrow"), [(0, "→"), (90, "↑"), (180, "←"), (-90, "↓"), (44, "↗"), (-179, "←")])
def test_the_rover_is_an_arrow_along_its_heading_and_the_goal_a_ring(yaw_deg, arrow):
    scene = Scene(None, (1.0, 2.0, math.radians(yaw_deg)), goal=(5.0, 2.0))
    seen = window(scene, 40, 12, 0)
    cells = colours(draw(scene, seen, 40, 12), 40)
    signs = {sign: (row, column, colour) for (row, column), (sign, colour, _) in cells.items() if sign != "▀"}
    assert signs.keys() == {arrow, "◎"}
    row, column = at(1.0, 2.0, seen, 40, 12)
    assert signs[arrow] == (row // 2, column, TRAIL) and signs["◎"][2] == GOAL
    assert signs["◎"][1] > column and signs["◎"][0] == row // 2


def test_a_map_without_any_known_height_and_an_empty_scene_are_drawn():
    unknown = LdemProduct(MapGrid(0.0, 0.0, 0.5, 4, 4), np.full((4, 4), np.nan, np.float32), np.zeros((4, 4), np.uint8))
    for scene in (Scene(), Scene(unknown)):
        assert len(draw(scene, window(scene, 10, 4, 0), 10, 4).plain.splitlines()) == 4


def items(now_s, **values):
    return {name: Item(round(now_s * S), 0, name, value) for name, value in values.items()}


def test_a_value_that_is_late_is_marked_with_its_age_and_one_that_is_unknown_is_no_number():
    battery = next(row for row in ROWS if row.label == "battery")
    held = items(10.0, voltage_v=27.5, current_a=1.0, charge_ratio=0.9)
    assert row_words(battery, held, 10 * S) == ("27.5 V 1.0 A 90 %", GOOD)
    assert row_words(battery, {}, 10 * S) == ("?", LATE)
    assert row_words(battery, held, 60 * S)[1] == LATE
    line = next(line for line in state(held, 300 * S, 60, 20).plain.splitlines() if line.startswith("battery"))
    assert line.endswith("5 min")
    half = items(10.0, voltage_v=27.5, current_a=math.nan, charge_ratio=0.9)
    assert row_words(battery, half, 10 * S)[0].split()[1] == "?"


def test_a_value_out_of_limits_is_marked_unless_it_is_late():
    battery = next(row for row in ROWS if row.label == "battery")
    held = items(10.0, voltage_v=20.0, current_a=1.0, charge_ratio=0.9)
    assert row_words(battery, held, 10 * S)[1] == WRONG
    assert row_words(battery, held, 100 * S)[1] == LATE


def test_every_row_shows_known_items_of_the_table_in_any_state_of_knowledge():
    names = {row.name for row in TABLE}
    for row in ROWS:
        assert set(row.items) <= names
        assert row_words(row, items(1.0, **dict.fromkeys(row.items, 1.0)), S)[0]
        for name in row.items:
            assert row_words(row, items(1.0, **{name: 1.0}), S)[0]


@pytest.mark.parametrize("width", [34, 60])
def test_no_row_is_wider_than_its_pane(width):
    held = items(1.0, **{row.name: 1e6 for row in TABLE if row.name not in ("mode", "phase", "faults")})
    assert all(len(line) <= width for line in state(held, 400 * S, width, 15).plain.splitlines())


def test_a_silent_rover_is_shown_as_silent_and_none_of_its_values_as_fresh():
    session, _ = live(silent=((5.0, 1e9),))
    until(session, lambda: session.now_ns > 4 * S)
    assert headline(session.session, session.now_ns)[1] == GOOD
    until(session, lambda: session.now_ns > 200 * S)
    words, style = headline(session.session, session.now_ns)
    assert "SILENT for 3 min" in words and style == WRONG
    assert all(late(item, session.now_ns) for item in session.session.items.values())


def test_a_rover_that_was_never_heard_is_said_to_be_so():
    session, _ = live(silent=((0.0, 1e9),))
    until(session, lambda: session.now_ns > 30 * S)
    assert headline(session.session, session.now_ns) == ("nothing received from the rover for 30 s", WRONG)
    assert all(row_words(row, session.session.items, session.now_ns)[0] == "?" for row in ROWS)


def test_the_stop_line_tells_not_sent_sent_and_heard_apart():
    session, _ = live(silent=((2.0, 20.0),))
    until(session, lambda: session.now_ns > 3 * S)
    session.line("stop")
    stop = Stop(session.now_ns, session.shell.asked[-1])
    assert "NOT SENT" in stop_words(stop, session.session, session.now_ns)
    until(session, lambda: session.now_ns > 10 * S)
    assert "not confirmed yet" in stop_words(stop, session.session, session.now_ns)
    until(session, lambda: session.shell.settled(session.session))
    words = stop_words(stop, session.session, session.now_ns)
    assert words.startswith("STOP done, confirmed 1") and float(words.split()[3]) > 16.0


def test_the_trail_has_the_places_that_were_reported_and_a_damaged_map_changes_nothing():
    session, view = live()
    until(session, lambda: len(view.trail) > 5)
    assert [place[1] for place in view.trail] == [2.0] * len(view.trail)
    assert all(b[0] - a[0] == pytest.approx(0.5, abs=0.02) for a, b in zip(view.trail, list(view.trail)[1:]))
    view.take([ProductHeard(0, Product(1, "ldem", "ldem-2", b"LDM1 nothing"))], session.session)
    assert view.terrain is None


def test_texts_from_outside_cannot_command_the_terminal():
    session, view = live()
    session._station.rover.event(0, "EVENT", "\x1b[2Jgone")
    until(session, lambda: any("gone" in line.text for line in view.lines))
    assert all(line.text.isprintable() for line in view.lines)


def test_a_verb_that_prints_pages_is_refused_with_what_to_type():
    session, _ = live()
    assert "ground events --last 3" in session.line("events --last 3")[0]


def test_the_view_needs_a_terminal(monkeypatch):
    assert not possible(False, False)  # pytest captures the output
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    assert possible(False, False)
    assert not possible(True, False) and not possible(False, True)
    monkeypatch.setenv("TERM", "dumb")
    assert not possible(False, False)
