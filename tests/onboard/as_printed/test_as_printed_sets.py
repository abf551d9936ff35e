"""Section 5.1.1 and Eq. 2 to 5 as printed."""

import itertools

import numpy as np

from docs.as_printed.sets import eq_2_to_5_hold, node_numbers
from onboard.planning.local.poses import Freedom, node_sets
from onboard.records import CellClass, Grid, NodeSet, Surface


def test_from_0_to_n_is_one_node_more_than_the_map_has():
    assert len(node_numbers(200 * 200)) == 40_001


def test_eq_2_to_5_are_circular_every_way_to_part_the_map_fulfils_them():
    ways = list(itertools.product(range(3), repeat=4))
    parts = [[{n for n in range(4) if way[n] == k} for k in range(3)] for way in ways]
    assert all(eq_2_to_5_hold({0, 1, 2, 3}, *part) for part in parts)
    assert len(parts) == 81


def test_the_correction_has_one_answer_from_what_the_beams_said():
    grid, none = Grid(0.05, 0.05, 0.1, 1, 4), np.full((1, 4), np.nan, np.float32)
    classes = np.array([[CellClass.HIT, CellClass.HIT, CellClass.OCCLUDED, CellClass.OUTSIDE]], np.uint8)
    freedom = np.full((8, 1, 4), Freedom.UNKNOWN, np.uint8)
    freedom[:, 0, 0], freedom[:, 0, 1] = Freedom.FREE, Freedom.BLOCKED
    sets = node_sets(Surface(grid, classes, none, none, none, none), freedom, freedom == Freedom.FREE)
    assert sets.tolist() == [[NodeSet.FREE, NodeSet.OBSTACLE, NodeSet.OCCLUDED, NodeSet.OUTSIDE]]
