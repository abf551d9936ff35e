"""Tests of the campaigns: they are complete, and their command reports the results."""

import json
from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from tests.scenarios import __main__ as command
from tests.scenarios import calibrate, nominal, registry
from tests.scenarios.registry import CAMPAIGNS

pytestmark = pytest.mark.tool

ARRIVED = nominal.Row(4, "arrived", 0.02, 16.9, 5, (), (), 312.4)


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_a_campaign_has_a_title_and_its_short_part_is_a_part(name):
    campaign = CAMPAIGNS[name]
    assert campaign.__doc__.strip()
    assert campaign.SHORT and set(campaign.SHORT) <= set(campaign.SEEDS)
    assert len(set(campaign.SEEDS)) == len(campaign.SEEDS)


@pytest.mark.parametrize(("broken", "told"), [
    ({"outcome": "no pose at the goal is free"}, "seed 4: no pose at the goal is free, 0.02 m from the goal"),
    ({"to_goal_m": 0.31}, "seed 4: arrived, 0.31 m from the goal"),
    ({"contacts": ("7.0 s: body", "9.0 s: body")}, "seed 4 touched 2 times, first 7.0 s: body"),
    ({"faults": ("IMU_DEAD: no sample",)}, "seed 4 raised IMU_DEAD: no sample"),
])  # fmt: skip
def test_nominal_falls_short_by_each_of_its_promises_alone(broken, told):
    assert nominal.judge([ARRIVED]) == []
    assert nominal.judge([ARRIVED, replace(ARRIVED, **broken)]) == [told]


@pytest.mark.parametrize(("broken", "told"), [
    ({"outcome": "WHEEL_2 went silent 210 ms ago"}, "seed 4: WHEEL_2 went silent 210 ms ago"),
    ({"steer_difference_deg": 0.6}, "seed 4: steer_difference_deg is 0.6, at most 0.5"),
    ({"way_built_mm": 2.5}, "seed 4: odometry is 5.0 mm off, at best 2.5"),
    ({"way_before_mm": 6.25}, "odometry over all 1 is 0.80 of what it was off"),
])  # fmt: skip
def test_calibrate_falls_short_by_each_of_its_promises_alone(broken, told):
    row = calibrate.Row(4, "calibrated", way_before_mm=10.0, way_after_mm=5.0, way_built_mm=4.5)
    assert calibrate.judge([row]) == []
    assert calibrate.judge([replace(row, **broken)]) == [told]


@dataclass(frozen=True, slots=True)
class Square:
    seed: int
    square: int
    words: tuple[str, ...] = ()


@pytest.fixture
def squares(monkeypatch):
    """A campaign that fails for a square over 9."""
    made = SimpleNamespace(
        __doc__="Squares stay small.\n\nMore.",
        SEEDS=(1, 2, 3),
        SHORT=(2,),
        fly=lambda seed: Square(seed, seed * seed),
        judge=lambda rows: [f"seed {row.seed}: {row.square}" for row in rows if row.square > 9],
    )
    for module in (command, registry):
        monkeypatch.setattr(module, "CAMPAIGNS", {"squares": made})
    monkeypatch.setattr(command, "RENEWED", 0)  # a worker that imports the registry again would not know it


def asked(folder, *words):
    return CliRunner().invoke(command.app, [*words, "--workers", "1", "--out", str(folder)])


def written(folder):
    return [row["square"] for row in json.loads((folder / "squares.json").read_text())]


@pytest.mark.parametrize(("words", "found"), [
    ((), [1, 4, 9]), (("squares",), [1, 4, 9]), (("--short",), [4]), (("squares", "--seeds", "3,1"), [1, 9]),
])  # fmt: skip
def test_rows_of_the_seeds_asked_for_are_shown_and_written(squares, tmp_path, words, found):
    said = asked(tmp_path, *words)
    assert said.exit_code == 0
    assert "squares: Squares stay small." in said.stdout
    assert written(tmp_path) == found


def test_a_broken_promise_is_told_and_is_the_exit_code(squares, tmp_path):
    said = asked(tmp_path, "squares", "--seeds", "3-5")
    assert said.exit_code == 1
    told = [line for line in said.output.splitlines() if line.startswith("falls short")]
    assert told == ["falls short: squares: seed 4: 16", "falls short: squares: seed 5: 25"]


def test_json_is_all_that_stands_on_standard_output(squares, tmp_path):
    said = asked(tmp_path, "squares", "--json")
    assert json.loads(said.stdout)["squares"][2] == {"seed": 3, "square": 9, "words": []}


def test_what_was_flown_before_ctrl_c_is_written(squares, tmp_path, monkeypatch):
    def interrupted(fly, runs, workers, renewed):
        yield fly(runs[0], 2)
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "fly_all", interrupted)
    said = asked(tmp_path)
    assert said.exit_code == 130 and "stopped after 1 of 3 flights" in said.output
    assert written(tmp_path) == [4]


def test_an_unknown_campaign_is_answered_with_those_there_are(squares, tmp_path):
    said = asked(tmp_path, "cubes")
    assert said.exit_code == 2 and "expected one of squares" in said.output
