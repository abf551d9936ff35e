"""Interface of the global planner kernels: layers, edge costs and cost-to-go of a map, in one workspace.

    heights -> layers -> edges -> cost to go

`make_edges` does the first two steps: the layers are stored in the memory of the edges. Each step adds its finished
nodes to `Workspace.progress`, three times rows * columns in all, and stops soon after it is cancelled. Another thread
may read the progress and cancel while a step runs, because a step runs without the interpreter's lock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.kernel_calls.checks import check_array
from onboard.kernel_calls.progress import CancelledError, Progress
from onboard.native.variant import kernels
from onboard.records import F32, F64, I32, U8

AXES = 4
MOST_NODES = 2**31 - 1  # of a map: next_node is int32
STEPS = 3
HIGHEST_M = 1e7  # a height farther from zero counts as no data


@dataclass(frozen=True, slots=True)
class Workspace:
    """Memory for one plan over a map of (rows, columns), reusable; one plan at a time.

    rows, columns: size of the map.
    edges_m: float32, columns + 1 impassable nodes, then (rows * columns, 4): cost of the edge to the E, NE, N, NW, +inf
        impassable. The other four are the neighbours' (both directions cost the same). Before the edges it contains the
        layers from which they are computed.
    words, chunks: memory of the search.
    edges_cell_m: float64 (1,), cell size of the map whose edges these are, 0 while there are none.
    progress: progress.done counts finished nodes since it was 0.
    """

    rows: int
    columns: int
    edges_m: F32
    words: F64
    chunks: I32
    edges_cell_m: F64 = field(default_factory=lambda: np.zeros(1))
    progress: Progress = field(default_factory=Progress)

    def __post_init__(self) -> None:
        nodes, more = self.rows * self.columns, self.columns + 1
        check_array("edges_m", self.edges_m, (more + nodes, AXES), np.float32)
        check_array("words", self.words, (nodes + 2 * more,), np.float64)
        check_array("chunks", self.chunks, (_chunks(nodes), kernels.GLOBAL_CHUNK_NODES + 2), np.int32)
        check_array("edges_cell_m", self.edges_cell_m, (1,), np.float64)
        check_array("progress.done", self.progress.done, (1,), np.int64)
        check_array("progress.stop", self.progress.stop, (1,), np.uint8)


def _chunks(nodes: int) -> int:
    """Number of chunks in the worst case; most are never touched and then take no memory.

    Seeds: at most one per node.
    """
    return 9 * nodes // kernels.GLOBAL_CHUNK_NODES + kernels.GLOBAL_BUCKETS + 4


def workspace(rows: int, columns: int) -> Workspace:
    """Allocate a workspace for maps of this size: 24 bytes per node, and a little of `chunks`.

    Raises ValueError for an empty map or one of 2^31 nodes or more.
    """
    nodes, more = rows * columns, columns + 1
    if not (rows > 0 and columns > 0 and nodes <= MOST_NODES):
        raise ValueError(f"map: expected 1 to {MOST_NODES} nodes, given {rows} x {columns}")
    edges_m = np.empty((more + nodes, AXES), np.float32)
    edges_m[:more] = np.inf
    return Workspace(
        rows,
        columns,
        edges_m,
        np.empty(nodes + 2 * more),
        np.empty((_chunks(nodes), kernels.GLOBAL_CHUNK_NODES + 2), np.int32),
    )


class Prices(NamedTuple):
    """Cost of a metre above 1 (Eq. 25 divided by W_L / l_grid). All finite and >= 0."""

    roughest: float  # on the roughest ground of the map, proportional elsewhere
    roughest_at_least_m: float  # least roughness that counts as roughest ground; above 0
    per_roll_rad: float
    per_pitch_rad: float
    limit_rad: float  # steeper about either axis is impassable


def make_layers(heights_m: F32, cell_m: float, raw_roughness: bool, work: Workspace) -> F32:
    """Compute the layers of Eq. 21, 23, 24: float32 (3, rows, columns), roughness in metres and slopes along x and y.

    NaN without data. heights_m: float32 (rows, columns); NaN, infinite or more than HIGHEST_M from zero: no data.
    raw_roughness: True for the standard deviation as printed in Eq. 21. Overwrites `work.edges_m`. Raises ValueError
        for a
    wrong shape, dtype, layout or cell; CancelledError.
    """
    _check_map(heights_m, cell_m, work)
    work.edges_cell_m[0] = 0.0
    if not kernels.global_layers_into(heights_m, cell_m, raw_roughness, work.edges_m, *_watched(work)):
        raise CancelledError("global plan, while the layers were made")
    by_row = work.edges_m[work.columns + 1 :].reshape(work.rows, AXES, work.columns)
    return np.ascontiguousarray(by_row[:, :3].swapaxes(0, 1))


def make_edges(heights_m: F32, cell_m: float, prices: Prices, work: Workspace) -> None:
    """Compute the edges of Eq. 21 to 25 in `work.edges_m`.

    Raises as `make_layers` does, ValueError for wrong prices.
    """
    _check_map(heights_m, cell_m, work)
    if len(prices) != 5 or not all(0.0 <= price < math.inf for price in prices) or prices[1] == 0.0:
        raise ValueError(f"prices: expected 5 finite numbers >= 0, the second above, given {tuple(prices)}")
    work.edges_cell_m[0] = 0.0
    if not kernels.global_edges_into(heights_m, cell_m, np.array(prices, np.float32), work.edges_m, *_watched(work)):
        raise CancelledError("global plan, while the edges were made")
    work.edges_cell_m[0] = cell_m


def cost_to_go(seeds: tuple[NDArray[np.int64], F64], work: Workspace) -> tuple[F32, I32]:
    """Compute the cost to go of Eq. 26 from every node over `work.edges_m`: (cost, next), both (rows, columns).

    seeds: int64 (k,) flat indices of nodes and float64 (k,) remaining cost from each, metres >= 0.
    cost: float32 metres, +inf if there is no path.
    next: int32 flat index of the next node on the path, the node itself where its seed is the least, -1 if there is no
        path.

    Exact to the rounding of the result. Raises ValueError for wrong arguments; CancelledError.
    """
    places, costs_m = seeds
    nodes = work.rows * work.columns
    check_array("seeds", places, (None,), np.int64)
    check_array("seed costs", costs_m, (len(places),), np.float64)
    cell_m = float(work.edges_cell_m[0])
    if cell_m == 0.0:
        raise ValueError("work: expected edges made by make_edges, given none")
    if not kernels.global_seeds_fit(places, costs_m, nodes):
        raise ValueError(_wrong_seeds(places, costs_m, nodes))
    cost_m = np.empty((work.rows, work.columns), np.float32)
    next_node = np.empty((work.rows, work.columns), np.int32)
    scratch = (work.words, work.chunks, *_watched(work))
    if not kernels.global_cost_to_go_into(work.edges_m, cell_m, places, costs_m, *scratch, cost_m, next_node):
        raise CancelledError("global plan, while the way was searched")
    return cost_m, next_node


def _wrong_seeds(places: NDArray[np.int64], costs_m: F64, nodes: int) -> str:
    """Error message for seeds that do not fit."""
    if places.min() >= 0 and places.max() < nodes and len(places) <= nodes:
        return f"seed costs: expected finite costs >= 0, given {costs_m.min()} to {costs_m.max()}"
    return f"seeds: expected at most {nodes} of 0 to {nodes - 1}, given {places.min()} to {places.max()}"


def _watched(work: Workspace) -> tuple[NDArray[np.int64], U8]:
    return work.progress.done, work.progress.stop


def _check_map(heights_m: F32, cell_m: float, work: Workspace) -> None:
    check_array("heights_m", heights_m, (work.rows, work.columns), np.float32)
    if not 1e-3 <= cell_m <= 1e6:
        raise ValueError(f"cell_m: expected 0.001 to 1000000 m, given {cell_m}")
