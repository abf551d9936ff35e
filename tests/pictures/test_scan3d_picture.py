"""The picture of a 3D scan shows the scan: white where there is no point, the floor flat only where interpolated."""

from __future__ import annotations

import numpy as np
import pytest

from pictures.scan3d import held, scan_figure
from tests.onboard.nodding import EXACT, ROVER, Nodding

pytestmark = pytest.mark.tool


@pytest.fixture(scope="module")
def scan():
    bench = Nodding(EXACT)
    bench.settle(3)
    return bench.sweep(0, 60, 30)


def panels(made):
    axes = [each for each in made.axes if each.get_title()]
    return {each.get_title(): each for each in axes}


def test_image_has_a_pixel_for_each_beam_and_is_white_where_there_is_no_point(scan):
    (image,) = panels(scan_figure(scan, ROVER))["range image: one line a turn"].get_images()
    shown = np.ma.filled(image.get_array().astype(float), np.nan)[:, ::-1]
    assert shown.shape == scan.pixels.shape
    assert np.array_equal(np.isfinite(shown), scan.valid) and 0 < scan.valid.sum() < scan.valid.size


def test_floor_is_flat_with_the_tilt_of_each_beam_and_not_with_one_for_a_turn(scan):
    wrong, right = panels(scan_figure(scan, ROVER))["heights of the floor's points"].collections
    z_wrong, z_right = (np.asarray(each.get_offsets())[:, 1] for each in (wrong, right))
    assert len(z_wrong) == len(z_right) > 10_000
    assert np.nanstd(z_right) < 3.0 < 1.5 * 3.0 < np.nanstd(z_wrong)  # mm


def test_held_scan_differs_in_the_tilt_alone(scan):
    flat = held(scan)
    assert (np.ptp(flat.pixels["tilt_rad"], axis=1) == 0).any()
    assert np.array_equal(flat.pixels["time_ns"], scan.pixels["time_ns"])
