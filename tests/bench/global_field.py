"""Rows of the global planner: global-50, global-500, global-2000."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from hil.terrain.fractal import fractal_heights
from hil.terrain.mesh import slopes_deg
from onboard.config import Planning
from onboard.kernel_calls import global_field as door
from onboard.planning import global_path
from onboard.records import Gdem, Grid
from tests.bench.goals import Measured, against

CELL_M, MEDIAN_SLOPE_DEG, LIMIT_RAD = 10.0, 5.7, 0.36
AXES = global_path.NEIGHBOURS[:4]
MEMORY_LIMIT_B = 2e9


def ground(side: int) -> np.ndarray:
    """Return fractal heights with a median slope of 5.7 degrees, float32."""
    z = fractal_heights(side, CELL_M, 0.8, 1.0, np.random.default_rng(7))
    low, high = 0.0, 100.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if np.median(slopes_deg(middle * z, CELL_M)) < MEDIAN_SLOPE_DEG else (low, middle)
    return (low * z).astype(np.float32)


def by_scipy(heights_m: np.ndarray, goal: int, planning: Planning) -> np.ndarray:
    """Compute the same field with scipy: ndimage for the layers, whole arrays for the edges, dijkstra on a csr."""
    limit, (rows, columns) = planning.slope_limit_rad, heights_m.shape
    z = np.pad(heights_m.astype(np.float64), 1, mode="reflect", reflect_type="odd")
    z -= z.mean()
    ramp, same = np.array([-1.0, 0.0, 1.0]), np.ones(3)
    x = ndimage.correlate1d(ndimage.correlate1d(z, ramp, 1), same, 0) / (6 * CELL_M)
    y = ndimage.correlate1d(ndimage.correlate1d(z, ramp, 0), same, 1) / (6 * CELL_M)
    spread = ndimage.uniform_filter(z * z, 3) - ndimage.uniform_filter(z, 3) ** 2
    rough = np.sqrt(np.maximum(spread - (x * x + y * y) * (CELL_M**2 * 2 / 3), 0.0))
    z, x, y, rough = (layer[1:-1, 1:-1] for layer in (z, x, y, rough))
    rough = rough * planning.weight_roughness / max(rough.max(), global_path.ROUGHNESS_FLOOR_M)
    half = np.sqrt(0.5)
    angles = [np.arctan(np.abs(slope)) for slope in (x, (x + y) * half, y, (y - x) * half)]
    index = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    start, end, weight = [], [], []
    for k, (dj, di) in enumerate(AXES):
        pitch, roll = angles[k], angles[(k + 2) % 4]
        price = rough + (planning.weight_pitch * pitch + planning.weight_roll * roll) / limit
        price[np.maximum(pitch, roll) > limit] = np.inf
        a = (slice(0, rows - dj), slice(max(0, -di), columns - max(0, di)))
        b = (slice(dj, rows), slice(max(0, di), columns + min(0, di)))
        cost = np.hypot(CELL_M * np.hypot(dj, di), z[b] - z[a]) * (1 + 0.5 * (price[a] + price[b]))
        there = np.isfinite(cost)
        start += [index[a][there], index[b][there]]
        end += [index[b][there], index[a][there]]
        weight += [cost[there]] * 2
    edges = (np.concatenate(weight), (np.concatenate(start), np.concatenate(end)))
    return csgraph.dijkstra(sparse.csr_array(edges, (z.size, z.size)), indices=goal, return_predecessors=True)[0]


def measure(side: int, repeats: int, inner: int = 1) -> Measured:
    """Measure the whole field of the middle node, in a workspace that is reused as at each stop."""
    heights_m, planning = ground(side), Planning(slope_limit_rad=LIMIT_RAD)
    gdem = Gdem(Grid(CELL_M / 2, CELL_M / 2, CELL_M, side, side), heights_m)
    flat, work = side // 2 * side + side // 2, door.workspace(side, side)
    seed = (np.array([flat]), np.zeros(1))

    def ours() -> np.ndarray:
        global_path.make_edges(gdem, planning, work)
        return door.cost_to_go(seed, work)[0]

    made = against(
        ours,
        lambda: by_scipy(heights_m, flat, planning),
        "scipy: ndimage layers + csr + dijkstra",
        repeats,
        inner,
    )
    got, want = ours().ravel(), by_scipy(heights_m, flat, planning)
    equal = bool(np.allclose(got, want, rtol=1e-5))
    return replace(made, note="equal" if equal else "NOT EQUAL", also=equal)


def plan_5000() -> None:
    """Print the seconds of a 5000 x 5000 plan, this process's peak memory and the share of the nodes reached."""
    heights_m = np.tile(ground(1000), (5, 5))
    gdem = Gdem(Grid(5.0, 5.0, CELL_M, 5000, 5000), heights_m)
    began = time.perf_counter()
    field = global_path.solve(gdem, (25005.0, 25005.0), Planning(slope_limit_rad=LIMIT_RAD))
    took_s = time.perf_counter() - began
    reached = float(np.isfinite(field.cost_m).mean())
    peak = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())  # ru_maxrss starts at the parent's
    assert peak
    print(took_s, 1024 * int(peak[1]), reached)


def in_a_process_of_its_own() -> tuple[float, float, float]:
    """Return seconds, peak bytes and reached share of a 5000 x 5000 plan, run in a child process."""
    run = subprocess.run(
        [sys.executable, "-m", "tests.bench.global_field"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    took_s, peak_b, reached = map(float, run.stdout.split())
    return took_s, peak_b, reached


def global_2000(repeats: int) -> Measured:
    """Measure 2000 x 2000 and, for comparison, 5000 x 5000 within 2 GB."""
    made = measure(2000, repeats)
    took_s, peak_b, reached = in_a_process_of_its_own()
    note = f"{made.note}; 5000 x 5000: {took_s:.2f} s, {peak_b / 1e9:.2f} GB at most, {reached:.0%} reached"
    return replace(made, note=note, also=made.also and peak_b <= MEMORY_LIMIT_B)


ROWS: dict[str, Callable[[int], Measured]] = {
    "global-50": lambda repeats: measure(50, repeats, 20),
    "global-500": lambda repeats: measure(500, repeats),
    "global-2000": global_2000,
}

if __name__ == "__main__":
    plan_5000()
