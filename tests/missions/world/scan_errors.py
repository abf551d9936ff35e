"""Errors of a real scanner on a sweep: lost beams, single or in clumps, outliers, and mixed pixels at edges.

The errors act on the ranges and codes of an ideal scanner's sweep, as arrays (lines, beams). Their order is that of the
light: a beam that is split between two surfaces, a wrong range, a beam that returns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.records import F32, U8, BeamStatus, Bool, Scan

EDGE_M = 0.2  # neighbour beams that differ by more have an edge between them
NEAREST_M = 0.1  # an outlier is never nearer
CLUMP = (3, 30)  # adjacent beams that are lost together


@dataclass(frozen=True)
class ScanErrors:
    """Error shares of the beams.

    lost_ratio: of all beams.
    clump: least and most adjacent beams lost together.
    outlier_ratio: of the returns, off by up to outlier_m.
    mixed_ratio: of the beams at an edge; their range is drawn between the two surfaces.
    """

    lost_ratio: float = 0.0
    clump: tuple[int, int] = (1, 1)
    outlier_ratio: float = 0.0
    outlier_m: float = 0.5
    mixed_ratio: float = 0.0

    def apply(self, scans: Sequence[Scan], rng: np.random.Generator) -> tuple[Scan, ...]:
        """Return the same scans with these errors."""
        ranges_m = np.stack([scan.ranges_m for scan in scans])
        status = np.stack([scan.status for scan in scans])
        if self.mixed_ratio:
            ranges_m = mixed(ranges_m, status, self.mixed_ratio, rng)
        if self.outlier_ratio:
            ranges_m = outliers(ranges_m, status, self.outlier_ratio, self.outlier_m, rng)
        if self.lost_ratio:
            gone = lost(ranges_m.shape, self.lost_ratio, self.clump, rng)
            status = np.where(gone, np.uint8(BeamStatus.NO_RETURN), status)
            ranges_m = np.where(gone, np.float32(np.nan), ranges_m)
        return tuple(replace(scan, ranges_m=r, status=s) for scan, r, s in zip(scans, ranges_m, status))


# The scanner that missions fly by default, without what needs the ground (grazing incidence, dark rock).
DEFAULT = ScanErrors(lost_ratio=0.01, clump=CLUMP, outlier_ratio=0.0002, mixed_ratio=0.1)


def lost(shape: tuple[int, int], ratio: float, clump: tuple[int, int], rng: np.random.Generator) -> Bool:
    """Return the mask (lines, beams) of lost beams: clumps at random places of random lines until `ratio` is reached.

    clump: least and most beams of one; (1, 1): single beams. A clump that begins near a line's end is cut there.
    """
    lines, beams = shape
    gone = np.zeros(shape, np.bool_)
    wanted = ratio * lines * beams
    low, high = clump
    while (missing := wanted - gone.sum()) > 0:
        count = max(1, int(missing / high))  # rather one round more than too many
        rows, first = rng.integers(0, lines, count), rng.integers(0, beams, count)
        length = rng.integers(low, high + 1, count)
        cells = np.arange(high)
        there = (cells < length[:, None]) & (first[:, None] + cells < beams)
        gone[np.broadcast_to(rows[:, None], there.shape)[there], (first[:, None] + cells)[there]] = True
    return gone


def outliers(ranges_m: F32, status: U8, ratio: float, off_m: float, rng: np.random.Generator) -> F32:
    """Return ranges of which `ratio` is off by up to `off_m`, uniformly, nearer or farther."""
    off = (rng.random(ranges_m.shape) < ratio) & (status == BeamStatus.OK)
    wrong = np.maximum(ranges_m + rng.uniform(-off_m, off_m, ranges_m.shape), NEAREST_M)
    return np.where(off, wrong, ranges_m).astype(np.float32)


def mixed(ranges_m: F32, status: U8, ratio: float, rng: np.random.Generator) -> F32:
    """Return ranges of which, at edges, `ratio` lies anywhere between the beam's own surface and its neighbour's.

    An edge is between neighbour beams of one line whose ranges differ by more than EDGE_M; the farther beam is split.
    """
    true_m = np.where(status == BeamStatus.OK, ranges_m, np.nan)
    nearer = np.full_like(true_m, np.nan)
    with np.errstate(invalid="ignore"):
        for into, of in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[:, :-1], np.s_[:, 1:])):
            edge = true_m[of] < true_m[into] - EDGE_M
            nearer[into] = np.where(edge, np.fmin(nearer[into], true_m[of]), nearer[into])
    split = ~np.isnan(nearer) & (rng.random(ranges_m.shape) < ratio)
    share = rng.random(ranges_m.shape)
    return np.where(split, nearer + share * (true_m - nearer), ranges_m).astype(np.float32)
