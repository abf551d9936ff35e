"""All heights of the ground are one triangulation."""

import numpy as np

from hil.terrain.mesh import block_mean, slopes_deg, soil_height
from onboard.records import Grid


def test_slope_of_a_plane_is_its_angle():
    z = np.tan(np.radians(7.0)) * 0.1 * np.arange(9)[None, :] * np.ones((5, 1))
    np.testing.assert_allclose(slopes_deg(z, 0.1), 7.0)


def test_soil_height_is_the_triangle_cut_from_right_to_upper():
    grid = Grid(0.5, 0.5, 1.0, 2, 2)
    z = np.array([[0, 0], [0, 1]], np.float32)
    x, y = np.array([0.75, 1.0, 1.25, 1.5, 9.0]), np.array([0.75, 1.0, 1.25, 1.5, 9.0])
    np.testing.assert_allclose(soil_height(grid, z, x, y), [0, 0, 0.5, 1, 1])


def test_block_mean_of_a_block():
    np.testing.assert_allclose(block_mean(np.arange(16.0).reshape(4, 4), 2), [[2.5, 4.5], [10.5, 12.5]])
