"""Visibility of cells from a place (Algorithm 1, Eq. 6, corrected).

    z_s  +----____             beam t steps cell by cell away from the observer; slope S = (Z(cell) - z_s) / distance.
         |        ----___      A cell is visible if S >= S_max - 1e-6, S_max being the steepest slope before it
         |     /\\        --   (it starts at -inf), so flat ground is seen whole: Vis = 1.000.
    -----+----/  \\----------

The offsets (dj, di) of step k of beam t are the same for every observer: one table, `Beams`. Near the observer many
beams sample one cell, so each sample counts as a share of it and sums count distinct cells: a cell seen by half of its
beams counts half. The shares are integers, so sums and ties are exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from onboard.kernel_calls import visibility as native
from onboard.kernel_calls.progress import Progress
from onboard.kernel_calls.visibility import Beams
from onboard.native import each
from onboard.records import F32, F64, I32, Bool

__all__ = [
    "Beams",
    "Scene",
    "Sector",
    "View",
    "Visibility",
    "VisibilityRequest",
    "beams",
    "from_node",
    "predicted",
    "scene",
    "total",
]


@dataclass(frozen=True, slots=True)
class Scene:
    """Ground of a view, arrays (rows, columns).

    height_m: float32, predicted where unknown.
    unknown: bool.
    veil: float32, added by `kernel_calls.visibility.total` to the slope of a cell before it hides others; None if every
        cell is known.
    """

    height_m: F32
    unknown: Bool
    veil: F32 | None


@dataclass(frozen=True, slots=True)
class Sector:
    """Beams within half_rad of a heading. Finite angles.

    heading_rad: one for all nodes, or (rows, columns) of them.
    half_rad: half width.
    """

    heading_rad: float | F64
    half_rad: float


@dataclass(frozen=True, slots=True)
class VisibilityRequest:
    """Request to `total`.

    where: bool (rows, columns), nodes to compute; None = all.
    sector: None = all round.
    new_half_rad: half width of the sector in which newly seen cells are sought, pi = all round; None = not computed.
    targets: bool (rows, columns), the cells that count as newly seen; None = the unknown ones.
    """

    where: Bool | None = None
    sector: Sector | None = None
    new_half_rad: float | None = None
    targets: Bool | None = None


@dataclass(frozen=True, slots=True)
class Visibility:
    """Result for every node, float64 (rows, columns), NaN where not requested.

    index: Vis (Eq. 6), cells seen / cells of the map in range and sector.
    seen_cells, range_cells: both numbers.
    new_cells: targets seen in the best sector of the requested width.
    heading_rad: middle of that sector, in (-pi, pi], the smallest azimuth of equal ones.
    gain: new_cells / all cells of that sector in range, those beyond the map included.
    """

    index: F64
    seen_cells: F64
    range_cells: F64
    new_cells: F64
    heading_rad: F64
    gain: F64


@dataclass(frozen=True, slots=True)
class View:
    """View of one observer.

    seen: bool (rows, columns), cells of which at least one beam sees a part.
    index, seen_cells, range_cells: as in `Visibility`.
    """

    seen: Bool
    index: float
    seen_cells: float
    range_cells: float


def beams(range_m: float, cell_m: float, count: int = 360) -> Beams:
    """The table for a range and a number of beams around the circle; steps are one cell long.

    Raises ValueError for a range below one cell, no beams or a table of 2^31 cells or more.
    """
    if not (cell_m > 0 and cell_m <= range_m + 1e-9 * cell_m and math.isfinite(range_m)):
        raise ValueError(f"range_m: expected at least one cell of {cell_m} m, given {range_m}")
    if count < 1:
        raise ValueError(f"count: expected at least 1 beam, given {count}")
    k = np.arange(1, int(range_m / cell_m + 1e-9) + 1)
    angle = np.arange(count) * (math.tau / count)
    # rounding to 1e-9 cell first, so that the last bit of this machine's cosine does not decide how a half rounds
    di = np.rint(np.round(k * each.cos(angle)[:, None], 9)).astype(np.int32)
    dj = np.rint(np.round(k * each.sin(angle)[:, None], 9)).astype(np.int32)
    inverse = (1.0 / (each.hypot(di, dj) * cell_m)).astype(np.float32)
    share, whole, cells = _shares(dj, di)
    return Beams(dj, di, inverse, share, whole, cells)


def _shares(dj: I32, di: I32) -> tuple[I32, int, int]:
    """Integers that sum to `whole` over the samples of each cell; whole is a power of 2, whole * cells < 2^31."""
    side = 2 * dj.shape[1] + 1
    flat = ((dj.astype(np.int64) + dj.shape[1]) * side + di + dj.shape[1]).ravel()
    _, cell, samples = np.unique(flat, return_inverse=True, return_counts=True)
    order = np.argsort(cell, kind="stable")
    rank = np.empty(len(flat), np.int64)
    rank[order] = np.arange(len(flat)) - np.repeat(np.cumsum(samples) - samples, samples)
    cells = len(samples)
    whole = 1 << ((2**31 - 1) // cells).bit_length() - 1
    of = samples[cell]
    share = (rank + 1) * whole // of - rank * whole // of
    return share.astype(np.int32).reshape(dj.shape), whole, cells


def predicted(z_mean: F32) -> F32:
    """Heights with each unknown (NaN) cell at the height of the nearest known one; all 0 if nothing is known."""
    unknown = np.isnan(z_mean)
    if unknown.all():
        return np.zeros_like(z_mean)
    j, i = distance_transform_edt(unknown, return_distances=False, return_indices=True)
    return np.asarray(z_mean[j, i], dtype=np.float32)


def scene(z_mean: F32, prediction: F32 | None = None, optimistic: bool = True) -> Scene:
    """Scene from heights (rows, columns) of any float type, converted to single precision; NaN = unknown.

    prediction: (rows, columns), replaces unknown heights; default `predicted`.
    optimistic: unknown cells never hide the ground behind them; if False, they always do.
    """
    unknown = np.isnan(z_mean)
    if not unknown.any():
        return Scene(np.ascontiguousarray(z_mean, dtype=np.float32), unknown, None)
    height = np.where(unknown, predicted(z_mean) if prediction is None else prediction, z_mean).astype(np.float32)
    veil = np.where(unknown, np.float32(-np.inf if optimistic else np.inf), np.float32(0.0))
    return Scene(height, unknown, veil)


def total(
    ground: Scene, table: Beams, eye_m: float, asked: VisibilityRequest | None = None, progress: Progress | None = None
) -> Visibility:
    """Visibility of observers on every node, with eyes `eye_m` above the ground there.

    progress: counts nodes and can stop the run.

    Raises ValueError for wrong shapes, dtypes or heights that are not finite, CancelledError when stopped.
    """
    question = VisibilityRequest() if asked is None else asked
    shape, count = ground.height_m.shape, len(table.dj)
    first, width = _sector(question.sector, count, shape)
    new_width = 1 if question.new_half_rad is None else _width(question.new_half_rad, count)
    targets = ground.unknown if question.targets is None else question.targets
    request = native.Request(
        eye_m, question.where, first, width, None if question.new_half_rad is None else targets, new_width
    )
    sums = native.total(table, ground.height_m, ground.veil, request, progress)

    def answer(values: NDArray[np.number]) -> F64:
        return np.where(True if question.where is None else question.where, values, np.nan).astype(np.float64)

    index = answer(sums.seen / np.maximum(sums.in_range, 1))
    seen, in_range = answer(sums.seen / table.whole), answer(sums.in_range / table.whole)
    if sums.fresh is None or sums.heading is None:
        nothing = np.full(shape, np.nan)
        return Visibility(index, seen, in_range, nothing, nothing, nothing)
    heading = sums.heading * (math.tau / count)
    gain = answer(sums.fresh / _shares_of_sectors(table, new_width)[sums.heading])
    turned = answer(np.where(heading > math.pi, heading - math.tau, heading))
    return Visibility(index, seen, in_range, answer(sums.fresh / table.whole), turned, gain)


def from_node(ground: Scene, table: Beams, eye_m: float, node: tuple[int, int], sector: Sector | None = None) -> View:
    """View of one observer on `node` (j, i). Raises ValueError for a node off the map, else as `total`."""
    first, width = _sector(sector, len(table.dj), (1, 1))
    beam = 0 if first is None else int(first[0, 0])
    seen, sees, in_range = native.view(table, (ground.height_m, ground.veil), node, eye_m, (beam, width))
    return View(seen, sees / max(in_range, 1), sees / table.whole, in_range / table.whole)


def _width(half_rad: float, count: int) -> int:
    """Number of beams within half_rad of a beam."""
    if not half_rad >= 0.0:
        raise ValueError(f"half width of a sector: expected >= 0 rad, given {half_rad}")
    return min(2 * int(min(half_rad, math.pi) / (math.tau / count) + 1e-9) + 1, count)


def _sector(sector: Sector | None, count: int, shape: tuple[int, ...]) -> tuple[I32 | None, int]:
    """First beam for each node and number of beams; headings are those of the nearest beam."""
    if sector is None:
        return None, count
    heading = np.asarray(sector.heading_rad, dtype=np.float64)
    if heading.shape not in ((), shape):
        raise ValueError(f"heading_rad: expected one or {shape}, given {heading.shape}")
    if not np.isfinite(heading).all():
        raise ValueError("heading_rad: expected finite angles, given nan or inf")
    width = _width(sector.half_rad, count)
    middle = np.rint(heading / (math.tau / count)).astype(np.int64)
    first = np.mod(middle - width // 2, count).astype(np.int32)
    return np.ascontiguousarray(np.broadcast_to(first, shape)), width


def _shares_of_sectors(table: Beams, width: int) -> F64:
    """Shares of all samples in the sector of `width` beams around each beam."""
    of_beam = table.share.sum(axis=1, dtype=np.int64)
    half = width // 2
    wrapped = np.concatenate([of_beam[len(of_beam) - half :], of_beam, of_beam[: width - half - 1]])
    sums = np.concatenate([[0], np.cumsum(wrapped)])
    return np.asarray(sums[width:] - sums[:-width], dtype=np.float64)
