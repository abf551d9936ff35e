"""The pictures of docs/as-printed.md show what they are given."""

import numpy as np
import pytest

from onboard.records import Grid
from pictures import printed
from pictures.style import png
from pictures.terrain import Ground

pytestmark = pytest.mark.tool

GROUND = Ground(Grid(-1.9, -3.9, 0.2, 40, 80), np.zeros((40, 80), np.float32), np.array([[2.0, 1.0, 0.8]]), "made up")


def test_vis_maps_share_one_scale_from_0_to_1_and_say_their_median():
    nodes = Grid(-1.9, -3.9, 0.4, 20, 40)
    made = printed.visibility(GROUND, nodes, [(name, np.full((20, 40), vis)) for name, vis in (("a", 0.0), ("b", 0.5))])
    assert [axes.get_title() for axes in made.axes[1:3]] == ["a\nmedian Vis 0.000", "b\nmedian Vis 0.500"]
    assert {axes.images[0].get_clim() for axes in made.axes[1:3]} == {(0.0, 1.0)}


def test_climbs_run_over_the_nodes_from_a_start_to_a_cross_and_the_best_node_has_a_star():
    nodes, climb = Grid(-1.9, -3.9, 0.4, 20, 40), np.array([[0, 0], [1, 1], [1, 2]])
    left, right = printed.Scores("a", np.zeros((20, 40)), [climb]), printed.Scores("b", np.ones((20, 40)), (), (4, 5))
    made = printed.search(GROUND, nodes, (3.0, 1.0), (left, right))
    np.testing.assert_allclose(made.axes[0].lines[0].get_xydata(), [(-1.9, -3.9), (-1.5, -3.5), (-1.1, -3.5)])
    np.testing.assert_allclose(made.axes[1].lines[0].get_xydata(), [(0.1, -2.3)])
    names = [text.get_text() for text in made.legends[0].get_texts()]
    assert names == ["start of a climb", "where it was cut off", "best node", "goal"]


def test_axles_of_wheels_steered_right_pass_through_the_centre_of_the_turn():
    places = np.array([(0.375, 0.25), (-0.375, 0.25), (-0.375, -0.25), (0.375, -0.25)])
    angles = np.arctan2(0.1 * places[:, 0], 0.11 - 0.1 * places[:, 1])
    turn = printed.WheelSteering("left", places, angles, 0.11, 0.1)
    made = printed.steering([turn, turn], np.array([0.0, 1.0]), [("a", np.zeros(2)), ("b", np.ones(2))])
    for line in made.axes[0].lines[:4]:
        a, b = line.get_xydata()
        centre, along = np.array([-1.1, 0.0]), (b - a) / np.hypot(*(b - a))
        assert abs(np.linalg.det([along, centre - a])) < 1e-9
    assert [text.get_text() for text in made.axes[0].texts[:8:2]] == ["+23.8°", "-23.8°", "-15.5°", "+15.5°"]


def test_sigma_is_drawn_over_every_size_of_map():
    made = printed.fractal((32, 64), [("a", np.array([0.5, 0.4])), ("b", np.ones(2))], [GROUND, GROUND])
    assert [line.get_ydata().tolist() for line in made.axes[0].lines] == [[0.5, 0.4], [1.0, 1.0]]
    data = png(made, 100)
    assert [int.from_bytes(data[at : at + 4], "big") for at in (16, 20)] == [900, 370]
