"""Rocks have their law of sizes, a shape that holds together, and room around them."""

import math

import numpy as np
import pytest

from hil.terrain.rock_sizes import Golombek, PowerLaw
from hil.terrain.rocks import rock_top, scatter_rocks
from onboard.records import Grid

AREA_M2 = 400.0


def share(diameters, at_least_m):
    """Share of the area under rocks of this diameter or larger."""
    return math.pi / 4 * (diameters[diameters >= at_least_m] ** 2).sum() / AREA_M2


def test_power_law_has_its_exponent_and_fills_its_share():
    drawn = [PowerLaw(0.035).diameters_m(AREA_M2, np.random.default_rng(seed)) for seed in range(20)]
    assert [share(sizes, 0.15) for sizes in drawn] == pytest.approx([0.035] * 20, rel=0.03)
    sizes = np.concatenate(drawn)
    assert sizes.min() >= 0.15 and sizes.max() <= 1.2
    cut = 1.2**-2
    assert (sizes > 0.3).mean() == pytest.approx((0.3**-2 - cut) / (0.15**-2 - cut), rel=0.05)  # N(> D) ~ D^-2


@pytest.mark.parametrize("k", [0.02, 0.05, 0.1, 0.2])
def test_golombeks_cumulative_share_of_the_area_is_his_law(k):
    """F_k(D) = k exp(-(1.79 + 0.152 / k) D), less F_k(1.2): the mean of 400 fields, to 1 % of all that is covered."""
    fields = [Golombek(k).diameters_m(AREA_M2, np.random.default_rng(seed)) for seed in range(400)]
    q = 1.79 + 0.152 / k
    law = {diameter: k * (math.exp(-q * diameter) - math.exp(-q * 1.2)) for diameter in (0.15, 0.2, 0.3, 0.5, 0.8)}
    for diameter, expected in law.items():
        found = np.mean([share(sizes, diameter) for sizes in fields])
        assert found == pytest.approx(expected, abs=0.01 * law[0.15])
    assert min(map(np.min, fields)) >= 0.15 and max(map(np.max, fields)) <= 1.2


@pytest.mark.parametrize("k", [0.05, 0.2])
def test_each_golombek_field_covers_what_its_dial_says(k):
    law = Golombek(k, smallest_m=0.1, largest_m=4.0)
    for seed in range(10):
        assert share(law.diameters_m(AREA_M2, np.random.default_rng(seed)), 0.1) == pytest.approx(
            law.area_ratio(0.1), rel=0.03
        )


def test_golombeks_number_is_the_integral_of_his_area():
    law = Golombek(0.08)
    edges = np.geomspace(0.15, 30.0, 40001)
    middle = np.sqrt(edges[1:] * edges[:-1])
    number = -np.diff(law.area_ratio(edges)) / (math.pi / 4 * middle**2)
    assert law.number_per_m2(0.15) == pytest.approx(number.sum(), rel=1e-6)


@pytest.mark.parametrize("law", [PowerLaw(0.04), Golombek(0.06)])
def test_same_seed_same_sizes_largest_first(law):
    first, second = (law.diameters_m(AREA_M2, np.random.default_rng(8)) for _ in range(2))
    assert first.tobytes() == second.tobytes() and (np.diff(first) <= 0).all()
    assert first.tobytes() != law.diameters_m(AREA_M2, np.random.default_rng(9)).tobytes()


def test_so_little_ground_that_no_rock_is_due_has_none():
    assert len(Golombek(0.01).diameters_m(1e-9, np.random.default_rng(1))) == 0
    assert len(PowerLaw(0.0).diameters_m(AREA_M2, np.random.default_rng(1))) == 0


@pytest.mark.parametrize("make", [lambda: PowerLaw(-0.1), lambda: Golombek(0.7), lambda: Golombek(0.1, 0.5, 0.4)])
def test_dials_out_of_range_are_refused(make):
    with pytest.raises(ValueError, match="should be"):
        make()


@pytest.fixture(scope="module")
def rocks():
    grid = Grid(-9.975, -9.975, 0.05, 400, 400)
    soil_z = np.zeros((400, 400), np.float32)
    return scatter_rocks(grid, soil_z, PowerLaw(0.04), ((0, 0, 1.2),), np.random.default_rng(4))


def test_rocks_are_closed_outward_polyhedra_half_buried(rocks):
    for rock in rocks:
        edges = np.sort(np.concatenate([rock.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
        a, b, c = (rock.vertices_m[rock.triangles[:, k]] for k in range(3))
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 > 0  # the volume
        assert rock.vertices_m[:, 2].min() < 0 < rock.height_m < 0.7 * rock.diameter_m


def test_rocks_do_not_overlap_and_keep_clear(rocks):
    x, y, d = (np.array([getattr(r, k) for r in rocks]) for k in ("x_m", "y_m", "diameter_m"))
    gap = np.hypot(x[:, None] - x, y[:, None] - y) - (d[:, None] + d) / 2 + 100 * np.eye(len(d))
    assert gap.min() > 0 and (np.hypot(x, y) - d / 2).min() > 1.2


def test_rock_top_is_its_height_over_the_peak_and_nothing_beside(rocks):
    rock = rocks[0]
    peak = rock.vertices_m[rock.vertices_m[:, 2].argmax()]
    top = rock_top(rock, np.array([peak[0], peak[0] + 2]), np.array([peak[1], peak[1]]))
    assert top[0] == pytest.approx(peak[2], abs=1e-6) and top[1] == -np.inf
