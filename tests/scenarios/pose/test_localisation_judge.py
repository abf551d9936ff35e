"""Tests of the localisation judge: it reports each broken promise, and only those."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scenarios.pose.localisation import BAND_M, SLOPE_DEG, Row, ground_of, judge, slope

pytestmark = pytest.mark.tool

GOOD = Row(1, "level", "0.10 m from the goal", 20.0, 6, 0.05, 0.25, 0.2, 0.4, 1.0, (3.0, 5.0), (4.5, 3.5))


def test_a_flight_within_its_promises_is_not_named():
    assert judge([GOOD, replace(GOOD, seed=21, ground="slope", error_percent=0.9, error_m=0.18)]) == []


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"error_percent": 0.6}, "mean error"),
        ({"heading_deg": 0.7}, "heading"),
        ({"error_m": 0.12}, "0.12 m at the end"),
        ({"outcome": "no way"}, "no way"),
        ({"nees_after": (9.0, 8.0) * 25}, "NEES after"),
        ({"nees_before": (0.5, 2.0) * 25}, "NEES before"),  # a covariance that is too wide is not consistent either
    ],
)
def test_what_falls_short_is_named(change, word):
    assert any(word in text for text in judge([replace(GOOD, **change)]))


def test_fewer_than_50_stops_say_nothing_of_the_covariance():
    assert judge([replace(GOOD, nees_after=(9.0, 8.0) * 24)]) == []


@pytest.mark.parametrize("seed", [21, 22, 23])
def test_slopes_rise_by_20_degrees_and_the_orbiters_map_with_them(seed):
    field = slope(seed)
    rows, columns = np.mgrid[0 : field.grid.rows, 0 : field.grid.columns]
    plane = np.column_stack([columns.ravel(), rows.ravel(), np.ones(rows.size)])
    across, up, _ = np.linalg.lstsq(plane, field.soil_z.ravel().astype(float), rcond=None)[0] / field.grid.cell_m
    assert np.degrees(np.arctan(np.hypot(across, up))) == pytest.approx(SLOPE_DEG, abs=1.5)
    far = field.gdem.heights_m[-1, -1] - field.gdem.heights_m[0, 0]
    run_m = field.gdem.grid.cell_m * (np.array(field.gdem.heights_m.shape) - 1)
    assert far == pytest.approx(across * run_m[1] + up * run_m[0], abs=1.0)


@pytest.mark.parametrize(("seed", "kind", "level"), [(131, "soft", 101), (34, "soft", 4), (104, "level", 104)])
def test_seeds_a_hundred_on_are_other_fields_of_the_same_kind(seed, kind, level):
    name, field = ground_of(seed)
    assert name == kind
    assert (field.soil_z == ground_of(level)[1].soil_z).all()


def test_the_soft_band_lies_between_start_and_goal():
    kind, field = ground_of(31)
    assert kind == "soft"
    assert 0 < BAND_M[0] < BAND_M[1] < np.hypot(*field.goal_m)
