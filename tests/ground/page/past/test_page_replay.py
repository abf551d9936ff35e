"""Past runs of the page: what was known at an instant, and nothing later; fences of the rover's text."""

import json

import pytest

from ground.archive.schema import open_checked
from ground.page.map.drawn import tree_of
from ground.page.past.replay import Replay
from ground.page.view.model import view
from protocol import WireError

S = 1_000_000_000
UTC_NS = 1_700_000_000 * S


@pytest.fixture
def replay(tmp_path):
    """Two runs; the rover drives east at 1 m/s from second 1 to 9, its clock 5 s behind; a command ends at second 6."""
    path = tmp_path / "archive.db"
    db = open_checked(path)
    db.executemany("insert into runs (run, utc_ns, note) values (?, ?, ?)", [(1, UTC_NS, "first"), (2, 2 * UTC_NS, "")])
    put = "insert into items (run, at_ns, onboard_ns, name, value, boot_id, filled) values (?, ?, ?, ?, ?, 7, ?)"
    for n in range(1, 10):
        rows = [("mode", 1.0), ("x_m", float(n)), ("y_m", 0.0)]
        db.executemany(put, [(1, n * S, (n - 5) * S, name, value, None) for name, value in rows])
        db.execute(put, (2, n * S, n * S, "mode", 2.0, None))
    db.execute(put, (1, 3 * S + 1, 0, "voltage_v", 28.0, 1))  # filled in later
    db.execute(
        "insert into requests (run, at_ns, request_id, station, name, arguments) values (1, ?, 11, 1, ?, ?)",
        (2 * S, "goto", json.dumps({"x_m": 9.0, "y_m": 0.0})),
    )
    for at_s, serial, state in ((3, 1, "ACCEPTED"), (6, 2, "COMPLETED")):
        db.execute(
            "insert into reports (run, at_ns, request_id, station, serial, state, code, text, data) values "
            "(1, ?, 11, 1, ?, ?, 0, '', '[]')",
            (at_s * S, serial, state),
        )
    db.commit()
    db.close()
    return Replay(path)


def test_the_runs_are_listed_the_newest_first(replay):
    assert [(row.run, row.note, row.first_ns, row.last_ns) for row in replay.runs()] == [
        (2, "", S, 9 * S),
        (1, "first", S, 9 * S),
    ]


@pytest.mark.parametrize(
    ("at_s", "x_m", "state"),
    [(1.5, 1.0, None), (2.5, 2.0, "REQUESTED"), (4.5, 4.0, "ACCEPTED"), (9.0, 9.0, "COMPLETED")],
)
def test_an_instant_has_what_was_known_then_and_nothing_later(replay, at_s, x_m, state):
    found = replay.at(replay.runs()[1], round(at_s * S))
    tree = view(found.shot, 0)
    assert tree["pose"]["x_m"] == x_m and len(found.trail_m) == int(at_s) and found.shot.boot_id == 7
    assert [row["state"] for row in tree["commands"]] == ([] if state is None else [state])
    assert tree["values"]["voltage_v"]["text"] == "–"
    assert replay.series(replay.runs()[1], "x_m", round(at_s * S))[-1].tolist() == [UTC_NS / 1e9 + int(at_s), x_m]


def test_a_value_is_as_old_as_it_was_at_that_instant(replay):
    tree = view(replay.at(replay.runs()[1], round(9.5 * S)).shot, 0)
    assert tree["now_s"] - tree["values"]["x_m"]["at_s"] == pytest.approx(0.5)


def test_without_an_archive_there_is_no_run_and_no_picture(tmp_path, replay):
    assert Replay(None).runs() == Replay(tmp_path / "none.db").runs() == []
    with pytest.raises(LookupError):
        replay.picture(5, "height", 0.0)


def test_fences_are_read_from_the_rovers_answer():
    found = tree_of("fences", b"pit keep_out 2 1 4 1 4 3\nsite goal 0 0 9 0 9 9 0 9", 5 * S)
    assert [(one["name"], one["kind"], len(one["corners"])) for one in found["fences"]] == [
        ("pit", "keep_out", 3),
        ("site", "goal", 4),
    ]
    assert found["utc_s"] == 5.0 and tree_of("fences", b"none", 0)["fences"] == []


@pytest.mark.parametrize(
    "text",
    [
        b"pit",
        b"pit keep_out 2 1 4 1",
        b"pit wall 1 1 2 2 3 3",
        b"pit goal 1 1 2 2 3 nan",
        b"pit goal 1 1 2 2 3",
        b"\xff",
    ],
)
def test_damaged_fences_are_refused(text):
    with pytest.raises(WireError):
        tree_of("fences", text, 0)
