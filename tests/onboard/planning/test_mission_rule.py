"""The mission rule, rule by rule, over plain data."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard.config import Mission
from onboard.planning import mission_rule as rule
from onboard.planning.mission_rule import Again, MissionState, Nearest, Option, Situation, Stop
from onboard.records import Path

MISSION = Mission()
HERE = Stop(0.0, 0.0, 0.0)


def option(x, y, heading=0.0, target=None):
    path = Path(np.array([[0.0, 0.0, 0.0], [x, y, 0.0]]))
    return Option(Stop(x, y, heading), path, 5.0, target)


def situation(**changes):
    return replace(Situation(HERE, (6.0, 0.0), Nearest(2.0, 0.0, 4.0, 17)), **changes)


def first_stop():
    return rule.arrive(MissionState(), HERE, 6.0)


def test_r1_scans_ahead_and_behind_at_the_first_stop_only():
    assert rule.scan_headings(MissionState()) == (0.0, math.pi)
    state = first_stop()
    assert rule.scan_headings(state) == (0.0,)
    assert [s.heading_rad for s in state.stops] == [0.0, math.pi]
    assert [s.heading_rad for s in rule.arrive(MissionState(number=1), HERE).stops] == [0.0]


def test_r4_drives_to_a_reachable_goal_pose_before_anything_else():
    asked = situation(terminal=option(6.0, 0.1), commit=option(3.0, 0.0, target=(3.1, 0.0)))
    decision, _ = rule.decide(first_stop(), asked, MISSION)
    assert (decision.kind, decision.rule) == ("goal", "R4")
    assert decision.path is asked.terminal.path
    assert "6.00 m" in decision.reason


def test_r4_says_arrived_when_no_nearer_pose_is_free():
    near = Stop(5.8, 0.0, 0.0)
    stay = Option(near, Path(np.array([near])), 0.0)
    for terminal in (stay, None):
        decision, _ = rule.decide(first_stop(), situation(pose=near, terminal=terminal), MISSION)
        assert (decision.kind, decision.rule) == ("arrived", "R4")


def test_r4_goes_on_to_the_nearest_pose_from_the_rim_of_the_disc():
    rim = Stop(5.75, 0.0, 0.0)
    onward = Option(Stop(6.0, 0.0, 0.0), Path(np.array([[5.75, 0, 0], [6.0, 0, 0]])), 0.25)
    decision, _ = rule.decide(first_stop(), situation(pose=rim, terminal=onward), MISSION)
    assert decision.kind == "goal"


def test_r4_a_pose_at_the_rim_waits_while_a_commit_may_show_a_nearer_one():
    asked = situation(terminal=option(5.75, 0.0), commit=option(5.0, 0.0, target=(5.9, 0.0)))
    decision, state = rule.decide(first_stop(), asked, MISSION)
    assert decision.rule == "R5"
    state = rule.arrive(state, asked.commit.stop, 1.0)
    assert rule.decide(state, asked, MISSION)[0].rule == "R4"


def test_r5_commits_to_the_last_free_pose_and_looks_at_the_first_that_is_not():
    commit = option(3.0, 0.0, 0.4, target=(3.1, 0.0))
    decision, state = rule.decide(first_stop(), situation(commit=commit), MISSION)
    assert (decision.kind, decision.rule, decision.heading_rad) == ("drive", "R5", 0.4)
    assert decision.data["target_m"] == (3.1, 0.0)
    assert state == replace(first_stop(), targets=((3.1, 0.0),))


def test_r5_same_place_with_another_heading_is_no_repeat():
    state = first_stop()
    assert rule.repeats(state, Stop(0.05, 0.05, math.radians(9)))
    assert not rule.repeats(state, Stop(0.05, 0.05, math.radians(11)))
    assert not rule.repeats(state, Stop(0.2, 0.0, 0.0))
    assert rule.repeats(state, Stop(0.0, 0.0, -math.radians(175)))


def test_r6_a_repeat_goes_to_two_viewpoints_and_then_marks_the_target():
    state, repeat = first_stop(), option(0.0, 0.0, 0.0, target=(0.4, 0.0))
    for n in range(2):
        asked = situation(commit=repeat, viewpoint=option(1.0 + n, 1.0, 0.5))
        decision, state = rule.decide(state, asked, MISSION)
        assert (decision.kind, decision.rule) == ("drive", "R6")
    outcome, state = rule.decide(state, asked, MISSION)
    assert isinstance(outcome, Again)
    assert state.marked == ((0.4, 0.0),)
    assert rule.tries_left(state, (0.4, 0.0)) == 0
    assert rule.tries_left(state, (1.4, 0.0)) == 2


def test_r6_a_target_is_not_looked_at_a_third_time():
    state = first_stop()
    for n in range(3):
        commit = option(1.0 + n, 0.0, 0.0, target=(5.0 + 0.1 * n, 0.0))
        outcome, state = rule.decide(state, situation(commit=commit), MISSION)
        assert isinstance(outcome, Again) == (n == 2)


def test_r6_without_a_viewpoint_marks_at_once():
    outcome, _ = rule.decide(first_stop(), situation(commit=option(0.0, 0.0, 0.0, target=(0.4, 0.0))), MISSION)
    assert isinstance(outcome, Again)


def test_r7_looks_at_blocked_ground_seen_from_afar_before_giving_up():
    confirm = option(2.0, 1.0, 0.5, target=(2.2, 1.2))
    decision, state = rule.decide(first_stop(), situation(confirm=confirm), MISSION)
    assert (decision.kind, decision.rule) == ("drive", "R7")
    assert state.targets == ((2.2, 1.2),)


def test_r8_clears_the_marks_once():
    state = replace(first_stop(), marked=((0.4, 0.0),), targets=((0.4, 0.0),))
    outcome, state = rule.decide(state, situation(), MISSION)
    assert (outcome.rule, state.marked, state.targets, state.cleared) == ("R8", (), (), True)
    decision, _ = rule.decide(replace(state, marked=((0.4, 0.0),)), situation(), MISSION)
    assert decision.rule == "R9"


def test_r9_reports_the_nearest_reachable_pose():
    decision, _ = rule.decide(first_stop(), situation(), MISSION)
    assert (decision.kind, decision.rule) == ("unreachable", "R9")
    assert decision.data["nearest_m"] == (2.0, 0.0)
    assert "4.00 m from the goal" in decision.reason


def test_r10_lets_the_strategy_choose_only_while_the_record_falls():
    asked = situation(choice=option(1.0, 2.0), commit=option(3.0, 0.0, target=(3.1, 0.0)))
    state = first_stop()
    assert rule.decide(state, asked, MISSION)[0].rule == "R10"
    state = rule.arrive(state, Stop(1.0, 1.0, 0.0), 5.9)
    assert rule.decide(state, asked, MISSION)[0].rule == "R10"
    state = rule.arrive(state, Stop(1.5, 1.0, 0.0), 5.8)
    assert rule.decide(state, asked, MISSION)[0].rule == "R5"
    state = rule.arrive(state, Stop(3.0, 0.0, 1.0), 3.0)
    assert rule.decide(state, asked, MISSION)[0].rule == "R10"
    state = rule.arrive(state, Stop(1.0, 2.0, 0.0), 2.0)
    assert rule.decide(state, asked, MISSION)[0].rule == "R5"  # that stop was made


def test_without_the_guard_the_strategy_chooses_at_every_stop_until_the_limit_ends_it():
    loose = Mission(guard=False, stop_limit=3)
    asked = situation(choice=option(0.0, 0.0), commit=option(3.0, 0.0, target=(3.1, 0.0)))
    state = first_stop()
    for _ in range(2):
        decision, state = rule.decide(state, asked, loose)
        assert (decision.kind, decision.rule) == ("drive", "R10")
        state = rule.arrive(state, HERE, 6.0)
    assert rule.decide(state, asked, loose)[0].rule == "R10"
    assert rule.decide(rule.arrive(state, HERE, 6.0), asked, loose)[0].kind == "unreachable"


def test_a_mission_ends_at_its_stop_limit():
    state = replace(first_stop(), number=MISSION.stop_limit + 1)
    decision, _ = rule.decide(state, situation(commit=option(3.0, 0.0, target=(3.1, 0.0))), MISSION)
    assert decision.kind == "unreachable"
    assert "stop_limit" in decision.reason


@pytest.mark.parametrize("kind", ["goal", "commit", "nothing"])
def test_every_decision_has_a_rule_a_reason_and_a_path(kind):
    asked = {
        "goal": situation(terminal=option(6.0, 0.0)),
        "commit": situation(commit=option(3.0, 0.0)),
        "nothing": situation(),
    }[kind]
    decision, _ = rule.decide(first_stop(), asked, MISSION)
    assert decision.rule.startswith("R")
    assert len(decision.reason) > 20
    assert len(decision.path.stations) >= 1


def test_a_free_way_that_never_arrives_is_given_up_at_twice_the_stop_limit():
    mission, far = replace(MISSION, stop_limit=3), situation(terminal=option(6.0, 0.0))
    assert rule.decide(MissionState(number=6), far, mission)[0].kind == "goal"
    ended, _ = rule.decide(MissionState(number=7), far, mission)
    assert (ended.kind, ended.rule) == ("unreachable", "R9")


def test_within_the_tolerance_the_stop_limit_is_an_arrival():
    near = situation(pose=Stop(5.8, 0.0, 0.0), terminal=option(6.0, 0.0))
    ended, _ = rule.decide(MissionState(number=4), near, replace(MISSION, stop_limit=3))
    assert (ended.kind, ended.rule) == ("arrived", "R4")
