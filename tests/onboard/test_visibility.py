"""Algorithm 1 and Eq. 6, corrected: what a scanner sees from a place."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.planning import visibility
from tests import oracles_visibility as oracles


def rough(seed: int, shape: tuple[int, int], holes: float = 0.1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z = rng.normal(0, 0.15, shape).astype(np.float32)
    z[rng.random(shape) < holes] = np.nan
    return z


@pytest.mark.parametrize("optimistic", [True, False])
@pytest.mark.parametrize("shape", [(1, 1), (1, 23), (24, 19)])
def test_every_node_equals_the_plain_loop_on_rough_ground_with_unknown_cells(shape, optimistic):
    z, table = rough(1, shape), visibility.beams(0.9, 0.1, 60)
    ground = visibility.scene(z, optimistic=optimistic)
    found = visibility.total(ground, table, 0.7)
    for node in np.ndindex(shape):
        sees, cells, seen = oracles.algorithm_1(z, visibility.predicted(z), node, (60, 9, 0.1), optimistic)
        view = visibility.from_node(ground, table, 0.7, node)
        assert {(int(j), int(i)) for j, i in np.argwhere(view.seen)} == seen
        assert found.range_cells[node] == pytest.approx(cells)
        assert found.seen_cells[node] == view.seen_cells
        assert found.seen_cells[node] == pytest.approx(float(sees), abs=0.01)
