"""The planning job in small known worlds: range-limited views, walls, a goal behind them or walled in."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard import config
from onboard.perception.map import ldem as ldem_module
from onboard.planning import cycle, plan_records
from onboard.planning.fences import KEEP_OUT, Fence
from onboard.planning.local import poses
from onboard.planning.local.path import is_free
from onboard.planning.local.poses import Freedom, pose_freedom, wheel_cells
from onboard.planning.mission_rule import MissionState
from onboard.planning.sensing.strategies import STRATEGIES
from onboard.records import CellClass, Gdem, Grid, NodeSet, Pose, Surface

SETTINGS = plan_records.PlanningSettings(
    config.Rover(), config.Mapping_(size_m=12.0), config.Planning(), config.Mission(), config.Scanning(range_m=4.0)
)
CELL = 0.1


class World:
    """True ground of 14 m x 14 m, centred; what was seen of it stays known."""

    def __init__(self, boxes):
        self.map = ldem_module.empty(Grid(-6.95, -6.95, CELL, 140, 140))
        x = self.map.grid.x0_m + CELL * np.arange(140)
        self.truth = np.zeros((140, 140), np.float32)
        for x0, y0, x1, y1 in boxes:
            self.truth[np.ix_((x >= y0) & (x <= y1), (x >= x0) & (x <= x1))] = 0.6

    def look(self, pose, heading, sector=1.134, reach=4.0):
        """Reveal the cells that beams within the sector reach before and at the first wall."""
        grid = self.map.grid
        angles = heading + np.linspace(-sector, sector, 500)
        seen = np.zeros(self.truth.shape, bool)
        alive = np.ones(len(angles), bool)
        for r in np.arange(0.7, reach, 0.05):
            i = np.rint((pose.x_m + r * np.cos(angles) - grid.x0_m) / CELL).astype(int)
            j = np.rint((pose.y_m + r * np.sin(angles) - grid.y0_m) / CELL).astype(int)
            alive &= (i >= 0) & (i < 140) & (j >= 0) & (j < 140)
            seen[j[alive], i[alive]] = True
            alive[alive] &= self.truth[j[alive], i[alive]] < 0.3
        fresh = seen & (self.map.n == 0)
        n = np.where(fresh, 5, self.map.n).astype(np.int32)
        z = np.where(n > 0, self.truth, np.nan).astype(np.float32)
        self.map = replace(
            self.map,
            n=n,
            sum_z=np.where(n > 0, n * self.truth, 0.0),
            sum_z2=np.where(n > 0, n * self.truth**2, 0.0),
            z_hi=z,
            z_lo=z,
            view_m=np.where(n > 0, 1.0, np.inf).astype(np.float32),
        )

    def window(self, pose):
        return ldem_module.window(self.map, pose.x_m, pose.y_m, SETTINGS.mapping.size_m)

    def true_freedom(self):
        surface = Surface(
            self.map.grid,
            np.full(self.truth.shape, CellClass.HIT, np.uint8),
            self.truth,
            self.truth,
            self.truth,
            np.full(self.truth.shape, np.inf, np.float32),
        )
        return pose_freedom(surface, SETTINGS.rover, SETTINGS.planning)


def begin(world, pose):
    world.map = ldem_module.assume_disc(world.map, pose, 0.9)
    world.look(pose, pose.yaw_rad)
    world.look(pose, pose.yaw_rad + math.pi)


def request(world, pose, goal, state=None, settings=SETTINGS, trail=(), gdem=None):
    return plan_records.PlanRequest(
        world.window(pose), pose, goal, gdem, state or MissionState(), settings, np.array(trail).reshape(-1, 3)
    )


def drive(world, goal, settings=SETTINGS, limit=25):
    """Plan, drive exactly, look, until the rule ends the mission. Returns decisions and driven stations."""
    pose, state, trail, decisions = Pose(-4.0, 0.0), MissionState(), [(-4.0, 0.0, 0.0)], []
    begin(world, pose)
    true = world.true_freedom()
    while len(decisions) < limit:
        result = cycle.plan(request(world, pose, goal, state, settings, trail))
        decisions.append(result.decision)
        state = result.state
        stations = result.decision.path.stations
        assert all(stands_free(station, true, world.map.grid) for station in stations)
        trail += [tuple(s) for s in stations]
        pose = Pose(stations[-1, 0], stations[-1, 1], yaw_rad=stations[-1, 2])
        if result.decision.kind != "drive":
            break
        assert abs(math.remainder(pose.yaw_rad - result.decision.heading_rad, math.tau)) < 1e-6
        world.look(pose, pose.yaw_rad)
    return decisions, np.array(trail)


def stands_free(station, true, grid):
    """A station on the edge of two cells stands in either: windows and the world round it to their own."""
    nudges = [(x, y, 0.0) for x in (-1e-6, 1e-6) for y in (-1e-6, 1e-6)]
    return any(is_free(station[None] + nudge, true, grid) for nudge in nudges)


def length(trail):
    return np.hypot(*np.diff(trail[:, :2], axis=0).T).sum()


def test_open_ground_is_crossed_in_a_few_commits_in_a_straight_line():
    decisions, trail = drive(World([]), (3.0, 1.03))
    assert [d.rule for d in decisions][-1] == "R4"
    assert decisions[-1].kind == "goal"
    assert len(decisions) <= 4
    assert math.dist(trail[-1, :2], (3.0, 1.03)) < 0.2
    assert length(trail) < 1.05 * math.dist((-4, 0), (3, 1.03))


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_goal_behind_a_u_shaped_wall_is_reached(strategy):
    world = World([(1.0, -2.2, 1.3, 2.2), (-1.2, 1.9, 1.3, 2.2), (-1.2, -2.2, 1.3, -1.9)])
    settings = replace(SETTINGS, mission=config.Mission(strategy=strategy))
    decisions, trail = drive(world, (3.0, 0.0), settings)
    assert decisions[-1].kind == "goal", [f"{d.rule} {d.reason}" for d in decisions]
    assert math.dist(trail[-1, :2], (3.0, 0.0)) <= SETTINGS.mission.goal_tolerance_m
    assert len(decisions) < 20


def test_a_walled_in_goal_is_reported_unreachable_with_the_nearest_pose():
    ring = [(1.5, -1.5, 4.5, -1.2), (1.5, 1.2, 4.5, 1.5), (1.5, -1.5, 1.8, 1.5), (4.2, -1.5, 4.5, 1.5)]
    decisions, _ = drive(World(ring), (3.0, 0.0))
    assert decisions[-1].kind == "unreachable", [f"{d.rule} {d.reason}" for d in decisions]
    assert len(decisions) < 20
    assert 1.3 < decisions[-1].data["distance_m"] < 2.6
    assert decisions[-1].data["blocking_cells"] > 20


def test_a_goal_on_free_ground_is_met_exactly_and_then_said_to_be_reached():
    world, pose = World([]), Pose(-4.0, 0.0)
    begin(world, pose)
    goal = (-1.98, 0.43)
    decision = cycle.plan(request(world, pose, goal)).decision
    assert (decision.kind, decision.rule) == ("goal", "R4")
    np.testing.assert_allclose(decision.path.stations[-1, :2], goal)
    there = Pose(*goal, yaw_rad=float(decision.path.stations[-1, 2]))
    decision = cycle.plan(request(world, there, goal, trail=decision.path.stations)).decision
    assert (decision.kind, decision.rule) == ("arrived", "R4")


def test_path_past_a_rock_tells_its_clearance_and_one_over_open_ground_that_nothing_is_near():
    for boxes in ([(0.8, 0.5, 1.0, 0.7)], []):
        world = World(boxes)
        begin(world, Pose(0, 0))
        path = cycle.plan(request(world, Pose(0, 0), (2.0, 0.0))).decision.path
        assert len(path.clearance_m) == len(path.stations)
        assert (min(path.clearance_m) < 0.3) == bool(boxes)
        assert max(path.clearance_m) == poses.CLOSE_M


def test_ground_where_the_wheels_slipped_is_gone_around_and_crossed_where_there_is_no_other():
    world = World([])
    begin(world, Pose(0, 0))
    asked = request(world, Pose(0, 0), (3.0, 0.0))
    slippery = replace(asked, slippery_m=((1.5, 0.0),))
    straight, round_it = (cycle.plan(one).decision.path.stations for one in (asked, slippery))
    assert np.abs(straight[:, 1]).max() < 0.2
    assert np.hypot(round_it[:, 0] - 1.5, round_it[:, 1]).min() > 0.5
    everywhere = tuple((1.5, float(y_m)) for y_m in np.arange(-6.0, 6.1, 0.4))
    assert np.abs(cycle.plan(replace(asked, slippery_m=everywhere)).decision.path.stations[:, 1]).max() < 0.2


def test_a_way_keeps_off_ground_that_no_beam_told_of():
    world = World([])
    begin(world, Pose(0, 0))
    asked = request(world, Pose(0, 0), (3.0, 0.0))
    unseen = ((1.45, 0.45), (1.55, 0.45))
    straight, round_it = (cycle.plan(one).decision.path.stations for one in (asked, replace(asked, unseen_m=unseen)))
    beside = [stations[np.abs(stations[:, 0] - 1.5) < 0.4, 1].max() for stations in (straight, round_it)]
    assert beside[0] > -0.1 and beside[1] < beside[0] - 0.15


@pytest.mark.parametrize(("left_m", "right_m", "least_m"), [(0.55, -0.85, 0.3), (0.35, -0.35, 0.0)])
def test_a_way_between_two_stones_leaves_room_for_steered_tyres_where_there_is_room(left_m, right_m, least_m):
    world, stones = World([]), ((1.5, left_m), (1.5, right_m))
    for stone in stones:
        world.truth[world.map.grid.cell(*stone)] = 0.09
    begin(world, Pose(0, 0))
    lane = [
        Fence(str(side), KEEP_OUT, [(-2.0, side * 0.95), (5.0, side * 0.95), (5.0, side * 2.0), (-2.0, side * 2.0)])
        for side in (-1, 1)
    ]
    decision = cycle.plan(replace(request(world, Pose(0, 0), (3.0, 0.0)), fences=tuple(lane))).decision
    assert decision.kind == "goal"
    assert min(tyres_off_m(decision.path.stations, stone) for stone in stones) >= least_m


SIDE_STONE = [(0.3, 0.4, 0.5, 0.6)]  # under the edge of a tyre of a rover that stands at the origin and looks south
RING = [(-1.2, 0.55, 1.2, 1.0), (-1.2, -1.0, 1.2, -0.55), (0.55, -1.0, 1.0, 1.0), (-1.0, -1.0, -0.55, 1.0)]


@pytest.mark.parametrize(("walls", "turned"), [([], Freedom.BLOCKED), (RING, Freedom.FREE)])
def test_a_rover_beside_a_stone_turns_a_tyre_onto_it_only_where_else_it_cannot_leave(walls, turned):
    world, pose = World(SIDE_STONE + walls), Pose(0.0, 0.0, yaw_rad=-math.pi / 2)
    begin(world, pose)
    asked = request(world, pose, (3.0, 0.0))
    surface = cycle.surface_of(asked)
    j, i, o = poses.pose_index(surface.grid, 0.0, 0.0, pose.yaw_rad)
    assert pose_freedom(surface, SETTINGS.rover, SETTINGS.planning)[o, j, i] == Freedom.BLOCKED
    freedom = cycle.freedom_of(asked, surface)
    assert freedom[o, j, i] == Freedom.FREE
    assert freedom[o - 1, j, i] == turned


def tyres_off_m(stations, place):
    """From a place to the nearest of the circles about the tyres, over all stations (k, 3)."""
    rover = SETTINGS.rover
    c, s = np.cos(stations[:, 2]), np.sin(stations[:, 2])
    dx, dy = place[0] - stations[:, 0], place[1] - stations[:, 1]
    ahead, left = np.abs(c * dx + s * dy) - rover.half_wheelbase_m, np.abs(c * dy - s * dx) - rover.half_track_m
    return float(np.hypot(ahead, left).min()) - math.hypot(rover.wheel_radius_m, rover.wheel_width_m / 2)


def test_same_request_gives_the_same_result_bit_by_bit():
    world, pose = World([(0.0, -1.0, 0.3, 1.0)]), Pose(-4.0, 0.0)
    begin(world, pose)
    first, second = (cycle.plan(request(world, pose, (3.0, 0.0))) for _ in range(2))
    assert np.array_equal(first.decision.path.stations, second.decision.path.stations)
    assert first.state == second.state
    assert first.decision.reason == second.decision.reason


def test_a_goal_outside_the_window_is_approached_by_the_orbiters_map():
    world, pose = World([]), Pose(-4.0, 0.0)
    begin(world, pose)
    heights = np.zeros((20, 20), np.float32)
    heights[8:12, 11] = 40.0  # a ridge across the straight way
    orbit = Gdem(Grid(-95.0, -95.0, 10.0, 20, 20), heights)
    result = cycle.plan(request(world, pose, (80.0, 0.0), gdem=orbit))
    assert result.decision.kind == "drive"
    assert len(result.report.global_path) > 5
    assert np.abs(result.report.global_path[:, 1]).max() > 15.0
    plain = cycle.plan(request(world, pose, (80.0, 0.0)))
    assert len(plain.report.global_path) == 2
    assert plain.decision.data["cost_m"] == pytest.approx(84.0, abs=0.5)


def orbit_2m() -> Gdem:
    """Flat ground in cells of 2 m, 40 m x 40 m: the window is a part of it."""
    return Gdem(Grid(-19.0, -19.0, 2.0, 20, 20), np.zeros((20, 20), np.float32))


def seen(boxes):
    """A world of which everything is known."""
    world = World(boxes)
    z, five = world.truth, np.full(world.truth.shape, 5, np.int32)
    world.map = replace(
        ldem_module.empty(world.map.grid),
        n=five,
        sum_z=5.0 * z,
        sum_z2=5.0 * z**2,
        z_hi=z,
        z_lo=z,
        view_m=np.ones(z.shape, np.float32),
    )
    return world


WALL = [(x, -5.95, x + 0.3, 3.95) for x in (-1.95, -1.45, -0.95, -0.45)]  # no rover stands on it or between its rows


def test_the_global_path_moves_when_a_wall_is_seen():
    pose, goal = Pose(-4.0, 0.0), (15.0, 0.0)
    before = cycle.plan(request(seen([]), pose, goal, gdem=orbit_2m()))
    after = cycle.plan(request(seen(WALL), pose, goal, gdem=orbit_2m()))
    assert np.abs(before.report.global_path[:, 1]).max() <= 2.0
    crossing = np.abs(after.report.global_path[:, 0] + 1.0) <= 1.0
    assert (np.abs(after.report.global_path[crossing, 1]) >= 4.0).all()
    assert after.decision.kind == "drive"


def test_what_was_seen_stays_in_the_orbiters_map_given_back():
    pose, goal = Pose(-4.0, 0.0), (15.0, 0.0)
    kept = cycle.plan(request(seen(WALL), pose, goal, gdem=orbit_2m())).gdem
    assert np.isnan(kept.heights_m[9, 9])
    unseen = cycle.plan(request(World([]), Pose(-4.0, 0.0), goal, gdem=kept))
    assert np.isnan(unseen.gdem.heights_m[9, 9])


def test_cost_to_go_is_continuous_across_the_windows_border():
    pose, goal = Pose(-4.0, 0.0), (15.0, 0.0)
    asked = request(seen(WALL), pose, goal, gdem=orbit_2m())
    surface = cycle.classify(asked.ldem, SETTINGS.mapping)
    freedom = cycle.freedom_of(asked, surface)
    gdem, field = cycle._from_orbit(asked, surface, freedom)
    seeds, left = cycle._seeds(surface.grid, goal, 0.3, field)
    cost = cycle.cost_to_go(freedom, seeds, SETTINGS.planning, CELL, True, np.zeros(freedom.shape, np.float32), left)
    border = cost[:, seeds[:, 0], seeds[:, 1]].min(axis=0)
    passable = (freedom[:, seeds[:, 0], seeds[:, 1]] != Freedom.BLOCKED).any(axis=0)
    assert np.isfinite(left[passable]).all()
    assert (border[passable] <= left[passable] + 1e-3).all()
    places = np.array([surface.grid.centre(*seed[:2]) for seed in seeds])
    outside = cycle.global_path.values_at(field, places + np.array([CELL, 0.0]))
    east = passable & (seeds[:, 1] == surface.grid.columns - 1)
    assert east.sum() > 50
    assert np.abs(border[east] - outside[east]).max() <= gdem.grid.cell_m / 6


def test_ground_that_would_shut_the_rover_in_does_not_change_the_orbiters_map():
    pose, goal = Pose(-4.0, 0.0), (15.0, 0.0)
    narrow = Gdem(Grid(-19.0, -1.0, 2.0, 2, 20), np.zeros((2, 20), np.float32))  # a strip that the wall crosses
    result = cycle.plan(request(seen(WALL), pose, goal, gdem=narrow))
    assert result.gdem is narrow
    assert result.decision.kind == "drive"


def test_the_cells_of_rover_and_goal_are_never_closed():
    pose, goal = Pose(-4.0, 0.0), (3.0, 1.0)
    boxed = [(2.0, 0.0, 4.0, 0.3), (2.0, 1.7, 4.0, 2.0), (2.0, 0.0, 2.3, 2.0), (3.7, 0.0, 4.0, 2.0)]
    gdem = cycle.plan(request(seen(boxed), pose, goal, gdem=orbit_2m())).gdem
    assert np.isfinite(gdem.heights_m[gdem.grid.cell(*goal)])
    assert np.isfinite(gdem.heights_m[gdem.grid.cell(pose.x_m, pose.y_m)])


def test_report_holds_disjoint_sets_and_the_paths():
    world, pose = World([(0.0, -1.0, 0.3, 1.0)]), Pose(-4.0, 0.0)
    begin(world, pose)
    report = cycle.plan(request(world, pose, (1.5, 0.0))).report
    assert set(np.unique(report.node_sets)) <= set(NodeSet)
    j, i = report.grid.cell(pose.x_m, pose.y_m)
    assert report.node_sets[j, i] == NodeSet.FREE
    assert math.dist(report.optimistic_path[-1], (1.5, 0.0)) < 0.35
    assert report.next_position is None


@pytest.mark.parametrize("strategy", [name for name, row in STRATEGIES.items() if row])
def test_a_strategy_reports_its_scores_alternatives_and_reason(strategy):
    world, pose = World([]), Pose(-4.0, 0.0)
    begin(world, pose)
    settings = replace(SETTINGS, mission=config.Mission(strategy=strategy))
    result = cycle.plan(request(world, pose, (3.0, 0.0), settings=settings))
    found = result.report.next_position
    assert result.decision.rule == "R10"
    assert result.decision.reason == f"the way left still shrinks; {found.reason}"
    assert 1 <= len(found.alternatives) <= 5
    end = result.decision.path.stations[-1]
    assert math.dist(end[:2], (found.best.x_m, found.best.y_m)) < 1.6  # backed off to turn


@pytest.mark.parametrize("distance", ["cost-to-go", "straight-line"])
def test_distance_of_the_score_is_that_of_the_configuration(distance):
    world, pose = World([(-1.0, -3.0, -0.7, 3.0)]), Pose(-4.0, 0.0)
    begin(world, pose)
    settings = replace(SETTINGS, mission=config.Mission(strategy="visibility", distance=distance))
    best = cycle.plan(request(world, pose, (3.0, 0.0), settings=settings)).report.next_position.best
    straight = math.dist((best.x_m, best.y_m), (3.0, 0.0))
    if distance == "straight-line":
        assert best.cost_m == pytest.approx(straight, abs=1e-4)
    else:
        assert best.cost_m > straight + 0.3  # round the wall


def test_a_rover_whose_own_pose_reads_as_blocked_still_moves():
    world, pose = World([]), Pose(-4.0, 0.0)
    begin(world, pose)
    own = cycle.pose_index(world.map.grid, -4.0, 0.0, 0.0)
    dj, di = wheel_cells(own[2], SETTINGS.rover, CELL)[0]
    n, top, low = world.map.n.copy(), world.map.z_hi.copy(), world.map.z_lo.copy()
    at = (own[0] + dj, own[1] + di)
    n[at], top[at], low[at] = 5, 0.2, 0.0  # noise under a wheel
    world.map = replace(world.map, n=n, z_hi=top, z_lo=low)
    surface = cycle.classify(world.map, SETTINGS.mapping)
    assert pose_freedom(surface, SETTINGS.rover, SETTINGS.planning)[own[2], own[0], own[1]] == Freedom.BLOCKED
    result = cycle.plan(request(world, pose, (3.0, 0.0)))
    assert result.decision.kind == "drive"
    assert result.decision.path.length_m > 0.5


def test_a_rover_within_a_keep_out_is_told_to_stay_where_it_is():
    world = World([])
    begin(world, Pose(0, 0))
    asked = request(world, Pose(0, 0), (3.0, 0.0))
    ring = tuple((4.0 * math.cos(a), 4.0 * math.sin(a)) for a in np.linspace(0, math.tau, 9)[:-1])
    decision = cycle.plan(replace(asked, fences=(Fence("here", KEEP_OUT, ring),))).decision
    assert decision.kind == "unreachable"
    assert "nearest reachable pose (0.00, 0.00), 3.00 m from the goal" in decision.reason


def test_a_window_elsewhere_is_refused():
    world = World([])
    asked = request(world, Pose(-4.0, 0.0), (3.0, 0.0))
    with pytest.raises(ValueError, match="outside the map's window"):
        cycle.plan(replace(asked, pose=Pose(60.0, 0.0)))
