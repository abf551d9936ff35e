"""Rows of visibility: all nodes against the scalar loop, against numpy, and against the arithmetic alone."""

from __future__ import annotations

from functools import cache

import numpy as np

from onboard.kernel_calls import visibility as kernel
from onboard.planning.sensing import visibility
from tests.bench.goals import Measured, seconds
from tests.oracles.visibility import Look

SIDE, CELL_M, EYE_M, RANGE_M, BEAMS = 200, 0.1, 0.7, 10.0, 720
ASKED = kernel.Request(EYE_M)
NODES = 100  # of the 40,000, for numpy


@cache
def workload() -> tuple[visibility.Scene, visibility.Beams]:
    """Return fBm of H 0.8 (5 cm rms) with 60 hemispherical rocks, all known, and the beams: 720 of 100 steps."""
    rng = np.random.default_rng(4)
    u, v = np.fft.rfftfreq(SIDE), np.fft.fftfreq(SIDE)[:, None]
    away = np.hypot(u, v)
    away[0, 0] = np.inf
    z = np.fft.irfft2(np.fft.rfft2(rng.normal(size=(SIDE, SIDE))) * away**-1.8, (SIDE, SIDE))
    z *= 0.05 / z.std()
    y, x = np.mgrid[0:SIDE, 0:SIDE] * CELL_M
    for _ in range(60):
        cx, cy, radius = *rng.uniform(0, SIDE * CELL_M, 2), rng.uniform(0.1, 0.5)
        z += np.sqrt(np.maximum(radius**2 - (x - cx) ** 2 - (y - cy) ** 2, 0.0))
    return visibility.scene(z.astype(np.float32)), visibility.beams(RANGE_M, CELL_M, BEAMS)


def samples(table: visibility.Beams) -> int:
    """Return the number of samples on the map over all nodes."""
    on_map = np.maximum(SIDE - np.abs(table.dj), 0).astype(np.int64) * np.maximum(SIDE - np.abs(table.di), 0)
    return int(on_map.sum())


def total(repeats: int) -> Measured:
    """Measure all nodes with vectors of neighbours against one node after the other."""
    ground, table = workload()
    results = []
    ours_s = seconds(lambda: results.append(kernel.total(table, ground.height_m, None, ASKED)), repeats)
    theirs_s = seconds(lambda: results.append(kernel.scalar(table, ground.height_m, None, ASKED)), min(repeats, 3))
    equal = all(
        np.array_equal(results[0].seen, r.seen) and np.array_equal(results[0].in_range, r.in_range) for r in results
    )
    build = kernel.kernels.__name__.rsplit("_", 1)[-1]
    note = f"{build}; {samples(table) / 1e9:.2f} G samples; {'equal bits' if equal else 'BITS DIFFER'}"
    enough = build != "avx512" or theirs_s / ours_s >= 40
    return Measured(theirs_s / ours_s, ours_s, theirs_s, "scalar C++ loop over nodes", note, equal and enough)


def numpy(repeats: int) -> Measured:
    """Measure all nodes against numpy over all beams of a node, timed on a sample of nodes."""
    ground, table = workload()
    look = Look(ground, table, EYE_M)
    drawn = np.random.default_rng(0).choice(SIDE * SIDE, NODES, replace=False)
    nodes = [(int(n) // SIDE, int(n) % SIDE) for n in drawn]
    sums = kernel.total(table, ground.height_m, None, ASKED)
    equal = all(look.sums(n)[:2] == (sums.seen[n], sums.in_range[n]) for n in nodes)
    ours_s = seconds(lambda: kernel.total(table, ground.height_m, None, ASKED), repeats)
    theirs_s = seconds(lambda: [look.sums(n) for n in nodes], repeats) / NODES * SIDE * SIDE
    note = f"numpy on {NODES} nodes drawn from all, times {SIDE * SIDE // NODES}; {'equal' if equal else 'NOT EQUAL'}"
    return Measured(theirs_s / ours_s, ours_s, theirs_s, "numpy, one node at a time", note, equal)


def limit(repeats: int) -> Measured:
    """Measure all nodes against as many samples of the same inner loop on a few kilobytes."""
    ground, table = workload()
    one_beam, strip = visibility.beams(25.6, CELL_M, 1), np.zeros((4, 300), np.float32)
    wanted = samples(table)
    times = wanted // kernel.arithmetic(one_beam, strip, EYE_M, 1)
    ours_s, limits_s = [], []
    for _ in range(repeats):  # in turn: the machine's speed varies
        ours_s.append(seconds(lambda: kernel.total(table, ground.height_m, None, ASKED), 1))
        limits_s.append(seconds(lambda: kernel.arithmetic(one_beam, strip, EYE_M, times), 1))
    ours, least = float(np.median(ours_s)), float(np.median(limits_s))
    note = f"{wanted / ours / 1e9:.1f} of {wanted / least / 1e9:.1f} G samples/s"
    return Measured(ours / least, ours, least, "the inner loop on data of the first cache, ours / it", note)


ROWS = {"visibility-total": total, "visibility-numpy": numpy, "visibility-limit": limit}
