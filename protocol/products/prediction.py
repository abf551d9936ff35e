"""Prediction of an image from its decoded neighbours: the integer of each cell becomes a small residual.

    NW  N  NE        known so far, when the cells come in the order of i + 2 j (row j, column i)
     W  [ ]

An unknown cell has residual 0 and uses its west neighbour's integer for the predictions of others, in the first column
its north neighbour's. The first row and column are predicted by the one neighbour that they have.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

I64 = NDArray[np.int64]
Bool = NDArray[np.bool_]
Predictor = Callable[[I64, I64, I64, I64], I64]  # of west, north, north-west, north-east


def median_edge(west: I64, north: I64, north_west: I64, _north_east: I64) -> I64:
    """MED prediction (LOCO-I, 2000): the median of west, north and west + north - north-west."""
    low, high = np.minimum(west, north), np.maximum(west, north)
    middle: I64 = np.maximum(low, np.minimum(west + north - north_west, high))
    return middle


def mean_of_three(west: I64, north: I64, _north_west: I64, north_east: I64) -> I64:
    """Half of west, a quarter each of north and north-east: for images whose noise is larger than their steps."""
    return (2 * west + north + north_east) // 4


def residuals(quanta: I64, known: Bool, predict: Predictor) -> I64:
    """Integers (rows, columns) minus their prediction; 0 where not known."""
    filled = quanta.copy()
    filled[:, 0] = _carried(filled[:, 0], known[:, 0])
    anchored = known.copy()
    anchored[:, 0] = True
    source = np.maximum.accumulate(np.where(anchored, np.arange(quanta.shape[1]), 0), axis=1)
    filled = np.take_along_axis(filled, source, axis=1)
    predicted = np.zeros_like(filled)
    predicted[0, 1:], predicted[1:, 0] = filled[0, :-1], filled[:-1, 0]
    north_east = np.concatenate([filled[:-1, 2:], filled[:-1, -1:]], axis=1)[:, : filled.shape[1] - 1]
    predicted[1:, 1:] = predict(filled[1:, :-1], filled[:-1, 1:], filled[:-1, :-1], north_east)
    return np.where(known, filled - predicted, 0)


def _carried(column: I64, known: Bool) -> I64:
    """Fill unknown cells of the first column with the cell to their north (0 in the top row)."""
    source = np.maximum.accumulate(np.where(known, np.arange(len(column)), -1))
    return np.where(source >= 0, column[np.maximum(source, 0)], 0)


def integers(left: I64, known: Bool, predict: Predictor) -> I64:
    """The inverse of `residuals`. All cells with equal i + 2 j are decoded at once: they need only earlier ones."""
    rows, columns = left.shape
    padded = np.zeros((rows + 1, columns + 1), np.int64)
    flat, stride = padded.reshape(-1), columns + 1
    for diagonal in range(columns + 2 * rows - 2):
        j = np.arange(max(0, (diagonal - columns + 2) // 2), min(rows, diagonal // 2 + 1))
        i = diagonal - 2 * j
        at = (j + 1) * stride + i + 1
        west, north, north_west = flat[at - 1], flat[at - stride], flat[at - stride - 1]
        north_east = flat[at - stride + (i < columns - 1)]
        edge = np.where(i == 0, north, west)
        predicted = np.where((i == 0) | (j == 0), edge, predict(west, north, north_west, north_east))
        flat[at] = np.where(known[j, i], predicted + left[j, i], edge)
    return padded[1:, 1:]
