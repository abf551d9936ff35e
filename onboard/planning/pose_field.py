"""Cost-to-go over poses (cell, 8 orientations): straight, crab, turn on the spot; `10-navigation` section 5."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard import config
from onboard.records import F32, I32, U8


def cost_to_go(
    freedom: U8,
    seeds: NDArray[np.integer],
    planning: config.Planning,
    cell_m: float,
    optimistic: bool,
    closeness: F32 | None = None,
) -> F32:
    """Price in metres from every pose to the nearest seed, float32 (8, rows, columns), inf where there is no way.

    seeds: (k, 3) integers j, i, o; o = -1 stands for all eight orientations; a seed that is not passable counts for nothing.
    optimistic: unknown poses are passable at the same price, else free ones only. closeness: ratio, the price of an edge is
    multiplied by 1 + its mean at both ends. Edges have the same price both ways, so this is the cost-to-come as well.
    """
    raise NotImplementedError


def descend(cost: F32, start: tuple[int, int, int], planning: config.Planning, cell_m: float,
            closeness: F32 | None = None) -> I32:
    """The cheapest way from a pose (j, i, o) to a seed: int32 (k, 3) poses j, i, o, start and seed included.

    Give planning, cell_m and closeness as for cost_to_go. Raises ValueError where the cost of the start is inf.
    """
    raise NotImplementedError
