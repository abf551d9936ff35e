"""Map of two scans at the start under lost beams, outliers, mixed pixels and dark ground, against the error-free map.

    sweeps of an ideal scanner -> errors on their ranges and codes -> cloud, map, classes, pose freedom

No physics and no drive. A share is of the poses (cell, one of 8 orientations) that are free, or can be reached from the
rover's own pose, on the map of the same sweeps without errors. A pose that is free only with errors is counted apart:
it does not compensate a lost one. Up to LOOKED of these are checked on the true ground for hard contact of a rover that
stands there (belly, a wheel's step, tilt).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.config import Config
from onboard.perception.map import ldem
from onboard.perception.map.cell_classes import classify
from onboard.perception.map.stop_map import StopMap, look, remember
from onboard.perception.map.unseen_cells import without_unseen
from onboard.planning.local.poses import ORIENTATIONS, Freedom, pose_freedom, pose_index, reachable
from onboard.records import F64, Bool, Grid, Pose, Scan, Surface
from tests.missions.world.fields import FIELDS
from tests.missions.world.scan_errors import CLUMP, DEFAULT, ScanErrors
from tests.missions.world.scanner import Scanner, scanner
from tests.missions.world.world import HARD, World

I64 = NDArray[np.int64]

SEEDS = tuple(range(1, 11))
SALT, LOOKED = 79, 400
DARK_DISCS, DARK_RADIUS_M, DARK_AWAY_M = 8, (0.2, 0.8), (2.0, 7.0)
HEADS = ("sweeps with", "free poses kept, mean (worst field)", "reachable poses kept, mean (worst field)",
         "free that was not, of the free", "of these in hard contact", "promise, reachable")  # fmt: skip


@dataclass(frozen=True)
class Case:
    """Row of the table.

    least_ratio: least mean share of the reachable poses that must stay, over the fields; None: open.
    """

    name: str
    errors: ScanErrors = ScanErrors()
    least_ratio: float | None = None
    dark: bool = False


def cases() -> tuple[Case, ...]:
    """Return the table's rows, those of the promise first."""
    lost = ((0.0001, 0.98), (0.001, 0.98), (0.01, 0.95), (0.05, 0.80))
    return (
        *(Case(f"{100 * ratio:g} % lost, single", ScanErrors(ratio), least) for ratio, least in lost),
        *(Case(f"{100 * ratio:g} % lost, clumps", ScanErrors(ratio, CLUMP), least) for ratio, least in lost),
        Case("0.1 % off by up to 0.5 m", ScanErrors(outlier_ratio=0.001), 0.95),
        Case("10 % of edge beams mixed", ScanErrors(mixed_ratio=0.1), 0.95),
        Case("dark discs", dark=True),
        Case("default scanner's errors", DEFAULT),
    )


@dataclass(frozen=True)
class MapRun:
    """Fields of one kind, "campaign" or "demo". noise_m: 1 sigma of the ranges; None: as configured."""

    fields: str
    seeds: tuple[int, ...] = SEEDS
    noise_m: float | None = None


@dataclass(frozen=True)
class MapRow:
    """One field under one case, in poses.

    kept: free (reachable) with and without the errors.
    false: free with the errors only.
    looked: false ones checked on the true ground.
    hard: those of them in hard contact.
    """

    fields: str
    seed: int
    case: str
    free: int
    reachable: int
    kept_free: int
    kept_reachable: int
    false_free: int
    looked: int
    hard: int


class Poses(NamedTuple):
    """Masks (8, rows, columns) of the free poses and of those that the rover reaches."""

    grid: Grid
    free: Bool
    reachable: Bool


def fly(run: MapRun, seed: int) -> tuple[MapRow, ...]:
    """Run every case on one field."""
    world = FIELDS["main" if run.fields == "campaign" else run.fields](seed)
    made = replace(scanner(Config()), noise_m=run.noise_m)
    clean = sweeps(made, world)
    before = poses_of(made, world, clean)
    rows = []
    for k, case in enumerate(cases()):
        seen = sweeps(made, replace(world, dark=dark_discs(world, made.config))) if case.dark else clean
        rng = np.random.default_rng([seed, SALT, k])
        seen = tuple((pose, case.errors.apply(scans, rng)) for pose, scans in seen)
        after = poses_of(made, world, seen)
        false = np.argwhere(after.free & ~before.free)
        looked = false[np.sort(rng.choice(len(false), min(LOOKED, len(false)), replace=False))]
        rows.append(
            MapRow(
                run.fields,
                seed,
                case.name,
                int(before.free.sum()),
                int(before.reachable.sum()),
                int((before.free & after.free).sum()),
                int((before.reachable & after.reachable).sum()),
                len(false),
                len(looked),
                sum(in_hard_contact(world, before.grid, pose, made.config) for pose in looked),
            )
        )
    return tuple(rows)


Sweeps = Sequence[tuple[Pose, tuple[Scan, ...]]]


def sweeps(made: Scanner, world: World) -> Sweeps:
    """Return two sweeps at the start, ahead and behind, each with its pose."""
    rng, start = np.random.default_rng([world.seed, SALT]), world.start
    stands = [world.stand(start.x_m, start.y_m, start.yaw_rad + turn, made.config.rover) for turn in (0.0, math.pi)]
    return tuple((pose, made.sweep(world, pose, rng)) for pose in stands)


def map_of(made: Scanner, seen: Sweeps) -> StopMap:
    """Return the flight program's map of sweeps at known poses."""
    memory = None
    for pose, scans in seen:
        found = look(scans, made.tilt, pose.matrix(), None, made.config)
        memory = remember(memory, found.cloud_base, pose.matrix(), 0, made.config, found.dark_base_m)
    assert memory is not None
    return memory


def surface_around(memory: StopMap, place: Pose, size_m: float, config: Config) -> Surface:
    """Return the planner's surface in the square of size_m around a place."""
    near = ldem.window(memory.cells, place.x_m, place.y_m, size_m)
    return without_unseen(classify(near, config.mapping), memory.unseen_m)


def in_hard_contact(world: World, grid: Grid, pose: I64, config: Config) -> bool:
    """Return whether a rover that stands at a pose o, j, i of a map is in hard contact with the true ground."""
    o, j, i = (int(part) for part in pose)
    stood = world.stand(*grid.centre(j, i), o * math.pi / ORIENTATIONS, config.rover)
    return world.contact(stood, config.rover) == HARD


def poses_of(made: Scanner, world: World, seen: Sweeps) -> Poses:
    """Return the poses by the map of these sweeps; the rover's own counts as free."""
    config, start = made.config, world.start
    surface = surface_around(map_of(made, seen), start, config.mapping.size_m, config)
    freedom = pose_freedom(surface, config.rover, config.planning)
    j, i, o = pose_index(surface.grid, start.x_m, start.y_m, start.yaw_rad)
    freedom[o, j, i] = Freedom.FREE
    return Poses(surface.grid, freedom == Freedom.FREE, reachable(freedom, j, i, o))


def dark_discs(world: World, config: Config) -> F64:
    """Return discs (n, 3) of ground that returns nothing, 2 to 7 m from the start, none under the rover."""
    rng = np.random.default_rng([world.seed, SALT, 99])
    away, bearing = rng.uniform(*DARK_AWAY_M, DARK_DISCS), rng.uniform(-math.pi, math.pi, DARK_DISCS)
    radius = rng.uniform(*DARK_RADIUS_M, DARK_DISCS)
    x, y = world.start.x_m + away * np.cos(bearing), world.start.y_m + away * np.sin(bearing)
    return np.column_stack([x, y, radius])


@dataclass(frozen=True)
class MapLine:
    """A case over all fields, as ratios: (mean, least) of the fields.

    false_ratio: of all free poses.
    hard_ratio: of the checked false poses; nan if there are none.
    """

    case: Case
    free: tuple[float, float]
    reachable: tuple[float, float]
    false_ratio: float
    hard_ratio: float


def summed(rows: Sequence[MapRow]) -> list[MapLine]:
    """Return a line for each case, in the table's order."""
    by_case: Mapping[str, list[MapRow]] = {case.name: [r for r in rows if r.case == case.name] for case in cases()}
    return [_line(case, by_case[case.name]) for case in cases() if by_case[case.name]]


def _line(case: Case, rows: Sequence[MapRow]) -> MapLine:
    free = [row.kept_free / max(row.free, 1) for row in rows]
    reach = [row.kept_reachable / max(row.reachable, 1) for row in rows]
    false = sum(row.false_free for row in rows) / max(sum(row.free for row in rows), 1)
    looked = sum(row.looked for row in rows)
    hard = sum(row.hard for row in rows) / looked if looked else math.nan
    return MapLine(case, (float(np.mean(free)), min(free)), (float(np.mean(reach)), min(reach)), false, hard)


def shortfalls(lines: Sequence[MapLine]) -> list[str]:
    """Return each promise that a line breaks, in words."""
    return [
        f"{line.case.name}: {100 * line.reachable[0]:.1f} % of the reachable poses kept, "
        f"{100 * line.case.least_ratio:g} % promised"
        for line in lines
        if line.case.least_ratio is not None and line.reachable[0] < line.case.least_ratio
    ]


def cells(line: MapLine) -> tuple[str, ...]:
    """Return a line as text, in the order of HEADS."""
    free, reach = (f"{100 * mean:.1f} % ({100 * least:.1f} %)" for mean, least in (line.free, line.reachable))
    least = "-" if line.case.least_ratio is None else f"{100 * line.case.least_ratio:g} %"
    hard = "-" if math.isnan(line.hard_ratio) else f"{100 * line.hard_ratio:.1f} %"
    return line.case.name, free, reach, f"{100 * line.false_ratio:.2f} %", hard, least
