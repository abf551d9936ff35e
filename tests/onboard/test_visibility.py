"""Algorithm 1 and Eq. 6, corrected, against a plain loop."""

import math
from collections import Counter

import numpy as np
import pytest

from onboard.planning import visibility


def oracle(z, table, cell, height, optimistic, fill):
    """Beam by beam, step by step, over distinct cells."""
    rows, columns = z.shape
    j0, i0 = cell
    eye = (fill[j0, i0] if np.isnan(z[j0, i0]) else z[j0, i0]) + height
    samples, seen = Counter(), Counter()
    for t in range(len(table.dj)):
        steepest = -math.inf
        for k in range(table.dj.shape[1]):
            dj, di = int(table.dj[t, k]), int(table.di[t, k])
            j, i = j0 + dj, i0 + di
            if dj == di == 0:
                continue
            samples[dj, di] += 1
            inside = 0 <= j < rows and 0 <= i < columns
            unknown = not inside or np.isnan(z[j, i])
            h = fill[min(max(j, 0), rows - 1), min(max(i, 0), columns - 1)] if unknown else z[j, i]
            slope = (h - eye) / table.distance_m[t, k]
            if inside and slope >= steepest - 1e-6:
                seen[dj, di] += 1
            if not unknown:
                steepest = max(steepest, slope)
            elif not optimistic:
                steepest = math.inf
    total = sum(1 for dj, di in samples if 0 <= j0 + dj < rows and 0 <= i0 + di < columns)
    return sum(seen[c] / samples[c] for c in seen) / total


@pytest.mark.parametrize("optimistic", [True, False])
def test_equals_the_plain_loop_on_rough_ground_with_unknown_cells(optimistic):
    rng = np.random.default_rng(1)
    z = rng.normal(0, 0.15, (40, 36)).astype(np.float32)
    z[rng.random(z.shape) < 0.08] = np.nan
    table = visibility.beams(1.5, 0.1, 90)
    fill = visibility.predicted(z)
    cells = np.array([[20, 18], [3, 4], [38, 30], [10, 35]])
    seen = visibility.look(visibility.scene(z, table), table, cells, 0.7, optimistic)
    for n, cell in enumerate(cells):
        assert seen.index[n] == pytest.approx(oracle(z, table, cell, 0.7, optimistic, fill), abs=1e-5)


def test_flat_ground_is_seen_whole_from_everywhere():
    table = visibility.beams(4.0, 0.1)
    z = np.zeros((80, 80), dtype=np.float32)
    seen = visibility.look(visibility.scene(z, table), table, np.array([[40, 40], [0, 0], [79, 12]]), 0.7)
    np.testing.assert_allclose(seen.index, 1.0, atol=1e-9)


def test_distinct_cells_are_counted_once():
    table = visibility.beams(2.0, 0.1, 720)
    z = np.zeros((60, 60), dtype=np.float32)
    seen = visibility.look(visibility.scene(z, table), table, np.array([[30, 30]]), 0.7)
    offsets = {(int(a), int(b)) for a, b in zip(table.dj.ravel(), table.di.ravel())} - {(0, 0)}
    assert seen.in_range[0] == pytest.approx(len(offsets))


def test_a_wall_hides_what_lies_behind_it():
    z = np.zeros((80, 80), dtype=np.float32)
    z[:, 50] = 1.5
    table = visibility.beams(4.0, 0.1)
    hidden = visibility.look(visibility.scene(z, table), table, np.array([[40, 40]]), 0.7)
    low = z.copy()
    low[:, 50] = 0.05
    open_ = visibility.look(visibility.scene(low, table), table, np.array([[40, 40]]), 0.7)
    assert hidden.index[0] < 0.85
    assert hidden.index[0] < open_.index[0]


def test_unknown_cells_hide_only_for_the_pessimist():
    z = np.zeros((60, 60), dtype=np.float32)
    z[:, 40] = np.nan
    table = visibility.beams(2.5, 0.1)
    ground, cells = visibility.scene(z, table), np.array([[30, 30]])
    assert visibility.look(ground, table, cells, 0.7).index[0] == pytest.approx(1.0)
    assert visibility.look(ground, table, cells, 0.7, optimistic=False).index[0] < 0.9


def test_best_heading_looks_at_the_unknown_side():
    z = np.zeros((60, 60), dtype=np.float32)
    z[45:, :] = np.nan
    table = visibility.beams(2.5, 0.1)
    seen = visibility.look(visibility.scene(z, table), table, np.array([[30, 30]]), 0.7)
    heading, cells = visibility.best_heading(seen.new, math.radians(65))
    assert cells[0] == pytest.approx(seen.new.sum(), rel=1e-6)
    assert abs(heading[0] - math.pi / 2) < math.radians(65)


def test_nothing_known_is_predicted_flat():
    assert not visibility.predicted(np.full((3, 3), np.nan, dtype=np.float32)).any()
