"""Interface of the visibility kernels: sums over the cells that observers on the nodes of a map see.

Sums count shares of cells in 1 / `Beams.whole`: integers, so every build gives the same bits in any order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from onboard.kernel_calls.checks import check_array
from onboard.kernel_calls.progress import CancelledError, Progress
from onboard.native.variant import kernels
from onboard.records import F32, I32, Bool

LARGEST_MAP = 2**30  # cells: offsets are int32, margin included
LARGEST_HEIGHT_M = 1e6


@dataclass(frozen=True, slots=True)
class Beams:
    """Cells that beams sample, the same for every observer; arrays (beams, steps), contiguous.

    Beam t has azimuth t * 2 pi / beams.

    dj, di: int32, offset of the cell from the observer, |dj| and |di| never falling along a beam.
    inverse_pm: float32, 1 / distance of the cell.
    share: int32, weight of the sample in its cell; the shares of each cell sum to `whole`.
    cells: number of cells.
    """

    dj: I32
    di: I32
    inverse_pm: F32
    share: I32
    whole: int
    cells: int

    def __post_init__(self) -> None:
        shape = self.dj.shape
        if len(shape) != 2 or min(shape) < 1:
            raise ValueError(f"dj: expected (beams, steps) of at least 1 each, given {shape}")
        for name in ("dj", "di", "inverse_pm", "share"):
            dtype = np.float32 if name == "inverse_pm" else np.int32
            check_array(name, getattr(self, name), shape, dtype)
        for name, along in (("dj", self.dj), ("di", self.di)):
            away = along * np.where(along[:, -1:] < 0, -1, 1)
            if (np.diff(away, axis=1, prepend=0) < 0).any():
                raise ValueError(f"{name}: expected cells that never come nearer along a beam")
        if not (self.share.min() >= 0 and self.share.sum(dtype=np.int64) == self.whole * self.cells < 2**31):
            raise ValueError(f"share: expected >= 0, {self.whole} for each of {self.cells} cells, below 2^31 in all")


@dataclass(frozen=True, slots=True)
class Request:
    """Request for a visibility sum.

    eye_m: height of the observer above its node.
    where: bool, nodes to compute; None = all.
    first: int32, first beam of each node's sector; None = all beams.
    width: number of beams of that sector.
    target: bool, cells that count as fresh where visible; None = not requested.
    heading_width: number of beams of the sector whose best heading is computed.
    """

    eye_m: float
    where: Bool | None = None
    first: I32 | None = None
    width: int = 0
    target: Bool | None = None
    heading_width: int = 1


@dataclass(frozen=True, slots=True)
class Sums:
    """Shares of cells for each node, int32 (rows, columns), 0 for nodes that were not requested.

    seen: visible cells.
    in_range: cells in range.
    fresh: visible target cells in the best sector of `heading_width` beams; None if not requested.
    heading: number of that sector's beam, the smallest of equal ones; None if not requested.
    """

    seen: I32
    in_range: I32
    fresh: I32 | None
    heading: I32 | None


def total(table: Beams, height_m: F32, veil: F32 | None, asked: Request, progress: Progress | None = None) -> Sums:
    """Compute the sums of all requested nodes. Vectorised over neighbouring nodes; the same bits as `scalar`.

    height_m: float32 (rows, columns), finite.
    veil: float32 like it, added to a cell's slope before the cell hides others: 0, -inf (never hides) or +inf (hides
        all behind it); None = 0.
    progress: counts nodes.

    Raises ValueError for wrong shapes, dtypes, layout or values; CancelledError if `progress` was cancelled.
    """
    return _run(kernels.visibility_total_into, table, (height_m, veil), asked, progress)


def scalar(table: Beams, height_m: F32, veil: F32 | None, asked: Request, progress: Progress | None = None) -> Sums:
    """Compute `total` by a plain loop, node after node: the reference implementation."""
    return _run(kernels.visibility_scalar_into, table, (height_m, veil), asked, progress)


def view(
    table: Beams, ground: tuple[F32, F32 | None], node: tuple[int, int], eye_m: float, sector: tuple[int, int]
) -> tuple[Bool, int, int]:
    """Cells that one observer sees, bool (rows, columns), and its sums: seen, in range.

    ground: height_m and veil of `total`.
    node: (j, i).
    sector: its first beam and its number of beams.
    """
    height_m, veil = ground
    _check_ground(height_m, veil, eye_m)
    j, i = node
    if not (0 <= j < height_m.shape[0] and 0 <= i < height_m.shape[1]):
        raise ValueError(f"node: expected one on the map {height_m.shape}, given {node}")
    _check_sector(table, *sector)
    seen = np.zeros(height_m.shape, np.uint8)
    at = j * height_m.shape[1] + i
    sums = kernels.view_from_into(
        table.dj, table.di, table.inverse_pm, table.share, height_m, veil, at, eye_m, *sector, seen
    )
    return seen.view(np.bool_), *sums


def arithmetic(table: Beams, height_m: F32, eye_m: float, times: int) -> int:
    """Benchmark of the arithmetic of `total` alone: the first beam from the map's first corner, repeated.

    Returns the number of samples. On a map and a table of a few kilobytes this is the fastest that this machine can
    compute: the limit of the bench.
    """
    _check_ground(height_m, None, eye_m)
    samples, _ = kernels.repeat_first_beam(table.dj, table.di, table.inverse_pm, table.share, height_m, eye_m, times)
    return samples


def _run(
    kernel: Callable[..., bool],
    table: Beams,
    ground: tuple[F32, F32 | None],
    asked: Request,
    progress: Progress | None,
) -> Sums:
    height_m, veil = ground
    _check_ground(height_m, veil, asked.eye_m)
    _check_request(table, height_m.shape, asked)
    fresh = asked.target is not None
    layers = [np.zeros(height_m.shape, np.int32) if wanted else None for wanted in (True, True, fresh, fresh)]
    watch = Progress() if progress is None else progress
    finished = kernel(
        table.dj,
        table.di,
        table.inverse_pm,
        table.share,
        height_m,
        veil,
        None if asked.target is None else -asked.target.astype(np.int32),
        asked.eye_m,
        None if asked.where is None else asked.where.view(np.uint8),
        asked.first,
        asked.width,
        asked.heading_width,
        *layers,
        watch.done,
        watch.stop,
    )
    if not finished:
        raise CancelledError(f"visibility: stopped after {int(watch.done[0])} of {height_m.size} nodes")
    return Sums(layers[0], layers[1], layers[2], layers[3])  # type: ignore[arg-type]


def _check_ground(height_m: F32, veil: F32 | None, eye_m: float) -> None:
    check_array("height_m", height_m, (None, None), np.float32)
    if not 0 < height_m.size <= LARGEST_MAP:
        raise ValueError(f"height_m: expected 1 to {LARGEST_MAP} cells, given shape {height_m.shape}")
    largest = max(-float(height_m.min()), float(height_m.max()))  # nan stays nan
    if not largest <= LARGEST_HEIGHT_M:
        raise ValueError(f"height_m: expected finite heights within {LARGEST_HEIGHT_M:g} m, given {largest:g}")
    if not abs(eye_m) <= LARGEST_HEIGHT_M:
        raise ValueError(f"eye_m: expected a finite height within {LARGEST_HEIGHT_M:g} m, given {eye_m}")
    if veil is not None:
        check_array("veil", veil, height_m.shape, np.float32)
        if not ((veil == 0) | np.isinf(veil)).all():
            raise ValueError("veil: expected 0, -inf or +inf, given other values")


def _check_request(table: Beams, shape: tuple[int, ...], asked: Request) -> None:
    for name, layer in (("where", asked.where), ("target", asked.target)):
        if layer is not None:
            check_array(name, layer, shape, np.bool_)
    if asked.first is not None:
        check_array("first", asked.first, shape, np.int32)
        for first in (int(asked.first.min()), int(asked.first.max())):
            _check_sector(table, first, asked.width)
    if not 1 <= asked.heading_width <= len(table.dj):
        raise ValueError(f"heading_width: expected 1 to {len(table.dj)} beams, given {asked.heading_width}")


def _check_sector(table: Beams, first: int, width: int) -> None:
    count = len(table.dj)
    if not (0 <= first < count and 1 <= width <= count):
        raise ValueError(
            f"sector: expected a first beam of 0 to {count - 1} and 1 to {count} beams, given {first}, {width}"
        )
