"""Cells of ground that beams should have seen and did not (`dark_regions`): add, keep and remove.

A cell stays until a later scan, from nearer than `near_m`, puts REPLACING_HITS hits into it and does not find it dark
again. At most MOST cells are kept, the nearest to the rover. None is stored on disk: after a restart new scans find
them again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onboard.native import each
from onboard.perception.map.ldem import REPLACING_HITS
from onboard.records import F32, F64, CellClass, Cloud, Surface

MOST = 4000
Places = tuple[tuple[float, float], ...]
I64 = NDArray[np.int64]


def updated(unseen_m: Places, dark_m: F32 | F64, seen: Cloud, cell_m: float, near_m: float) -> Places:
    """The cells' centres after one more scan, sorted.

    dark_m: (k, 3) points that the scan found dark, map frame as `seen`.
    """
    before, dark = _cells(np.array(unseen_m).reshape(-1, 2), cell_m), _cells(dark_m, cell_m)
    known = np.concatenate([before[~_seen_anew(before, seen, cell_m, near_m)], dark])
    if not len(known):
        return ()
    centres = (np.unique(known, axis=0) + 0.5) * cell_m
    if len(centres) > MOST:
        away = each.hypot(*(centres - seen.origin_m[:2]).T)
        centres = centres[np.sort(np.argsort(away, kind="stable")[:MOST])]
    return tuple((x, y) for x, y in centres.tolist())


def without_unseen(surface: Surface, unseen_m: Places) -> Surface:
    """The surface with these cells occluded: no known height, no beam passed. The same object if there are none."""
    cells = [surface.grid.cell(*place) for place in unseen_m]
    inside = np.array([cell for cell in cells if surface.grid.contains(*cell)], np.int64).reshape(-1, 2)
    if not len(inside):
        return surface
    at = (inside[:, 0], inside[:, 1])
    layers = [layer.copy() for layer in (surface.z_mean, surface.z_top, surface.z_bot, surface.z_ray)]
    for layer, value in zip(layers, (np.nan, np.nan, np.nan, np.inf)):
        layer[at] = value
    cell_class = surface.cell_class.copy()
    cell_class[at] = CellClass.OCCLUDED
    return Surface(surface.grid, cell_class, *layers)


def _cells(points_m: F32 | F64, cell_m: float) -> I64:
    """(k, 2) numbers of the cells along x and y, counted from the origin of the map frame."""
    return np.floor(points_m[:, :2].astype(np.float64) / cell_m).astype(np.int64)


def _seen_anew(cells: I64, seen: Cloud, cell_m: float, near_m: float) -> NDArray[np.bool_]:
    """Flags of the cells with enough hits of this scan from near."""
    if not len(cells):
        return np.zeros(0, np.bool_)
    hits = seen.ends_m[seen.hit][:, :2]
    hits = hits[each.hypot(*(hits - seen.origin_m[:2].astype(np.float32)).T) < near_m]
    keys, order = _keys(cells), np.argsort(_keys(cells), kind="stable")
    found = _keys(_cells(hits, cell_m))
    at = np.minimum(np.searchsorted(keys[order], found), len(cells) - 1)
    counts = np.zeros(len(cells), np.int64)
    counts[order] = np.bincount(at[keys[order][at] == found], minlength=len(cells))
    enough: NDArray[np.bool_] = counts >= REPLACING_HITS
    return enough


def _keys(cells: I64) -> I64:
    """A unique number for each cell."""
    return (cells[:, 0] << 32) + cells[:, 1]
