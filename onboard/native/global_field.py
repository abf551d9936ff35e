"""The door to the global planner: layers, edge costs and cost-to-go of a map, in one workspace.

    heights -> layers -> edges -> cost to go

Each step adds the nodes it has done to `Workspace.progress`, three times rows * columns in all, and stops soon after it
is cancelled: another thread may look and cancel while a step runs, for it holds no lock.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from onboard.native.checks import check_array
from onboard.native.progress import CancelledError, Progress
from onboard.native.variant import kernels
from onboard.records import F32, F64, I32, U8

AXES = 4
MOST_NODES = 2**31 - 1  # of a map: next_node is int32
STEPS = 3
HIGHEST_M = 1e7  # farther from zero is no height: no data


@dataclass(frozen=True, slots=True)
class Workspace:
    """Room for one plan over a map of (rows, columns), used again and again; one plan at a time.

    layers: float32 (3, rows, columns) roughness (m) and the slopes along x and y, NaN without data. edges_m: float32,
    columns + 1 impassable nodes, then (rows * columns, 4): cost of the edge to the E, NE, N, NW, +inf impassable. The
    other four are the neighbours' (both directions cost the same). words, chunks: the search's.
    progress.done: nodes done since it was 0.
    """

    rows: int
    columns: int
    layers: F32
    edges_m: F32
    words: F64
    chunks: I32
    progress: Progress = field(default_factory=Progress)

    def __post_init__(self) -> None:
        nodes, more = self.rows * self.columns, self.columns + 1
        check_array("layers", self.layers, (3, self.rows, self.columns), np.float32)
        check_array("edges_m", self.edges_m, (more + nodes, AXES), np.float32)
        check_array("words", self.words, (nodes + 2 * more,), np.float64)
        check_array("chunks", self.chunks, (_chunks(nodes), kernels.GLOBAL_CHUNK_NODES + 2), np.int32)
        check_array("progress.done", self.progress.done, (1,), np.int64)
        check_array("progress.stop", self.progress.stop, (1,), np.uint8)


def _chunks(nodes: int) -> int:
    """Of the worst case; most are never touched and then take no memory. Seeds: at most one for each node."""
    return 9 * nodes // kernels.GLOBAL_CHUNK_NODES + kernels.GLOBAL_BUCKETS + 4


def workspace(rows: int, columns: int) -> Workspace:
    """Room for maps of this size: 36 bytes a node, and a little of `chunks`.

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
        np.empty((3, rows, columns), np.float32),
        edges_m,
        np.empty(nodes + 2 * more),
        np.empty((_chunks(nodes), kernels.GLOBAL_CHUNK_NODES + 2), np.int32),
    )


def make_layers(heights_m: F32, cell_m: float, raw_roughness: bool, work: Workspace) -> float:
    """Eq. 21, 23, 24: fills `work.layers`; the largest roughness in metres, 0 without data.

    heights_m: float32 (rows, columns); NaN, infinite or more than HIGHEST_M from zero: no data. `raw_roughness`: the
    standard deviation as printed in Eq. 21. Raises ValueError for wrong shape, dtype, layout or cell,
    CancelledError.
    """
    _check_map(heights_m, cell_m, work)
    roughest_m = kernels.global_layers_into(heights_m, cell_m, raw_roughness, work.layers, *_watched(work))
    if roughest_m < 0.0:
        raise CancelledError("global plan, while the layers were made")
    return roughest_m


def make_edges(heights_m: F32, cell_m: float, prices: tuple[float, float, float, float], work: Workspace) -> None:
    """Eq. 25: fills `work.edges_m` from `work.layers`.

    prices: what a metre costs above 1 for each metre of roughness, radian of roll and radian of pitch, all >= 0, and
    the steepest roll or pitch in radians. Raises ValueError for wrong arguments, CancelledError.
    """
    _check_map(heights_m, cell_m, work)
    given = np.array(prices, np.float32)
    if given.shape != (4,) or not (np.isfinite(given).all() and given.min() >= 0.0):
        raise ValueError(f"prices: expected 4 finite numbers >= 0, given {prices}")
    if not kernels.global_edges_into(heights_m, cell_m, work.layers, given, work.edges_m, *_watched(work)):
        raise CancelledError("global plan, while the edges were made")


def cost_to_go(seeds: tuple[NDArray[np.int64], F64], cell_m: float, work: Workspace) -> tuple[F32, I32]:
    """Eq. 26 from every node at once, over `work.edges_m`: (cost, next), both (rows, columns).

    seeds: int64 (k,) flat indices of nodes and float64 (k,) what is left to go from each, metres >= 0. cost: float32
    metres, +inf where there is no way. next: int32 flat index of the next node on the way, the node itself where its
    seed is the least, -1 where there is no way. Exact to rounding of the result. Raises ValueError for wrong
    arguments, CancelledError.
    """
    places, costs_m = seeds
    nodes = work.rows * work.columns
    check_array("seeds", places, (None,), np.int64)
    check_array("seed costs", costs_m, (len(places),), np.float64)
    _check_cell(cell_m)
    if len(places) and not (places.min() >= 0 and places.max() < nodes and len(places) <= nodes):
        raise ValueError(f"seeds: expected at most {nodes} of 0 to {nodes - 1}, given {places.min()} to {places.max()}")
    if len(places) and not (costs_m.min() >= 0 and np.isfinite(costs_m.max())):
        raise ValueError(f"seed costs: expected finite costs >= 0, given {costs_m.min()} to {costs_m.max()}")
    cost_m = np.empty((work.rows, work.columns), np.float32)
    next_node = np.empty((work.rows, work.columns), np.int32)
    scratch = (work.words, work.chunks, *_watched(work))
    if not kernels.global_cost_to_go_into(work.edges_m, cell_m, places, costs_m, *scratch, cost_m, next_node):
        raise CancelledError("global plan, while the way was searched")
    return cost_m, next_node


def _watched(work: Workspace) -> tuple[NDArray[np.int64], U8]:
    return work.progress.done, work.progress.stop


def _check_map(heights_m: F32, cell_m: float, work: Workspace) -> None:
    check_array("heights_m", heights_m, (work.rows, work.columns), np.float32)
    _check_cell(cell_m)


def _check_cell(cell_m: float) -> None:
    if not 1e-3 <= cell_m <= 1e6:
        raise ValueError(f"cell_m: expected 0.001 to 1000000 m, given {cell_m}")
