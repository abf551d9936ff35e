"""Twins of the visibility kernels: a plain loop written from the rules, and numpy over one node's beams."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction

import numpy as np

from onboard.planning.sensing.visibility import Beams, Scene

TOLERANCE = np.float32(1e-6)


def algorithm_1(
    z: np.ndarray, prediction: np.ndarray, node: tuple[int, int], beams: tuple[int, int, float], optimistic: bool
) -> tuple[Fraction, int, set]:
    """Cells seen (a cell of which half the beams see it counts half), cells in range, cells of which a beam sees some.

    Beam by beam, step by step, in double precision and over sets of cells. beams: their number, steps, cell in metres.
    """
    (j0, i0), (count, steps, cell_m) = node, beams
    eye = float(prediction[j0, i0] if np.isnan(z[j0, i0]) else z[j0, i0]) + 0.7
    samples, visible = Counter(), Counter()
    for t in range(count):
        steepest = -math.inf
        for k in range(1, steps + 1):
            angle = t * math.tau / count
            dj, di = offset(k, angle)
            j, i = j0 + dj, i0 + di
            if not (0 <= j < z.shape[0] and 0 <= i < z.shape[1]):
                break
            unknown = bool(np.isnan(z[j, i]))
            slope = (float(prediction[j, i] if unknown else z[j, i]) - eye) / (math.hypot(dj, di) * cell_m)
            samples[j, i] += 1
            visible[j, i] += slope >= steepest - 1e-6
            if not unknown:
                steepest = max(steepest, slope)
            elif not optimistic:
                steepest = math.inf
    sees = sum((Fraction(visible[c], whole_circle(count, steps)[c[0] - j0, c[1] - i0]) for c in samples), Fraction(0))
    return sees, len(samples), {c for c in samples if visible[c]}


def offset(k: int, angle_rad: float) -> tuple[int, int]:
    """The cell nearest to k cells along an angle; halves go to the even one."""
    return round(round(k * math.sin(angle_rad), 9)), round(round(k * math.cos(angle_rad), 9))


_circles: dict[tuple[int, int], Counter] = {}


def whole_circle(count: int, steps: int) -> Counter:
    """How many samples of the whole table each offset (dj, di) has."""
    if (count, steps) not in _circles:
        angles = [t * math.tau / count for t in range(count)]
        _circles[count, steps] = Counter(offset(k, a) for a in angles for k in range(1, steps + 1))
    return _circles[count, steps]


class Look:
    """One node at a time by numpy: all beams at once, on a padded map. Single precision, like the kernels."""

    def __init__(self, ground: Scene, table: Beams, eye_m: float) -> None:
        pad = table.dj.shape[1]
        self.table, self.eye_m, self.pad = table, np.float32(eye_m), pad
        self.height_m = np.pad(ground.height_m, pad, constant_values=-np.inf)
        self.veil = None if ground.veil is None else np.pad(ground.veil, pad)
        self.unknown = np.pad(ground.unknown, pad)
        self.offset = table.dj * self.height_m.shape[1] + table.di

    def sums(self, node: tuple[int, int]) -> tuple[int, int, np.ndarray]:
        """Shares of cells seen and in range, and those of unknown cells seen by each beam."""
        at = (node[0] + self.pad) * self.height_m.shape[1] + node[1] + self.pad + self.offset
        z = self.height_m.ravel()[at]
        slope = (z - (self.height_m[node[0] + self.pad, node[1] + self.pad] + self.eye_m)) * self.table.inverse_pm
        hides = slope if self.veil is None else slope + self.veil.ravel()[at]
        before = np.full_like(slope, np.finfo(np.float32).min)
        np.maximum.accumulate(hides[:, :-1], axis=1, out=before[:, 1:])
        before[:, 1:] = np.maximum(before[:, 1:], before[:, :1])
        visible = slope >= before - TOLERANCE
        share = np.where(visible, self.table.share, 0)
        in_range = int(self.table.share[np.isfinite(z)].sum(dtype=np.int64))
        if self.veil is None:
            return int(share.sum(dtype=np.int64)), in_range, np.zeros(len(share), np.int64)
        fresh = np.where(self.unknown.ravel()[at], share, 0).sum(axis=1, dtype=np.int64)
        return int(share.sum(dtype=np.int64)), in_range, fresh

    def index(self, node: tuple[int, int]) -> float:
        """Vis of one node."""
        seen, in_range, _ = self.sums(node)
        return seen / max(in_range, 1)


def best_heading(fresh: np.ndarray, count: int, half_deg: float) -> tuple[int, int]:
    """The first beam round which the beams within half_deg hold most, and how much: every one tried."""
    step_deg = 360 / count

    def held(middle: int) -> int:
        return sum(int(fresh[t]) for t in range(count) if _apart_deg(t, middle, step_deg) <= half_deg + 1e-9)

    best = max(range(count), key=lambda middle: (held(middle), -middle))
    return best, held(best)


def _apart_deg(a: int, b: int, step_deg: float) -> float:
    off = abs(a - b) * step_deg
    return min(off, 360 - off)
