"""Tests of missions with a real scanner: broken promises, true reasons, and the places of the goals."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hil.campaign.mission import Watch, outcome_of
from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory
from hil.scenarios.model import Scenario
from hil.terrain.fields import demo_field
from onboard.config import Rover
from tests.scenarios import __main__ as command
from tests.scenarios.goals import fresh, losses, three_goals
from tests.scenarios.goals.flown import HEADS, Row, broken, contact_words, ended, true_reason, with_losses
from tests.scenarios.goals.three_goals import GOALS, clear_m, goals_of, turning_m
from tests.scenarios.registry import CAMPAIGNS

pytestmark = pytest.mark.tool

ARRIVED = Row(101, 1, 0.01, "arrived", 0.02, 0.05, (), 1, (0.03,), 6, 4, 1, 17.0, 300.0, ())
NO_WAY = "goto: no way is left over free or unknown ground"
STOPPED = "goto: the scanner saw too little of the left side"


@pytest.mark.parametrize(("changes", "told"), [
    ({"to_goal_m": 0.31}, "arrived 0.31 m from the goal by truth"),
    ({"outcome": NO_WAY, "to_goal_m": 9.0}, "not for the reason told"),
    ({"outcome": STOPPED, "lost_ratio": 0.0}, "not for the reason told"),
    ({"outcome": NO_WAY, "faults": ("LIDAR_DIRTY: 8 %",)}, "not for the reason told"),
    ({"contacts": ("7.0 s: body", "9.0 s: body")}, "touched 2 times, first 7.0 s: body"),
])  # fmt: skip
def test_each_promise_broken_is_named(changes, told):
    assert broken(ARRIVED) == []
    said = broken(replace(ARRIVED, **changes))
    assert len(said) == 1 and told in said[0] and "seed 101" in said[0]


@pytest.mark.parametrize("row", [
    replace(ARRIVED, outcome=STOPPED), replace(ARRIVED, outcome="goto: held", faults=("LIDAR_DIRTY: 8 % lost",)),
])  # fmt: skip
def test_a_mission_that_stops_because_the_scanner_sees_too_little_keeps_the_promise(row):
    assert true_reason(row) and broken(row) == []


def test_a_pose_over_a_tenth_of_a_metre_off_at_any_goal_falls_short():
    row = replace(ARRIVED, seed=4, goals=3, goal_errors_m=(0.02, 0.11, 0.1))
    assert three_goals.judge([row]) == ["seed 4: the pose is 0.11 m off at goal 2, 0.1 promised"]


def test_losses_has_30_fields_at_each_of_three_shares_and_fresh_the_30_from_101_on():
    assert [divmod(seed, 100) for seed in losses.SEEDS] == [(p, f) for p in (1, 3, 8) for f in range(1, 31)]
    assert tuple(range(101, 131)) == fresh.SEEDS and tuple(range(1, 21)) == three_goals.SEEDS


def test_a_summary_states_arrivals_true_stops_and_contacts_for_each_share_of_lost_beams():
    stopped = replace(ARRIVED, seed=102, outcome=STOPPED, to_goal_m=9.0, max_error_m=0.07)
    wrong = replace(ARRIVED, seed=803, outcome=NO_WAY, contacts=("7.0 s: body",), lost_ratio=0.08)
    one, eight = (dict(zip(HEADS, line, strict=True)) for line in losses.summary([ARRIVED, stopped, wrong]))
    assert (one["missions"], one["flown"], one["at the goal"], one["stopped with the true reason"]) == (
        "1 % lost",
        "2",
        "1",
        "1",
    )
    assert (one["else"], one["contacts"], one["worst pose error, m"]) == ("0", "0", "0.07")
    assert (eight["missions"], eight["at the goal"], eight["else"], eight["contacts"]) == ("8 % lost", "0", "1", "1")


@pytest.mark.parametrize("name", ["losses", "three-goals", "fresh"])
def test_the_page_has_a_place_for_each_summary_and_takes_it_from_a_whole_campaign_only(name, tmp_path, monkeypatch):
    page = tmp_path / "campaigns.md"
    page.write_text(command.PAGE.read_text())
    monkeypatch.setattr(command, "PAGE", page)
    rows = [replace(ARRIVED, seed=seed) for seed in CAMPAIGNS[name].SEEDS]
    before = page.read_text()
    command._put({name: rows[1:]})
    assert page.read_text() == before
    command._put({name: rows})
    after = page.read_text()
    assert CAMPAIGNS[name].summary(rows)[0][0] in after[after.index(f"<!-- begin {name}") :]


@pytest.mark.parametrize("seed", [1, 7])
def test_goals_are_the_same_each_time_apart_inside_and_with_room_to_turn(seed):
    field = demo_field(seed).field
    goals = goals_of(field, seed)
    assert goals == goals_of(field, seed) and len(goals) == GOALS
    assert goals != goals_of(field, seed + 1)
    low = np.array([field.grid.x0_m, field.grid.y0_m]) + 1.5
    high = low + field.grid.cell_m * (np.array([field.grid.columns, field.grid.rows]) - 1) - 3.0
    at = (field.start.x_m, field.start.y_m)
    for goal in goals:
        assert (low <= goal).all() and (goal <= high).all()
        assert 3.0 <= math.dist(at, goal) <= 9.0
        assert clear_m(field, *goal) >= turning_m(Rover()) + 0.1
        at = goal


def test_a_turning_rover_reaches_half_a_metre_by_its_tyres():
    assert turning_m(Rover()) == pytest.approx(0.500, abs=0.005)


@pytest.mark.parametrize("contact", [(7.04, "body"), SimpleNamespace(begin_s=7.04, what="body")])
def test_a_contact_is_told_by_when_and_what(contact):
    assert contact_words(contact) == "7.0 s: body"


def test_a_row_is_of_the_bench_that_flew_with_its_losses_and_contacts():
    bench = with_losses(InMemory(Scenario(terrain="flat", seed=5), step_ns=CAMPAIGN_STEP_NS), 0.03)
    watch = Watch()
    for _ in range(5):
        bench.step(watch)
    bench.truth.contacts.append((0.04, "wheel 1 on a rock of 0.12 m"))
    row = ended(bench, watch, 305, bench.field.goal_m, outcome_of(bench))
    bench.free()
    assert (row.seed, row.field, row.lost_ratio, row.mission_s) == (305, 5, 0.03, 0.05)
    assert row.to_goal_m == pytest.approx(math.dist((5.0, 0.5), (0.0, 0.0)), abs=0.01)
    assert row.contacts == ("0.0 s: wheel 1 on a rock of 0.12 m",)
    assert watch.error_m < 0.01
