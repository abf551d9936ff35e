"""Tests of the campaign's table, and of the check against the promise."""

import json
import math
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from onboard.planning.sensing.strategies import STRATEGIES
from tests.missions import __main__ as command
from tests.missions.__main__ import runs
from tests.missions.campaign import Row, Run, config_of, summary
from tests.missions.guard import guard_runs, open_loop
from tests.missions.mission import Errors
from tests.missions.promise import PROMISES, markdown, shortfalls
from tests.missions.world.drift import Drift

GOOD = Row("optimistic", 1, "main", True, 10.0, "arrived", "", 3, 4, 10.2, 1.02, 0.05, 0, 0, 0, 0, "R5 R5 R4")


def rows(**changes):
    return [replace(GOOD, seed=seed, **(changes if seed == 1 else {})) for seed in range(1, 6)]


def test_a_good_run_breaks_no_promise():
    assert shortfalls([summary("optimistic", rows())]) == []


@pytest.mark.parametrize(
    ("name", "changes", "text"),
    [
        ("optimistic", {"outcome": "unreachable"}, "reached 4 of 5 reachable goals"),
        ("optimistic", {"hard": 2}, "1 missions with a hard contact"),
        ("visibility, unguarded", {"unseen": 2}, "1 missions with a wheel on ground that nobody had seen"),
        ("optimistic", {"ratio": 9.0}, "p90 of way / optimum"),
        ("optimistic", {"outcome": "endless", "reachable": False}, "1 endless"),
        ("explore, guarded", {"outcome": "endless"}, "1 endless"),
        ("pose error 5 cm + 1 deg", {"outcome": "unreachable"}, "reached 4 of 5"),
        ("legs of 4 m, as flown", {"on_rocks": 2}, "1 missions with a wheel on a rock"),
        ("U-traps", {"reachable": False}, "only 4 of 5 goals are reachable"),
        ("ringed goals", {}, "reported 0 of 5 goals unreachable"),
    ],
)
def test_each_promise_broken_is_named(name, changes, text):
    assert any(text in line for line in shortfalls([summary(name, rows(**changes))]))


GUARDED = guard_runs.GuardRow(guard_runs.GUARD.name, 1, "arrived", 3, 4, 10.0, 0, 0, 0, 1, 0)
TRUSTED = replace(GUARDED, run=guard_runs.TRUST.name, scans=9, guard_stops=0)
SMOOTH = replace(GUARDED, run=guard_runs.SMOOTH.name)
WRONG = replace(GUARDED, run=guard_runs.WRONG.name)


def test_guarded_missions_without_a_wheel_in_a_hole_and_with_fewer_scans_break_no_promise():
    assert guard_runs.shortfalls([GUARDED, TRUSTED, replace(TRUSTED, in_hole=1), SMOOTH, WRONG]) == []


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        ([replace(GUARDED, in_hole=1)], "a wheel entered a hole"),
        ([replace(GUARDED, unseen=1)], "ground that nobody had seen"),
        ([replace(SMOOTH, outcome="endless")], "endless"),
        ([GUARDED, replace(WRONG, hard=1)], "a hard contact with wrong ranges"),
        ([GUARDED, replace(WRONG, outcome="unreachable")], "0 arrived with wrong ranges, 1 without"),
        ([GUARDED, replace(TRUSTED, scans=3)], "4 scans with the guard, 3 with the trust range alone"),
        ([replace(SMOOTH, guard_stops=3)], "too many guard stops on smooth fields"),
    ],
)
def test_each_promise_of_the_guard_broken_is_named(rows, text):
    assert any(text in line for line in guard_runs.shortfalls(rows))


def test_of_200_objects_two_may_be_missed():
    seen = open_loop.Outcome(1, True, True, 0.5, 0, 4.0)
    unmet, missed = replace(seen, met=False, lead_m=math.nan), replace(seen, lead_m=0.05)
    assert open_loop.shortfalls([seen] * 198 + [missed] * 2 + [unmet] * 50) == []
    assert open_loop.shortfalls([seen] * 197 + [missed] * 3) == ["3 of 200 objects were missed"]


def test_an_unguarded_run_may_be_endless():
    assert shortfalls([summary("visibility, unguarded", rows(outcome="endless"))]) == []


def test_sixty_fields_of_which_few_are_reachable_fall_short():
    many = [replace(GOOD, seed=seed, reachable=seed > 30) for seed in range(1, 61)]
    assert "optimistic: only 30 of 60 goals are reachable" in shortfalls([summary("optimistic", many)])


def test_every_promise_is_of_a_run_that_is_flown():
    assert set(PROMISES) <= {run.name for run in runs(fresh=1000)}


def test_a_row_comes_back_from_its_file():
    lost = replace(GOOD, outcome="unreachable", ratio=math.nan)
    assert Row.of_json(GOOD.as_json()) == GOOD
    assert math.isnan(Row.of_json(lost.as_json()).ratio)


def test_the_table_has_a_row_for_each_run():
    lines = markdown([summary("optimistic", rows()), summary("ringed goals", [])]).splitlines()
    assert lines[2] == "| optimistic | 5 | 5 / 5 | 0 | 0 | 0 | 3 / 3 / 3 | 1.02 / 1.02 / 1.02 | 0 | 0 | 0 | 0 |"
    assert lines[3] == "| ringed goals | 0 | 0 / 0 | 0 | 0 | 0 | - | - | 0 | 0 | 0 | 0 |"


def flown(run: Run, seed: int) -> Row:
    return replace(GOOD, run=run.name, seed=seed)


def test_what_was_flown_before_a_ctrl_c_is_on_disk(tmp_path, monkeypatch):
    def interrupted(fly, chosen, workers):
        for seed in (2, 1):
            yield flown(chosen[0], seed)
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "fly_all", interrupted)
    result = CliRunner().invoke(command.app, ["fly", "--run", "ringed", "--out", str(tmp_path)])
    assert result.exit_code == 130
    assert "2 of 12: ringed goals, seed 1: arrived after 3 stops, 10.2 m" in result.output
    assert [row["seed"] for row in json.loads((tmp_path / "missions.json").read_text())] == [1, 2]
    assert "| ringed goals | 2 |" in (tmp_path / "table.md").read_text()


def test_the_campaign_flies_what_was_promised():
    flown = {run.name: run for run in runs(fresh=1000)}
    sixty = {
        "optimistic",
        "pose error 5 cm + 1 deg",
        "legs of 4 m, as flown",
        "explore, guarded",
        "visibility, guarded",
        "visibility, unguarded",
        "hill-climb, guarded",
        "hill-climb, unguarded",
    }
    assert all((flown[name].fields, flown[name].seeds) == ("main", tuple(range(1, 61))) for name in sixty)
    assert flown["optimistic, fresh seeds"].seeds == tuple(range(1000, 1060))
    others = {name: (run.fields, len(run.seeds)) for name, run in flown.items() if run.fields != "main"}
    assert others == {
        "U-traps": ("trap", 8),
        "ringed goals": ("ring", 12),
        "36 to 42 m": ("far", 4),
        "36 to 42 m, map from orbit": ("far", 4),
        "demo fields 101 to 130, as flown": ("demo", 30),
    }
    assert set(flown) == sixty | set(others) | {"optimistic, fresh seeds"}
    for name, run in flown.items():
        mission = config_of(run).mission
        first = name.split(",")[0]
        assert mission.strategy == (first if first in STRATEGIES else "optimistic")
        assert mission.guard == ("unguarded" not in name)
    assert flown["pose error 5 cm + 1 deg"].errors == Errors(0.05, math.radians(1.0))
    as_flown = flown["legs of 4 m, as flown"]
    assert (as_flown.errors, as_flown.drift) == (Errors(0.02, math.radians(0.3)), Drift(way_ratio=0.015))
    assert flown["36 to 42 m, map from orbit"].orbit_cell_m == 2.0
