"""The answer to lost beams by degrees, and the true reason where a mission ends for want of sight."""

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from onboard import config
from onboard.core.mission.beam_loss import LEVELS, Seeing, next_level, slower
from onboard.perception.scan.sweep import line_angles, segments
from onboard.planning import cycle
from onboard.planning.cycle import plan
from onboard.planning.mission_rule import MissionState
from onboard.planning.plan_records import PlanResult
from onboard.records import Decision, Path, Pose
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode, Phase
from tests.onboard.core_bench import CoreBench, first_map, quick
from tests.onboard.loss_rig import CONFIG, at_random, clumps, counted, dark, nothing, window

LIMITS = config.LostBeams()
RATIOS = (0.0, LIMITS.slow_ratio, LIMITS.second_ratio, LIMITS.short_ratio, LIMITS.stop_ratio)
START = Pose(0.0, 0.0)
NO_WAY = "no way is left over free or unknown ground; nearest reachable pose (1.00, 0.00), 5.00 m from the goal"


# -- the levels --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", range(len(LEVELS)))
def test_the_level_of_a_share_is_the_row_whose_limit_it_passes(level):
    assert next_level(0, RATIOS[level] + 0.001, LIMITS) == level
    if level:
        assert next_level(0, RATIOS[level] - 0.001, LIMITS) == level - 1


def test_the_level_rises_at_once_and_falls_by_one_with_each_better_sweep():
    levels, level = [], 0
    for ratio in (0.5, 0.01, 0.01, 0.01, 0.25, 0.22, 0.01):
        level = next_level(level, ratio, LIMITS)
        levels.append(level)
    assert levels == [4, 3, 2, 1, 3, 3, 2]


def test_each_row_s_answer_holds_those_of_the_rows_above():
    for before, row in pairwise(LEVELS):
        assert (row.slow, row.sweeps, row.short, row.stop) >= (before.slow, before.sweeps, before.short, before.stop)
    assert [row.sweeps for row in LEVELS] == [1, 1, 2, 2, 2] and LEVELS[-1].stop


@pytest.mark.parametrize(
    ("ratio", "level"), [(0.0, 0), (0.01, 0), (0.03, 0), (0.08, 1), (0.17, 2), (0.25, 3), (0.4, 4)]
)
@pytest.mark.parametrize("kind", [at_random, clumps])
def test_sweeps_that_lose_so_much_are_answered_so(kind, ratio, level):
    seeing = Seeing(CONFIG)
    seeing.note(counted(kind(ratio / 0.94 if kind is clumps and ratio > 0.2 else ratio)), START)
    assert abs(seeing.level - level) <= (kind is clumps and ratio > 0.03)  # clumps overlap: fewer are lost than asked
    assert bool(seeing.note(counted(nothing), START)) is (level > 0)


def test_a_sweep_at_half_the_rate_has_twice_the_lines_and_is_one_that_the_axis_can_do():
    usual, slow = (sum(p.duration_ns for p in segments(s, 0.7)) for s in (CONFIG.scanning, slower(CONFIG)))
    assert slow == pytest.approx(2 * usual, rel=0.03)
    lines = [len(line_angles(s, 0.7)) for s in (CONFIG.scanning, slower(CONFIG))]
    assert lines[1] == pytest.approx(2 * lines[0], rel=0.05)
    assert len(segments(slower(CONFIG), 0.7)) <= 24


def test_a_bad_sweep_is_followed_by_one_more_from_its_place_and_by_no_third():
    seeing = Seeing(CONFIG)
    for _ in range(3):  # places
        seeing.note(counted(at_random(0.17)), START)
        assert seeing.sweep_again()
        seeing.note(counted(at_random(0.17, 2)), START)
        assert not seeing.sweep_again() and not seeing.ended()


def test_legs_and_trusted_range_are_short_at_the_third_level_only():
    seeing = Seeing(CONFIG)
    assert seeing.config is CONFIG
    seeing.note(counted(at_random(0.25)), START)
    assert (seeing.config.mission.leg_m, seeing.config.scanning.range_m) == (LIMITS.short_leg_m, LIMITS.short_range_m)
    seeing.note(counted(nothing), START)
    assert seeing.config is CONFIG


def test_a_mission_ends_where_both_sweeps_of_a_place_lose_too_much_and_not_where_the_second_is_better():
    for second, ends in ((0.5, True), (0.2, False)):
        seeing = Seeing(CONFIG)
        for ratio in (0.5, second):
            seeing.note(counted(at_random(ratio)), START)
            again = seeing.sweep_again()
        assert not again and bool(seeing.ended()) is ends
        assert ("the scanner goes blind" in seeing.dirty and "50 %" in seeing.dirty) is ends


def test_dark_ground_close_before_the_rover_does_not_end_the_mission():
    seeing = Seeing(CONFIG)
    for x_m in (0.0, 1.8, 1.8):
        at = Pose(x_m, 0.0)
        seeing.note(counted(dark(3.9, 0.0, 1.6), at), at)
    assert seeing.row.stop and not seeing.ended()


# -- the end of a mission by the rule ----------------------------------------------------------------------------


def given_up(goal_m=(6.0, 0.0), **state):
    stay = Path(np.zeros((1, 3)))
    return PlanResult(
        Decision("unreachable", "R9", NO_WAY, stay, 0.0), MissionState(**state), SimpleNamespace(), START, goal_m
    )


def seen(*losses):
    seeing = Seeing(CONFIG)
    for lost in losses:
        seeing.note(counted(lost), START)
    return seeing


def test_no_way_is_left_stays_the_reason_where_the_scanner_saw_the_side():
    for seeing in (seen(clumps(0.08)), seen(window(30, 60)), Seeing(CONFIG)):
        result = given_up()
        assert seeing.judged(result, START) is result and not seeing.dirty


def test_where_it_did_not_it_looks_again_towards_it_so_often_and_then_tells_share_and_direction():
    seeing, marks = seen(window(30, 60)), ((1.0, 1.0),)
    result = given_up((5.0, 5.0), marked=marks, targets=marks)
    for look in range(1, LIMITS.looks + 1):
        again = seeing.judged(result, START)
        assert (again.decision.kind, again.decision.rule, again.decision.path.length_m) == ("drive", "R11", 0.0)
        assert again.decision.heading_rad == pytest.approx(math.radians(45))
        assert (again.state.marked, again.state.targets) == ((), ()) and f"look {look} of" in again.decision.reason
        assert seeing.row.slow and seeing.row.sweeps == 2 and not seeing.dirty
    ended = seeing.judged(result, START).decision
    assert ended.kind == "unreachable" and "no way is left" not in ended.reason
    assert "saw too little" in ended.reason and "+45 degrees" in ended.reason and "nearest" in ended.reason
    share = float(ended.reason.split(" % ")[0].split()[-1])
    assert 80 <= share <= 100
    assert "saw too little" in seeing.dirty


def test_a_look_that_shows_the_side_leaves_the_rule_s_own_reason():
    seeing, result = seen(window(30, 60)), given_up((5.0, 5.0))
    assert seeing.judged(result, START).decision.rule == "R11"
    turned = Pose(0.0, 0.0, yaw_rad=math.radians(45))
    seeing.note(counted(window(30, 60), turned), turned)
    assert seeing.judged(result, turned) is result and not seeing.dirty


def test_at_the_limit_of_stops_it_does_not_look_again_and_tells_both():
    seeing, limit = seen(window(-10, 10)), CONFIG.mission.stop_limit
    ended = seeing.judged(given_up(number=limit + 1), START).decision
    assert seeing.looks == 0 and ended.kind == "unreachable"
    assert "saw too little" in ended.reason and f"{limit} stops are the limit" in ended.reason


def test_ground_that_was_looked_at_in_vain_counts_though_the_goal_lies_elsewhere():
    seeing = seen(dark(3.5, -1.5, 0.9))
    assert seeing.judged(given_up((0.0, 6.0)), START).decision.kind == "unreachable"
    again = seeing.judged(given_up((0.0, 6.0), marked=((3.5, -1.5),)), START).decision
    assert again.kind == "drive" and again.heading_rad == pytest.approx(math.atan2(-1.5, 3.5))


def test_any_other_decision_is_left_alone():
    seeing = seen(at_random(0.25))
    result = replace(given_up(), decision=Decision("drive", "R5", "on", Path(np.zeros((1, 3))), 0.0))
    assert seeing.judged(result, START) is result


def test_the_sight_s_state_is_in_the_digest():
    first, second = seen(), seen(at_random(0.1))
    assert first.digest_items() != second.digest_items()
    third = seen(at_random(0.1))
    assert second.digest_items() == third.digest_items()
    third.looks += 1
    assert second.digest_items() != third.digest_items()


# -- by the whole core -------------------------------------------------------------------------------------------


class PoorSight(CoreBench):
    """A rover whose scanner loses beams. lost: of places met (x, y), own azimuths and a generator, to which are."""

    def __init__(self, lost, **given):
        self.lost, self._rng = lost, np.random.default_rng(5)
        super().__init__(**given)

    def _cast(self, times_ns):
        ranges_m = super()._cast(times_ns)
        tilt, (ahead, left) = self.nodes.tilt.angles_at(times_ns), self._beams.T
        way = np.where(np.isfinite(ranges_m), ranges_m, 0.0)
        c, s, lidar_x_m = math.cos(self.pose[2]), math.sin(self.pose[2]), self.rover.config.rover.lidar_x_m
        out = lidar_x_m + way * ahead * np.cos(tilt)
        x, y = self.pose[0] + c * out - s * way * left, self.pose[1] + s * out + c * way * left
        return np.where(self.lost(x, y, np.arctan2(left, ahead), self._rng), np.inf, ranges_m)


BRISK = quick(motion=config.Motion(cruise_mps=0.3, yaw_rate_limit_radps=0.8))


def flown(lost, goal, limit_s=400.0, **mission):
    rover = PoorSight(lost, settings=replace(BRISK, mission=config.Mission(**mission)))
    rover.settle()
    request = rover.goto(*goal)
    state = rover.until_final(request, limit_s)
    rover.run(0.05)
    return rover, state, rover.text(request)


def told_rows(rover):
    return {text.split(":")[0] for _, text in rover.told("FAULT")}


def test_a_mission_whose_goal_lies_on_ground_that_returns_nothing_ends_with_the_true_reason():
    """A disc of 1.6 m round the goal. What is beside it is seen, so that no level ends the mission, but the rule."""
    rover, state, text = flown(lambda x, y, *_: np.hypot(x - 4.0, y - 0.5) < 1.6, (4.0, 0.5), stop_limit=1)
    assert state is RequestState.FAILED
    assert "no way is left" not in text and "saw too little" in text and " % " in text
    assert "LIDAR_DIRTY" in told_rows(rover) and "NO_PATH" not in told_rows(rover)
    assert rover.phase is Phase.FAILED


def test_a_window_dirty_on_a_third_of_the_view_ends_the_mission_at_its_first_stop_by_name_until_it_is_wiped():
    rover, state, text = flown(lambda x, y, own, _: (own > 0.1) & (own < 0.9), (6.0, 0.5))
    assert state is RequestState.FAILED and rover.mode is Mode.SAFE and "no way is left" not in text
    assert "dirt on the window" in rover.told("FAILED")[0][1]
    assert "LIDAR_DIRTY" in told_rows(rover)
    assert max(map(abs, rover.pose[:2])) < 0.05
    rover.lost = lambda x, *_: np.zeros(len(x), np.bool_)
    rover.order("resume")
    rover.run(0.1)
    rover.goto(1.0, 0.2)
    rover.until_phase(Phase.MAPPING, 12.0)  # of a sweep that the row did not discard
    assert "LIDAR_DIRTY" in {text for _, text in rover.told("FAULT_CLEARED")}
    assert rover.rover.executive.mission.seeing.level == 0


def test_a_rule_that_gives_up_on_a_side_not_seen_turns_to_it_and_sweeps_twice_before_the_mission_ends(monkeypatch):
    """The rule is made to give up. All ground within 7 degrees of the goal's direction returns nothing."""

    def give_up(request):
        result = plan(request)
        decision = replace(result.decision, kind="unreachable", rule="R9", reason=NO_WAY)
        return replace(result, decision=decision)

    monkeypatch.setattr(cycle, "plan", give_up)
    bearing = math.atan2(3.0, 4.0)
    rover = PoorSight(
        lambda x, y, *_: np.abs(np.arctan2(y, x) - bearing) < 0.12,
        settings=replace(BRISK, lost_beams=config.LostBeams(looks=1)),
        memory=first_map(),
    )
    rover.settle()
    request = rover.goto(4.0, 3.0)
    assert rover.until_final(request, 120.0) is RequestState.FAILED
    rover.run(0.05)
    (_, look), (_, end) = rover.told("DECISION")
    assert look.startswith("R11 drive") and end.startswith("R9 unreachable: the scanner saw too little")
    assert "+37 degrees" in rover.text(request) and "no way is left" not in rover.text(request)
    assert rover.pose[2] == pytest.approx(bearing, abs=0.1)
    assert rover.rover.executive.mission.scans_taken == 3
    assert told_rows(rover) == {"LIDAR_DIRTY"} and rover.mode is Mode.STANDBY


def test_one_lost_beam_in_a_hundred_changes_no_sweep_and_tells_nothing():
    rover = PoorSight(lambda x, y, own, rng: rng.random(len(x)) < 0.01, settings=BRISK)
    rover.settle()
    rover.goto(3.0, 0.5)
    rover.until_phase(Phase.PLANNING)
    assert not rover.told("SIGHT") and not rover.told("FAULT")
    assert rover.rover.executive.mission.scans_taken == 2


def test_every_sixth_beam_lost_makes_four_sweeps_of_the_first_stop_the_later_ones_at_half_the_rate():
    rover = PoorSight(lambda x, y, own, rng: rng.random(len(x)) < 0.17, settings=BRISK)
    rover.settle()
    rover.goto(3.0, 0.5)
    rover.until_phase(Phase.PLANNING, 120.0)
    mission = rover.rover.executive.mission
    assert mission.scans_taken == 4 and not rover.told("FAULT")
    assert rover.told("SIGHT")[0][1].startswith("level 2")
    scans = len(mission.swept.sweep.scans)
    assert scans == pytest.approx(sum(p.duration_ns for p in segments(slower(BRISK), 0.7)) / 25e6, rel=0.05)
