"""The orbiter's map takes over what the rover has seen."""

from __future__ import annotations

import numpy as np

from onboard.planning.gdem_refresh import refresh
from onboard.planning.local.poses import Freedom
from onboard.records import CellClass, Gdem, Grid, Surface

FINE = Grid(-9.95, -9.95, 0.1, 200, 200)
COARSE = Grid(-15.0, -15.0, 10.0, 4, 4)  # borders at -20, -10, 0, 10, 20: the window is its four middle cells


def window(known=True, z_m=1.5) -> Surface:
    kind = np.full((200, 200), CellClass.HIT if known else CellClass.OCCLUDED, np.uint8)
    heights = np.where(kind >= CellClass.HIT, np.float32(z_m), np.float32(np.nan))
    return Surface(FINE, kind, heights, heights, heights, np.full((200, 200), np.inf, np.float32))


def freedom(value=Freedom.FREE) -> np.ndarray:
    return np.full((8, 200, 200), value, np.uint8)


def orbit() -> Gdem:
    return Gdem(COARSE, np.zeros((4, 4), np.float32), "flat")


def test_a_cell_that_is_seen_takes_the_mean_of_what_was_seen() -> None:
    got = refresh(orbit(), window(), freedom()).heights_m
    assert (got[1:3, 1:3] == 1.5).all()
    assert (np.delete(got.ravel(), [5, 6, 9, 10]) == 0.0).all()


def test_a_cell_seen_by_less_than_half_keeps_the_orbiters_height() -> None:
    seen = window(known=False)
    seen.cell_class[:100, :49] = CellClass.HIT
    seen.z_mean[:100, :49] = 3.0
    assert refresh(orbit(), seen, freedom(Freedom.UNKNOWN)).heights_m[1, 1] == 0.0
    seen.cell_class[:100, :51] = CellClass.HIT
    seen.z_mean[:100, :51] = 3.0
    assert refresh(orbit(), seen, freedom(Freedom.UNKNOWN)).heights_m[1, 1] == 3.0


def test_a_wall_through_a_cell_leaves_it_open_while_ground_beside_it_joins_two_sides() -> None:
    walled = freedom()
    walled[:, 40:45, :100] = Freedom.BLOCKED
    assert np.isfinite(refresh(orbit(), window(), walled).heights_m).all()


def test_ground_that_joins_no_two_sides_closes_the_cell() -> None:
    shut = freedom()
    shut[:, :100, :100] = Freedom.BLOCKED
    shut[:, 30:60, 30:60] = Freedom.FREE  # a court without a gate
    got = refresh(orbit(), window(), shut).heights_m
    assert np.isnan(got[1, 1])
    assert np.isfinite(got).sum() == 15


def test_a_cell_that_is_to_stay_open_takes_its_height_but_is_not_closed() -> None:
    shut = freedom()
    shut[:, :100, :100] = Freedom.BLOCKED
    assert refresh(orbit(), window(), shut, ((-3.0, -7.0),)).heights_m[1, 1] == 1.5


def test_a_map_that_nothing_changes_is_the_same_object() -> None:
    given = orbit()
    assert refresh(given, window(known=False), freedom(Freedom.UNKNOWN)) is given


def test_a_window_beside_the_orbiters_map_changes_nothing() -> None:
    far = Gdem(Grid(1000.0, 1000.0, 10.0, 4, 4), np.zeros((4, 4), np.float32))
    assert refresh(far, window(), freedom()) is far
