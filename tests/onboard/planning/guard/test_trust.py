"""The trust range: where a path is cut on pitted ground, by hand, and that it always goes on."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard import config
from onboard.perception.map import ldem
from onboard.planning.guard import trust
from onboard.planning.mission_rule import MissionState, Stop
from onboard.planning.plan_records import PlanningSettings, PlanRequest
from onboard.records import Decision, Path, Pose

GRID = ldem.grid_around(0.0, 0.0, 8.0, 0.1)
X, Y = np.meshgrid(GRID.x0_m + np.arange(GRID.columns) * 0.1, GRID.y0_m + np.arange(GRID.rows) * 0.1)
AHEAD = np.column_stack([np.arange(0.05, 3.1, 0.05), np.full(61, 0.05), np.zeros(61)])
HERE = Stop(0.05, 0.05, 0.0)


def seen(view_m):
    """A map of even ground, each cell's nearest view given."""
    n = np.where(np.isfinite(view_m), 9, 0).astype(np.int32)
    flat = np.where(n > 0, np.float32(0.0), np.float32(np.nan))
    return replace(ldem.empty(GRID), n=n, z_hi=flat, z_lo=flat, view_m=view_m.astype(np.float32))


def request(view_m, guard=False, trust_m=1.5, trail=(), ground="pitted"):
    settings = PlanningSettings(
        config.Rover(),
        config.Mapping_(trust_m=trust_m),
        config.Planning(),
        config.Mission(ground=ground),
        config.Scanning(),
        config.DriveGuard(on=guard),
    )
    return PlanRequest(
        seen(view_m), Pose(0.05, 0.05), (3.0, 0.0), None, MissionState(), settings, np.array(trail).reshape(-1, 3)
    )


def cut(asked, stations=AHEAD, stops=(HERE,)):
    decision = Decision("goal", "R4", "there", Path(stations), 0.0)
    return trust.within_trust(decision, asked, MissionState(stops=stops))


FROM_HERE = np.hypot(X - 0.35, Y - 0.05)  # the scanner's place


def test_ground_seen_from_near_is_driven_whole():
    asked = request(np.full(X.shape, 1.2))
    assert cut(asked).path.stations is AHEAD
    assert cut(asked).kind == "goal"


@pytest.mark.parametrize("trust_m", [1.5, 2.0])
def test_path_is_cut_where_a_wheel_would_leave_the_trust_range(trust_m):
    decision = cut(request(FROM_HERE, trust_m=trust_m))
    assert decision.kind == "drive"
    assert decision.heading_rad == 0.0
    front = decision.path.stations[-1, 0] + 0.375
    assert 0.35 + trust_m - 0.3 < front + 0.1 <= 0.35 + trust_m
    assert "look" in decision.reason


def test_guard_that_will_sweep_the_way_lets_it_go_on():
    assert cut(request(FROM_HERE, guard=True)).path.stations is AHEAD


def test_guard_does_not_vouch_for_what_lies_nearer_than_its_line():
    gap = np.where((X > 0.9) & (X < 1.1), 4.0, 1.0)
    decision = cut(request(gap, guard=True))
    assert decision.path.length_m == pytest.approx(0.3, abs=0.051)
    beyond = np.where((X > 2.4) & (X < 2.6), 4.0, 1.0)
    assert cut(request(beyond, guard=True)).path.stations is AHEAD


CRAB = np.column_stack([np.full(61, 0.05), np.arange(0.05, 3.1, 0.05), np.zeros(61)])


def test_on_smooth_ground_under_guard_only_ways_sideways_or_back_need_a_near_view():
    asked = request(FROM_HERE, guard=True, ground="smooth")
    assert cut(asked).path.stations is AHEAD
    crab = cut(asked, CRAB)
    assert crab.kind == "drive"
    assert crab.path.stations[-1, 1] + 0.23 <= 1.5
    assert cut(request(np.full(X.shape, 1.2), guard=True, ground="smooth"), CRAB).path.stations is CRAB


@pytest.mark.parametrize("guard", [False, True])
def test_on_smooth_ground_no_wheel_rolls_over_what_was_seen_from_farther_than_near_m_alone(guard):
    far = np.where((X > 2.0) & (X < 2.2), 6.4, 3.0)
    decision = cut(request(far, guard=guard, ground="smooth"))
    assert decision.kind == "drive" and "look" in decision.reason
    assert decision.path.stations[-1, 0] + 0.375 + 0.1 < 2.0
    near = request(np.full(X.shape, 4.9), guard=guard, ground="smooth")
    assert cut(near).path.stations is AHEAD


@pytest.mark.parametrize(("heading_deg", "off"), [(0, False), (25, False), (35, True), (90, True), (180, True)])
def test_a_way_counts_as_sideways_from_30_degrees_off_the_heading(heading_deg, off):
    turned = np.column_stack([AHEAD[:, :2], np.full(61, math.radians(heading_deg))])
    assert trust.sideways(turned).tolist() == [False, *[off] * 60]


def test_a_turn_on_the_spot_goes_nowhere():
    turn = np.column_stack([np.zeros((9, 2)), np.linspace(0.0, 3.0, 9)])
    assert not trust.sideways(turn).any()


def test_guard_sees_nothing_of_a_way_driven_backwards():
    back = AHEAD * (1.0, 1.0, 0.0) + (0.0, 0.0, math.pi)
    decision = cut(request(np.where(X > 1.6, 4.0, 1.0), guard=True), back, ())
    assert decision.path.stations[-1, 0] < 1.6


def test_ground_driven_over_before_is_trusted():
    assert cut(request(np.full(X.shape, 4.0), trail=AHEAD)).path.stations is AHEAD


def test_where_nothing_is_trusted_it_looks_first_and_then_the_nose_goes():
    asked = request(np.full(X.shape, 4.0))
    first = cut(asked, stops=())
    assert (first.kind, first.path.length_m) == ("drive", 0.0)
    second = cut(asked, stops=(HERE,))
    assert second.path.length_m == pytest.approx(trust.NOSE_M, abs=0.051)


def test_turn_over_trusted_ground_ends_in_a_look_along_the_way_to_untrusted_ground():
    turn = np.column_stack([np.full(9, 0.05), np.full(9, 0.05), np.linspace(0.0, math.pi / 2, 9)])
    north = np.column_stack([np.full(20, 0.05), 0.05 + 0.05 * np.arange(1, 21), np.full(20, math.pi / 2)])
    near = np.where(np.hypot(X - 0.05, Y - 0.05) < 0.65, 1.0, 4.0)
    decision = cut(request(near), np.concatenate([turn, north]))
    assert decision.path.length_m < 0.2
    assert decision.heading_rad == pytest.approx(math.pi / 2)


def test_way_shorter_than_the_nose_is_never_cut_twice_at_one_place():
    asked, short = request(np.full(X.shape, 4.0)), AHEAD[:8]
    assert cut(asked, short).path.stations is short


def test_filled_cell_is_trusted_by_its_neighbours_and_assumed_ground_by_itself():
    view = np.full(X.shape, 1.0)
    hole = GRID.cell(0.55, 0.25)
    view[hole] = np.inf
    asked = request(view)
    z_ray = np.where(asked.ldem.n > 0, np.inf, 0.02).astype(np.float32)
    filled = replace(asked, ldem=replace(asked.ldem, z_ray=z_ray))
    assert trust.seen_near(filled.ldem, asked.settings, asked.settings.mapping.trust_m)[hole]
    assert not trust.seen_near(asked.ldem, asked.settings, asked.settings.mapping.trust_m)[hole]
    assumed = replace(ldem.empty(GRID), assumed_z=np.zeros(X.shape, np.float32))
    assert trust.seen_near(assumed, asked.settings, asked.settings.mapping.trust_m).all()
