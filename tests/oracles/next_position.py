"""The slow plain twin of the next sensing position: node by node, beam by beam, Eq. 6 and Eq. 28 as corrected.

It takes the table of beams (which has tests of its own) and nothing else of the code under test.
"""

from __future__ import annotations

import math

import numpy as np


def views(z, fill, table, node, eye_m):
    """Per beam: shares of cells seen, in range on the map, and of unknown cells seen; unknown cells never hide."""
    rows, columns = z.shape
    eye = np.float32(fill[node] + np.float32(eye_m))
    sums = np.zeros((len(table.dj), 3), np.int64)
    for t in range(len(table.dj)):
        steepest = -math.inf
        for k in range(table.dj.shape[1]):
            j, i = node[0] + int(table.dj[t, k]), node[1] + int(table.di[t, k])
            if not (0 <= j < rows and 0 <= i < columns):
                break
            slope = (fill[j, i] - eye) * table.inverse_pm[t, k]
            share, unknown = int(table.share[t, k]), bool(np.isnan(z[j, i]))
            sums[t, 1] += share
            if slope >= np.float32(steepest) - np.float32(1e-6):
                sums[t, 0] += share
                sums[t, 2] += share * unknown
            if not unknown:
                steepest = max(steepest, float(slope))
    return sums


def window(values, middle, half):
    """Sum over beams within `half` beams of the middle one."""
    return sum(int(values[(middle + n) % len(values)]) for n in range(-half, half + 1))


def facing_goal(z, fill, table, node, eye_m, beam, half):
    """Vis in the sector round one beam."""
    sums = views(z, fill, table, node, eye_m)
    return window(sums[:, 0], beam, half) / max(window(sums[:, 1], beam, half), 1)


def newly_seen(z, fill, table, node, eye_m, half):
    """(gain, beam) of the sector with most unknown cells seen; everything beyond the map is unknown, at its rim's
    height.
    """
    reach = table.dj.shape[1]
    wide, wide_fill = np.pad(z, reach, constant_values=np.nan), np.pad(fill, reach, mode="edge")
    sums = views(wide, wide_fill, table, (node[0] + reach, node[1] + reach), eye_m)
    held = [window(sums[:, 2], t, half) for t in range(len(sums))]
    best = held.index(max(held))
    return held[best] / window(table.share.sum(axis=1), best, half), best


def scores(gain, cost, candidates, weights):
    """E of each candidate by cell, a dictionary."""
    costs = [float(cost[c]) for c in candidates]
    low, span = min(costs), max(costs) - min(costs)
    return {
        c: weights[0] * gain[c] - weights[1] * ((float(cost[c]) - low) / span if span >= 1e-6 else 0.0)
        for c in candidates
    }
