"""Every picture is a PNG of the aspect it should have, and its legend names what is drawn."""

from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.patches import Wedge

from onboard.planning.archive import PlanPicture
from onboard.records import Grid, NodeSet
from pictures import figures
from pictures.ground_kinds import Profile, Sizes, craters, fractals, rock_sizes
from pictures.items import Series, items
from pictures.ldem import SET_COLOURS, ldems, set_picture
from pictures.next_position import next_position
from pictures.orientation import orientation
from pictures.paths import Ways, paths
from pictures.rim import COLOUR, NAME, rim
from pictures.style import png
from pictures.terrain import Ground, hillshade, terrain
from pictures.timelines import Span, Track
from pictures.way import Sets, way

pytestmark = pytest.mark.tool

GRID = Grid(-1.9, -3.9, 0.2, 40, 80)
HEIGHTS = np.sin(np.arange(80) / 7)[None, :].repeat(40, 0).astype(np.float32) * 0.2
GROUND = Ground(GRID, HEIGHTS, np.array([[2.0, 1.0, 0.8], [6.0, -1.0, 0.4]]), "made up")
LINE = np.column_stack([np.linspace(0, 10, 50), np.linspace(0, 2, 50), np.zeros(50)])
TIMES = np.arange(0, 60, 0.1)
TRACK = Track(TIMES, np.column_stack([TIMES / 6, 0 * TIMES, 0 * TIMES]), np.column_stack([np.sin(TIMES / 5)] * 3) * 0.2)
SPANS = (Span(0, 10, "SCANNING"), Span(10, 11, "PLANNING"), Span(11, 50, "DRIVING"), Span(50, 60, "TURNING"))


def size(data):
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def legend(made):
    return {text.get_text() for box in made.legends for text in box.get_texts()}


def plan(kind="drive", choices=0):
    sets = np.full((40, 40), NodeSet.FREE, np.uint8)
    sets[:10], sets[10:20], sets[20:25] = NodeSet.OUTSIDE, NodeSet.OCCLUDED, NodeSet.OBSTACLE
    heights = np.where(sets >= NodeSet.OBSTACLE, HEIGHTS[:, :40], np.nan).astype(np.float32)
    none = np.empty((0, 2))
    return PlanPicture(
        Grid(-1.9, -3.9, 0.2, 40, 40),
        heights,
        sets,
        np.empty((0, 0), np.float32),
        np.array([0, 0, 0, 0.3]),
        np.array([10.0, 2.0]),
        kind,
        "R5",
        "because",
        0.5,
        LINE[:10],
        none,
        LINE[:, :2],
        LINE[:20, :2],
        "",
        np.empty((0, 4)),
        np.ones((choices, 4)),
        np.empty((0, 3)),
        none,
    )


def test_paths_are_drawn_with_equal_axes_and_every_line_in_the_legend():
    made = paths(GROUND, Ways((10.0, 2.0), 0.3, LINE[:, :2], [LINE[:20], LINE[20:]], LINE, LINE, LINE[::20]))
    axes = made.axes[0]
    assert axes.get_aspect() == 1
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("east, m", "north, m")
    assert legend(made) == {
        "rocks",
        "local paths",
        "global path",
        "true way",
        "estimated way",
        "goal, within 0.3 m",
        "stops, numbered",
    }
    width, height = size(png(made))
    assert 1.4 < width / height < 2.0


def test_paths_without_truth_show_the_estimate_alone():
    made = paths(Ground(GRID, HEIGHTS), Ways((10.0, 2.0), estimated=LINE))
    assert legend(made) == {"estimated way", "goal, within 0.3 m"}


def test_ways_that_do_not_move_still_make_a_picture():
    assert size(png(paths(GROUND, Ways((0.0, 0.0)))))


def test_stops_at_one_place_share_a_label():
    stops = np.array([[0, 0], [0.05, 0], [4, 1]])
    texts = {text.get_text() for text in paths(GROUND, Ways((10.0, 2.0), stops=stops)).axes[0].texts}
    assert {"1,2", "3"} <= texts


def test_the_light_comes_from_the_north_west():
    slope = np.add.outer(np.arange(9.0), -np.arange(9.0)) * 0.3  # rises to the north-west, so it faces south-east
    away, towards = hillshade(slope.astype(np.float32), 1.0)[4, 4], hillshade(-slope.astype(np.float32), 1.0)[4, 4]
    flat = hillshade(np.zeros((9, 9), np.float32), 1.0)[4, 4]
    assert away < flat < towards


def test_unknown_ground_is_shaded_as_if_it_were_flat():
    heights = np.full((5, 5), np.nan, np.float32)
    heights[2, 2] = 3.0
    assert np.ptp(hillshade(heights, 0.1)) == 0.0


@pytest.mark.parametrize(("true", "names"), [(TRACK, {"true", "estimated"}), (None, {"estimated"})])
def test_orientation_has_yaw_roll_and_pitch_over_the_phases(true, names):
    made = orientation(TRACK, true, SPANS)
    assert [axes.get_ylabel().split(",")[0] for axes in made.axes] == ["yaw", "roll", "pitch"]
    assert legend(made) == names | {"scanning", "driving", "turning", "mapping, planning"}
    width, height = size(png(made))
    assert width > height


def test_yaw_stays_within_180_degrees_and_its_line_breaks_where_it_goes_round():
    turning = np.column_stack([0 * TIMES, 0 * TIMES, -TIMES / 6])  # -573 degrees in a minute
    yaw = orientation(Track(TIMES, TRACK.position_m, turning), None, SPANS).axes[0].lines[0].get_ydata()
    assert np.nanmin(yaw) > -180
    assert np.nanmax(yaw) <= 180
    assert np.nanmax(np.abs(np.diff(yaw))) < 2
    assert np.isnan(yaw).sum() == 2


@pytest.mark.parametrize(("count", "aspect"), [(1, (0.9, 1.4)), (3, (1.8, 2.6)), (7, (0.7, 1.1))])
def test_every_stop_has_its_panel(count, aspect):
    made = ldems([plan() for _ in range(count)], 1.1, (0.95, 0.56))
    titles = [axes.get_title() for axes in made.axes if axes.axison]
    assert titles == [f"stop {k + 1}: drive, R5" for k in range(count)]
    width, height = size(png(made))
    assert aspect[0] < width / height < aspect[1]


def test_the_four_node_sets_have_four_colours_and_legend_entries():
    assert len(set(SET_COLOURS.values())) == len(NodeSet) == len(SET_COLOURS)
    made = ldems([plan(choices=2)], 1.1, (0.95, 0.56))
    assert {"outside", "occluded", "obstacle", "free", "path to drive", "candidates"} <= legend(made)
    assert len(np.unique(set_picture(plan()).reshape(-1, 3)[: 20 * 40], axis=0)) == 2


def bumpy(step_m):
    """Free ground, three rows of unreachable cells and the unknown beside them; a step in the known part, or none."""
    sets = np.full((40, 40), NodeSet.FREE, np.uint8)
    sets[:10], sets[10:13], sets[30, 20] = NodeSet.OUTSIDE, NodeSet.OBSTACLE, NodeSet.OBSTACLE
    heights = np.where(sets == NodeSet.OUTSIDE, np.nan, 0.0).astype(np.float32)
    heights[11, 5] = step_m
    return sets, heights


def test_cells_that_only_lie_beside_unknown_ground_have_the_rim_s_colour_and_obstacles_have_not():
    found = rim(*bumpy(0.0), 0.2)
    assert found[10:13].all() and found.sum() == 3 * 40  # the single cell far from the unknown is an obstacle
    stepped = rim(*bumpy(0.08), 0.2)
    assert not stepped[10:13, 3:8].any() and stepped[10:13, 12:].all()
    assert (rim(*bumpy(0.06), 0.2) == found).all()  # a step that wheels may climb


def test_the_rim_is_named_in_the_legend_with_a_colour_of_its_own():
    assert COLOUR not in SET_COLOURS.values()
    assert NAME in legend(ldems([plan()], 1.1, (0.95, 0.56)))


def scored(choices):
    made = plan(choices=0)
    scores = np.where(made.node_sets == NodeSet.FREE, HEIGHTS[:, :40], np.nan).astype(np.float32)
    places = np.array([(1.0, 2.0, 0.5, 0.9), (3.0, 2.5, 3.0, 0.8), (-1.0, 3.0, -1.0, 0.7)])[:choices]
    return replace(made, score_map=scores, scoring="E = because", choice=places[:1], alternatives=places[1:])


def test_next_position_shows_scores_the_best_and_numbered_alternatives_with_their_sectors():
    made = next_position(scored(3), 1.1, (0.95, 0.56))
    axes, bar = made.axes
    assert axes.get_title() == "E = because"
    assert bar.get_ylabel() == "score E (Eq. 28)"
    assert [text.get_text() for text in axes.texts] == ["1", "2"]
    wedges = [patch for patch in axes.patches if isinstance(patch, Wedge)]
    assert [w.center for w in wedges] == [(3.0, 2.5), (-1.0, 3.0), (1.0, 2.0)]
    assert all(w.theta2 - w.theta1 == pytest.approx(np.degrees(2.2)) for w in wedges)
    shown = np.ma.filled(axes.images[1].get_array(), np.nan)
    np.testing.assert_array_equal(shown, scored(3).score_map)
    assert {"best, its sector", "alternatives, in order", "occluded, no score"} <= legend(made)
    width, height = size(png(made))
    assert 0.9 < width / height < 1.1


def test_a_stop_without_scores_says_so():
    made = next_position(plan(), 1.1, (0.95, 0.56))
    assert made.axes[0].get_title() == "the strategy scored nothing here"
    assert len(made.axes) == 1
    assert not any("best" in text for text in legend(made))
    assert size(png(made))


def test_terrain_shows_truth_and_map_with_one_scale_of_heights():
    made = terrain(Ground(GRID, HEIGHTS / 2, name="the map"), GROUND, (10.0, 2.0))
    assert [axes.get_title().split("\n")[0] for axes in made.axes[:2]] == ["made up", "the map"]
    assert made.axes[0].images[0].norm is made.axes[1].images[0].norm
    assert size(png(made))[0] > 1000


def test_the_link_shows_what_each_direction_lost_and_by_what():
    made = figures.link({"down": 100, "up": 30}, {"down": {"noise": 10, "shadow": 0}, "up": {"noise": 0, "shadow": 0}})
    assert legend(made) == {"delivered or on the way", "lost: noise"}
    assert {text.get_text() for text in made.axes[0].texts} == {"10 of 100 lost, 10.0 %", "0 of 30 lost, 0.0 %"}


def test_ticks_are_two_step_lines_beside_the_length_of_a_tick():
    made = figures.ticks([0.1, 1.0, 10.0, 100.0], {"plant": [90, 9, 1], "onboard": [80, 18, 2]}, 10.0)
    axes = made.axes[0]
    assert legend(made) == {"plant", "onboard", "10 ms: real time"}
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert [patch.get_data().values.tolist() for patch in axes.patches] == [[90, 9, 1], [80, 18, 2]]
    width, height = size(png(made))
    assert width > 2 * height


def test_pose_error_is_the_distance_of_the_tracks():
    moved = Track(TIMES, TRACK.position_m + np.array([0.03, 0.04, 0]), TRACK.angles_rad)
    line = figures.pose_error(moved, TRACK, SPANS).axes[0].lines[0]
    np.testing.assert_allclose(line.get_ydata(), 5.0)


def test_speed_is_the_way_over_time():
    made = figures.motion(TRACK, TIMES, np.ones((len(TIMES), 4)), np.zeros((len(TIMES), 4)), SPANS)
    np.testing.assert_allclose(made.axes[0].lines[0].get_ydata(), 1 / 6)
    assert {f"wheel {k}" for k in (1, 2, 3, 4)} <= legend(made)
    for rates in made.axes[1:]:
        widths = [line.get_linewidth() for line in rates.lines[:4]]
        assert widths == sorted(widths, reverse=True)
        assert len(set(widths)) == len({line.get_color() for line in rates.lines[:4]}) == 4
    assert len(figures.motion(TRACK, np.empty(0), np.empty((0, 4)), np.empty((0, 4)), ()).axes) == 1


def test_an_angle_between_two_samples_takes_the_short_way_round():
    track = Track(np.array([0.0, 1.0]), np.zeros((2, 3)), np.array([[0, 0, 3.1], [0, 0, -3.1]]))
    assert track.at(np.array([0.5])).angles_rad[0, 2] == pytest.approx(np.pi)


def test_drawing_leaves_the_style_of_others_alone_and_repeats():
    before = mpl.rcParams["font.size"]
    first, second = (png(figures.link({"down": 1}, {})) for _ in range(2))
    assert first == second
    assert mpl.rcParams["font.size"] == before


def test_fractal_grounds_stand_side_by_side_with_their_relief():
    made = fractals([GROUND, GROUND])
    assert [axes.get_title() for axes in made.axes] == ["made up\nrelief 0.40 m"] * 2
    assert size(png(made))[0] == 1350


def test_craters_are_named_and_the_field_beside_them_has_equal_axes():
    x = np.linspace(-3, 3, 61)
    made = craters([Profile("fresh", x, x**2 - 1), Profile("worn", x, (x**2 - 1) / 2)], GROUND)
    assert legend(made) == {"fresh", "worn"} and made.axes[1].get_aspect() == 1
    assert size(png(made))[0] == 1350


def test_rocks_drawn_add_up_to_the_share_and_number_of_the_law_beside_them():
    d = np.array([0.2, 0.4, 0.8])
    made = rock_sizes([Sizes("a law", np.array([0.4, 0.2]), 10.0, d, 0.01 / d, 0.1 / d)])
    share, number = (axes.lines[1].get_ydata() for axes in made.axes)
    np.testing.assert_allclose(share, np.pi / 4 * np.array([0.16, 0.2]) / 10)
    np.testing.assert_allclose(number, [0.1, 0.2])
    assert legend(made) == {"a law, law", "2 rocks drawn"}


def test_a_predicted_way_shows_what_is_driven_what_is_hoped_for_and_the_sets():
    sets = np.full((40, 80), 3, np.uint8)
    made = way(Sets(GRID, HEIGHTS, sets), LINE[:20], LINE[20:, :2], (10.0, 2.0), "predicted 10 m")
    assert size(png(made))[0] == 1050
    names = {"hoped for, not seen yet", "to be driven", "rover", "goal"}
    assert legend(made) == names | {"outside", "occluded", "obstacle", "free", NAME}
    assert "hoped for, not seen yet" not in legend(way(Sets(GRID, HEIGHTS, sets), LINE, LINE[:0, :2], (10, 2), ""))


def test_the_legend_of_a_predicted_way_keeps_clear_of_its_title():
    made = way(Sets(GRID, HEIGHTS, np.full((40, 80), 3, np.uint8)), LINE, LINE[:0, :2], (10.0, 2.0), "predicted 10 m")
    assert size(png(made))  # drawn: everything has its place
    title, legend = made.axes[0].title.get_window_extent(), made.legends[0].get_window_extent()
    assert not title.overlaps(legend) and legend.y1 < title.y0 - 10


def test_items_have_a_panel_each_with_their_unit_and_limits():
    volts = Series("voltage_v", "V", TIMES, 21 + TIMES / 20, (22.0, 30.0))
    made = items([volts, Series("rtf", "s", TIMES, TIMES * 0)])
    assert [axes.get_ylabel() for axes in made.axes] == ["voltage_v", "rtf\ns"]  # a unit is not said twice
    assert made.axes[-1].get_xlabel() == "time of the run, s"
    assert 22.0 in [float(line.get_ydata()[0]) for line in made.axes[0].lines[1:]]
    assert len(made.axes[1].lines) == 1 and size(png(made))


def test_an_enumeration_is_drawn_in_steps_with_its_names_over_utc():
    mode = Series("mode", "", np.arange(4.0), np.array([1.0, 1.0, np.nan, 4.0]), None, {1: "STANDBY", 2: "AUTONOMOUS"})
    made = items([mode], 10**18)
    (axes,) = made.axes
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["STANDBY", "4"]
    assert axes.lines[0].get_drawstyle() == "steps-post" and axes.get_xlabel() == "UTC"
    assert size(png(made))
