"""What a scanner would see from a place (Algorithm 1, Eq. 6, corrected).

    z_s  +----____             beam t steps cell by cell away from the observer; slope S = (Z(cell) - z_s) / distance.
         |        ----___      A cell is visible if S >= S_max - 1e-6, S_max being the steepest slope before it
         |     /\\        --   (it starts at -inf), so flat ground is seen whole: Vis = 1.000.
    -----+----/  \\----------

The offsets (dx, dy) of step k of beam t are the same for every observer: one table, `Beams`. Near the observer many
beams sample one cell, so each sample weighs 1 / (samples with that offset) and sums count distinct cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from onboard.records import F32, F64, Bool

TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class Beams:
    """The table of samples, all (beams, steps). dj, di: cells from the observer; distance_m: of the sample's cell.

    weight: 1 / multiplicity of the offset, 0 for the observer's own cell. Beam t has azimuth t * 2 pi / beams.
    """

    dj: NDArray[np.int64]
    di: NDArray[np.int64]
    distance_m: F64
    weight: F64


@dataclass(frozen=True, slots=True)
class Scene:
    """Ground to look over, padded by the beams' reach on every side. Flat arrays of padded rows.

    heights_m: float32 (predicted where unknown). unknown, on_map: bool.
    """

    heights_m: F32
    unknown: Bool
    on_map: Bool
    stride: int
    pad: int


@dataclass(frozen=True, slots=True)
class Seen:
    """What n observers would see. index: (n,) Vis, cells seen / cells of the map in range (Eq. 6).

    seen, in_range: (n,) numbers of distinct cells. new: (n, beams) unknown cells newly seen along each beam.
    """

    index: F64
    seen: F64
    in_range: F64
    new: F64


def beams(range_m: float, cell_m: float, count: int = 360) -> Beams:
    """The table for a range and a number of beams round the circle; steps are one cell long."""
    steps = int(range_m / cell_m + 1e-9)
    k = np.arange(1, steps + 1)
    angle = np.arange(count) * (math.tau / count)
    di = np.rint(k * np.cos(angle)[:, None]).astype(np.int64)
    dj = np.rint(k * np.sin(angle)[:, None]).astype(np.int64)
    flat = (dj + steps) * (2 * steps + 1) + di + steps
    multiplicity = np.bincount(flat.ravel(), minlength=(2 * steps + 1) ** 2)[flat]
    own = (di == 0) & (dj == 0)
    distance = np.where(own, 1.0, np.hypot(di, dj) * cell_m)
    return Beams(dj, di, distance, np.where(own, 0.0, 1.0 / multiplicity))


def predicted(z_mean: F32) -> F32:
    """Heights with each unknown (NaN) cell at the height of the nearest known one; all 0 where nothing is known."""
    unknown = np.isnan(z_mean)
    if unknown.all():
        return np.zeros_like(z_mean)
    j, i = distance_transform_edt(unknown, return_distances=False, return_indices=True)
    return np.asarray(z_mean[j, i], dtype=np.float32)


def scene(z_mean: F32, table: Beams, prediction: F32 | None = None) -> Scene:
    """A scene from heights (rows, columns), NaN = unknown; `prediction` defaults to `predicted`."""
    heights = predicted(z_mean) if prediction is None else np.where(np.isnan(z_mean), prediction, z_mean)
    pad = int(max(np.abs(table.dj).max(), np.abs(table.di).max()))
    unknown = np.pad(np.isnan(z_mean), pad, constant_values=True)
    on_map = np.pad(np.ones(z_mean.shape, dtype=bool), pad)
    padded = np.pad(heights.astype(np.float32), pad, mode="edge")
    return Scene(padded.ravel(), unknown.ravel(), on_map.ravel(), padded.shape[1], pad)


def look(ground: Scene, table: Beams, cells: NDArray[np.integer], height_m: float, optimistic: bool = True) -> Seen:
    """What observers on `cells` (n, 2) of (j, i), eyes `height_m` above the ground there, would see.

    Unknown cells never hide what lies behind them when `optimistic`, always when not.
    """
    base = (cells[:, 0] + ground.pad) * ground.stride + cells[:, 1] + ground.pad
    eye = ground.heights_m[base].astype(np.float64) + height_m
    seen, in_range = np.zeros(len(cells)), np.zeros(len(cells))
    new = np.zeros((len(cells), len(table.dj)))
    behind_unknown = -np.inf if optimistic else np.inf
    offsets = table.dj * ground.stride + table.di
    for t in range(len(offsets)):
        at = base[:, None] + offsets[t]
        unknown, on_map = ground.unknown[at], ground.on_map[at]
        slope = (ground.heights_m[at] - eye[:, None]) / table.distance_m[t]
        blocks = np.where(table.weight[t] > 0.0, np.where(unknown, behind_unknown, slope), -np.inf)
        before = np.full_like(slope, -np.inf)
        np.maximum.accumulate(blocks[:, :-1], axis=1, out=before[:, 1:])
        visible = (slope >= before - TOLERANCE) & on_map
        seen += visible @ table.weight[t]
        in_range += on_map @ table.weight[t]
        new[:, t] = (visible & unknown) @ table.weight[t]
    return Seen(seen / np.maximum(in_range, 1e-12), seen, in_range, new)


def best_heading(new: F64, sector_rad: float) -> tuple[F64, F64]:
    """For each observer the heading whose sector (half width `sector_rad`) holds most newly seen cells.

    new: (n, beams). Returns headings (n,) in (-pi, pi] and the sectors' cells (n,); ties take the smallest azimuth.
    """
    count = new.shape[1]
    half = min(int(sector_rad / (math.tau / count)), (count - 1) // 2)
    wrapped = np.concatenate([new[:, count - half :], new, new[:, :half]], axis=1)
    sums = np.concatenate([np.zeros((len(new), 1)), np.cumsum(wrapped, axis=1)], axis=1)
    width = 2 * half + 1
    held = sums[:, width : width + count] - sums[:, :count]
    best = np.argmax(np.round(held, 9), axis=1)
    heading = best * (math.tau / count)
    return np.where(heading > math.pi, heading - math.tau, heading), held[np.arange(len(new)), best]
