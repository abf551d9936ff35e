"""Parts of the terminal view: picture, rows of the state, stop line; nothing old looks fresh."""

import math

import numpy as np
import pytest

from ground.archive.store import Archive
from ground.cli.shell.shell import OperatorShell
from ground.cli.shell.terminal import Live
from ground.cli.watch.command import can_draw
from ground.cli.watch.model import Freshness, PastView, Stop, View, stop_words
from ground.cli.watch.picture import FREE, GOAL, NOTHING, OBSTACLE, TRAIL, Scene, draw, element_of, window
from ground.cli.watch.state import GOOD, ROWS, STALE, WRONG, headline, row_words, state
from ground.cli.watch.terminal import ViewTeller, past_view, refuse_pages
from ground.link.news import Item, ProductHeard
from protocol.link.bulk import Product
from protocol.products import LdemProduct, MapGrid, encode_ldem
from protocol.tables.telemetry import TABLE
from tests.ground.virtual_station import S, VirtualClock, VirtualStation


def live(**station):
    view, made = View(), VirtualStation(**station)
    teller = ViewTeller(view, lambda: made.session)
    return Live(made, VirtualClock(10_000.0), teller, OperatorShell(refuse_pages), lambda *_: None, 0.0), view


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
    frame = window(scene, columns, rows, 0)
    cells = colours(draw(scene, frame, columns, rows), columns)
    assert set(cells) == {(row, column) for row in range(rows) for column in range(columns)}
    for (row, column), (sign, upper, lower) in cells.items():
        assert sign == "▀"
        for half, colour in ((0, upper), (1, lower)):
            x_m = frame.x_m + (column + 0.5 - columns / 2) * frame.element_m
            y_m = frame.y_m - (2 * row + half + 0.5 - rows) * frame.element_m
            inside = -0.2 < x_m < 9.7 and -0.2 < y_m < 9.7
            if inside and abs(x_m - 4.75) > 0.05:
                assert (colour[0] > colour[1]) == (x_m > 4.75)  # the obstacle's orange, the free ground's green
            if not (-0.3 < x_m < 9.8 and -0.3 < y_m < 9.8):
                assert colour == NOTHING
    assert OBSTACLE[0] > OBSTACLE[1] and FREE[1] > FREE[0]


def test_all_that_is_known_lies_within_the_window_and_zoom_follows_the_rover():
    scene = Scene(two_halves(), (30.0, -12.0, 0.0), ((29.0, -12.0),), ((30.0, -12.0), (31.0, 20.0)), (31.0, 20.0))
    frame = window(scene, 60, 20, 0)
    for x_m, y_m in ((0.0, 0.0), (9.5, 9.5), (30.0, -12.0), (31.0, 20.0)):
        row, column = element_of(x_m, y_m, frame, 60, 20)
        assert 0 <= row < 40 and 0 <= column < 60
    near = window(scene, 60, 20, 2)
    assert (near.x_m, near.y_m, near.element_m) == (30.0, -12.0, pytest.approx(frame.element_m / 4))


@pytest.mark.parametrize(("yaw_deg", "arrow"), [(0, "→"), (90, "↑"), (180, "←"), (-90, "↓"), (44, "↗"), (-179, "←")])
def test_the_rover_is_an_arrow_along_its_heading_and_the_goal_a_ring(yaw_deg, arrow):
    scene = Scene(None, (1.0, 2.0, math.radians(yaw_deg)), goal=(5.0, 2.0))
    frame = window(scene, 40, 12, 0)
    cells = colours(draw(scene, frame, 40, 12), 40)
    signs = {sign: (row, column, colour) for (row, column), (sign, colour, _) in cells.items() if sign != "▀"}
    assert signs.keys() == {arrow, "◎"}
    row, column = element_of(1.0, 2.0, frame, 40, 12)
    assert signs[arrow] == (row // 2, column, TRAIL) and signs["◎"][2] == GOAL
    assert signs["◎"][1] > column and signs["◎"][0] == row // 2


def test_a_map_without_any_known_height_and_an_empty_scene_are_drawn():
    unknown = LdemProduct(MapGrid(0.0, 0.0, 0.5, 4, 4), np.full((4, 4), np.nan, np.float32), np.zeros((4, 4), np.uint8))
    for scene in (Scene(), Scene(unknown)):
        assert len(draw(scene, window(scene, 10, 4, 0), 10, 4).plain.splitlines()) == 4


def items(now_s, **values):
    return {name: Item(round(now_s * S), 0, name, value) for name, value in values.items()}


def test_a_value_that_is_stale_is_marked_with_its_age_and_one_that_is_unknown_is_no_number():
    battery = next(row for row in ROWS if row.label == "battery")
    held = items(10.0, voltage_v=27.5, current_a=1.0, charge_ratio=0.9)
    assert row_words(battery, held, Freshness(10 * S)) == ("27.5 V 1.0 A 90 %", GOOD)
    assert row_words(battery, {}, Freshness(10 * S)) == ("?", STALE)
    assert row_words(battery, held, Freshness(60 * S))[1] == STALE
    lines = state(held, Freshness(300 * S), 60, 20).plain.splitlines()
    line = next(line for line in lines if line.startswith("battery"))
    assert line.endswith("5 min")
    half = items(10.0, voltage_v=27.5, current_a=math.nan, charge_ratio=0.9)
    assert row_words(battery, half, Freshness(10 * S))[0] == "27.5 V ? 0.9"


def test_a_value_out_of_limits_is_marked_unless_it_is_stale():
    battery = next(row for row in ROWS if row.label == "battery")
    held = items(10.0, voltage_v=20.0, current_a=1.0, charge_ratio=0.9)
    assert row_words(battery, held, Freshness(10 * S))[1] == WRONG
    assert row_words(battery, held, Freshness(100 * S))[1] == STALE


def test_every_row_shows_known_items_of_the_table_in_any_state_of_knowledge():
    names = {row.name for row in TABLE}
    for row in ROWS:
        assert set(row.items) <= names
        assert row_words(row, items(1.0, **dict.fromkeys(row.items, 1.0)), Freshness(S))[0]
        for name in row.items:
            assert row_words(row, items(1.0, **{name: 1.0}), Freshness(S))[0]


@pytest.mark.parametrize("width", [34, 60])
def test_no_row_is_wider_than_its_pane(width):
    held = items(1.0, **{row.name: 1e6 for row in TABLE if row.name not in ("mode", "phase", "faults")})
    assert all(len(line) <= width for line in state(held, Freshness(400 * S), width, 15).plain.splitlines())


def test_a_silent_rover_is_shown_as_silent_and_none_of_its_values_as_fresh():
    session, view = live(silent=((5.0, 1e9),))
    until(session, lambda: session.now_ns > 4 * S)
    assert headline(session.session, session.now_ns)[1] == GOOD
    until(session, lambda: session.now_ns > 200 * S)
    words, style = headline(session.session, session.now_ns)
    assert "SILENT for 3 min" in words and style == WRONG
    freshness = view.freshness(session.session, session.now_ns)
    assert all(freshness.stale(item) for item in session.session.items.values())


def test_a_rover_that_was_never_heard_is_said_to_be_so():
    session, _ = live(silent=((0.0, 1e9),))
    until(session, lambda: session.now_ns > 30 * S)
    assert headline(session.session, session.now_ns) == ("nothing received from the rover for 30 s", WRONG)
    assert all(row_words(row, session.session.items, Freshness(session.now_ns))[0] == "?" for row in ROWS)


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
    view.receive([ProductHeard(0, Product(1, "ldem", "ldem-2", b"LDM1 nothing"))], session.session)
    assert view.terrain is None


def test_texts_from_outside_cannot_command_the_terminal():
    session, view = live()
    session._station.rover.event(0, "EVENT", "\x1b[2Jgone")
    until(session, lambda: any("gone" in line.text for line in view.lines))
    assert all(line.text.isprintable() for line in view.lines)


def test_a_long_line_is_folded_and_none_of_its_words_is_lost():
    view = View()
    for number in range(5):
        view.add_line(f"{number} " + "word " * 40)
    rows = view.rows(80, 100)
    assert all(len(row.text) <= 80 for row in rows) and " ".join(row.text for row in rows).split().count("word") == 200
    assert view.rows(80, 2) == rows[-2:] and view.rows(80, 0) == []


def test_the_view_starts_with_map_trail_and_events_of_the_archive_and_a_reboot_ends_the_trail(tmp_path):
    path = tmp_path / "archive.db"
    with Archive(str(path), 1_000 * S, "test") as archive:
        archive.add("events", 10 * S, 10 * S, 1, "info", "ARRIVED", "there", 1)
        for second in range(5):
            for name, value in (("x_m", float(second)), ("y_m", -7.0)):
                archive.add("items", second * S, second * S, name, value, 1)
        archive.add("products", 7 * S, 1, "ldem", "ldem-2", encode_ldem(two_halves()))
    past = past_view(str(path), 2_000 * S)
    assert past.terrain is not None and past.terrain_ns == (1_007 - 2_000) * S
    assert past.trail == tuple((float(second), -7.0) for second in range(5)) and past.boot_id == 1
    assert [line.text.split()[2:] for line in past.lines] == [["info", "ARRIVED:", "there"]]
    for boot_id, trail in ((1, past.trail), (2, ())):
        session, view = live(boot_id=boot_id)
        view.load(past)
        until(session, lambda session=session: session.session.boot_id)
        assert tuple(place for place in view.trail if place in past.trail) == trail


def test_the_trail_of_the_archive_stays_until_the_rover_is_heard():
    session, view = live(boot_id=1)
    view.load(PastView(trail=((1.0, 2.0),), boot_id=1))
    assert session.session.boot_id == 0  # a station without a state folder
    view.receive([], session.session)
    assert list(view.trail) == [(1.0, 2.0)]


@pytest.mark.parametrize("content", [None, b"", b"no archive, only words"])
def test_without_a_readable_archive_the_view_starts_empty(content, tmp_path):
    path = tmp_path / "archive.db"
    if content is not None:
        path.write_bytes(content)
    assert past_view(str(path), 0) == PastView() and past_view("", 0) == PastView()


def test_a_verb_that_prints_pages_is_refused_with_what_to_type():
    session, _ = live()
    assert "ground events --last 3" in session.line("events --last 3")[0]


def test_an_age_is_counted_from_the_measurement_on_the_rover_and_includes_the_way_down():
    freshness = Freshness(20 * S, ahead_ns=100 * S, one_way_s=3.0)
    assert freshness.age_s(Item(18 * S, 115 * S, "x_m", 1.0)) == 5.0  # measured at 15 s here, arrived at 18 s
    assert freshness.age_s(Item(18 * S, 119 * S, "x_m", 1.0)) == 2.0  # never less than since its arrival
    assert not freshness.stale(Item(18 * S, 115 * S, "x_m", 1.0))  # the delay alone makes nothing stale
    assert freshness.stale(Item(18 * S, 105 * S, "x_m", 1.0))


def test_the_view_is_drawn_on_a_terminal_only(monkeypatch):
    assert not can_draw()  # pytest captures the output
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    assert can_draw()
    monkeypatch.setenv("TERM", "dumb")
    assert not can_draw()
