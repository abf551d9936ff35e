"""Rows of the planner: cell-classes, pose-field, local-cycle."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from onboard.config import Config
from onboard.perception.map import ldem
from onboard.perception.map.cell_classes import classify
from onboard.planning.cycle import plan
from onboard.planning.local.pose_field import DIRECTIONS, cost_to_go, moves_m
from onboard.planning.local.poses import Freedom, closeness, pose_freedom
from onboard.planning.mission_rule import MissionState
from onboard.planning.plan_records import PlanningSettings, PlanRequest
from onboard.records import Cloud, Grid, Pose, Surface
from tests.bench.goals import Measured, against, seconds
from tests.bench.mapping import sweep
from tests.oracles import classes as oracles_classes

SIDE, CELL_M = 200, 0.1


def pose_graph(passable: np.ndarray, turn_m: float) -> sparse.csr_array:
    """Return the edges between passable poses (8, rows, columns), without loops over cells."""
    index, prices = np.arange(passable.size).reshape(passable.shape), moves_m(CELL_M)
    here, there, price = [], [], []
    for o in range(8):
        for k, (dj, di) in enumerate(DIRECTIONS):
            a = (slice(max(0, -dj), SIDE - max(0, dj)), slice(max(0, -di), SIDE - max(0, di)))
            b = (slice(max(0, dj), SIDE + min(0, dj)), slice(max(0, di), SIDE + min(0, di)))
            both = passable[o][a] & passable[o][b]
            here.append(index[o][a][both])
            there.append(index[o][b][both])
            price.append(np.full(both.sum(), prices[o, k], np.float64))
        for other in ((o + 1) % 8, (o - 1) % 8):
            both = passable[o] & passable[other]
            here.append(index[o][both])
            there.append(index[other][both])
            price.append(np.full(both.sum(), turn_m))
    return sparse.csr_array(
        (np.concatenate(price), (np.concatenate(here), np.concatenate(there))), (passable.size,) * 2
    )


def pose_field(repeats: int) -> Measured:
    """Measure free and optimistic field over 200 x 200 x 8 poses with discs of rock and unknown patches."""
    rng, planning = np.random.default_rng(5), Config().planning
    freedom = np.full((8, SIDE, SIDE), 2, np.uint8)
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    for value, count in ((1, 30), (0, 60)):
        for _ in range(count):
            cj, ci, radius = rng.uniform(0, SIDE), rng.uniform(0, SIDE), rng.uniform(2, 8)
            freedom[:, np.hypot(x - ci, y - cj) < radius] = value
    freedom[:, :5, :5] = 2
    seeds = np.array([[1, 1, -1]])
    graphs = [pose_graph(freedom >= least, planning.turn_cost_m) for least in (2, 1)]
    starts = [o * SIDE * SIDE + SIDE + 1 for o in range(8)]

    def ours() -> list[np.ndarray]:
        return [cost_to_go(freedom, seeds, planning, CELL_M, optimistic) for optimistic in (False, True)]

    def theirs() -> list[np.ndarray]:
        return [csgraph.dijkstra(graph, indices=starts, min_only=True) for graph in graphs]

    equal = all(
        np.allclose(got[freedom >= least], want.reshape(got.shape)[freedom >= least], rtol=1e-6)
        for got, want, least in zip(ours(), theirs(), (2, 1))
    )
    made = against(ours, theirs, "scipy dijkstra, graph given", repeats)
    near = closeness(freedom, planning, CELL_M)
    soft_s = seconds(lambda: cost_to_go(freedom, seeds, planning, CELL_M, True, near), repeats)
    note = f"{'equal' if equal else 'NOT EQUAL'}; with closeness {soft_s * 1e3:.1f} ms a field"
    return replace(made, note=note, also=equal)


def cell_classes(repeats: int) -> Measured:
    """Measure classes, bounds, pose freedom of 200 x 200 cells x 8: one sweep over rough ground with rocks, holes."""
    config = Config()
    grid = Grid(-9.95, -9.95, CELL_M, SIDE, SIDE)
    rng, seen = np.random.default_rng(4), sweep()
    shape = (SIDE + 1, SIDE + 1)
    relief = rng.normal(0, 0.005, shape) + rng.choice([0.0, 0.15, -0.2], shape, p=(0.995, 0.003, 0.002))
    i, j = np.clip((seen.ends_m[:, :2] + 10.0) / CELL_M, 0, SIDE).astype(np.int64).T
    ends = seen.ends_m.copy()
    ends[:, 2] += relief[j, i] * seen.hit
    cells = ldem.insert(ldem.empty(grid), replace(seen, ends_m=ends), 0, config.mapping.near_m)

    def ours() -> tuple[Surface, np.ndarray]:
        surface = classify(cells, config.mapping)
        return surface, pose_freedom(surface, config.rover, config.planning, tyres=False)

    def theirs() -> tuple[Surface, np.ndarray]:
        surface = oracles_classes.classify(cells, config.mapping)
        return surface, oracles_classes.pose_freedom(surface, config.rover, config.planning)

    (surface, freedom), (known, free) = ours(), theirs()
    equal = np.array_equal(freedom, free) and np.array_equal(surface.cell_class, known.cell_class)
    made = against(ours, theirs, "vectorised numpy", 2 * repeats)
    share = ", ".join(f"{np.mean(freedom == kind):.0%} {kind.name.lower()}" for kind in Freedom)
    return replace(made, note=f"{'equal' if equal else 'NOT EQUAL'}; poses: {share}", also=equal)


def local_cycle(repeats: int) -> Measured:
    """Measure one sweep into a map of 200 x 200, classes, poses, decision, path, default strategy."""
    config = Config()
    grid = Grid(-9.95, -9.95, CELL_M, SIDE, SIDE)
    seen = sweep()
    ahead = np.abs(np.arctan2(seen.ends_m[:, 1], seen.ends_m[:, 0])) <= config.scanning.sector_rad
    cloud = Cloud(seen.origin_m, np.ascontiguousarray(seen.ends_m[ahead]), seen.hit[ahead], seen.sigma_range_m)
    settings = PlanningSettings(config.rover, config.mapping, config.planning, config.mission, config.scanning)
    start = ldem.assume_disc(ldem.empty(grid), Pose(0.0, 0.0), config.mapping.assumed_m)
    kinds = []

    def stop() -> None:
        cells = ldem.insert(start, cloud, 0, config.mapping.near_m)
        request = PlanRequest(cells, Pose(0.0, 0.0), (9.0, 2.0), None, MissionState(), settings, np.empty((0, 3)))
        kinds.append(plan(request).decision.kind)

    ours_s = seconds(stop, repeats)
    limit_s = 0.2
    return Measured(
        ours_s / limit_s,
        ours_s,
        limit_s,
        "the limit",
        f"{len(cloud.ends_m)} beams; decides {kinds[-1]!r}",
        math.isfinite(ours_s),
    )


ROWS = {"cell-classes": cell_classes, "pose-field": pose_field, "local-cycle": local_cycle}
