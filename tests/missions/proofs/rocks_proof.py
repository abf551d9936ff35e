"""Small rocks before the rover, one sweep, then pose freedom: no pose that rolls over the rock's top may be free.

Gently rough ground (fBm, median slope 3 degrees) without other rocks; each place has one rock of a given height and a
drawn width, 2, 4, 6 or 8 m from base_link, within 55 degrees of straight ahead; four places share a sweep, more than a
metre apart. Beams meet the rock's own triangles. A pose rolls over a rock when the rock's highest point lies under one
of its wheels: in a square of a wheel's width about the wheel's centre, the body in the pose's own orientation at the
centre of its cell. A rock blocks when none of the poses, of all 8 orientations, that roll over it is FREE.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from hil.terrain.field import Field
from hil.terrain.mesh import soil_height
from hil.terrain.recipe import Course, Recipe, compose
from hil.terrain.rocks import Rock, rock_of
from onboard.config import Config, Rover
from onboard.planning.local.poses import ORIENTATIONS, Freedom, pose_freedom
from onboard.records import F64, I32, U8, BeamStatus, Grid, Pose, Scan
from protocol.conventions import WHEEL_SIGNS
from tests.missions.proofs.map_proof import map_of, surface_around
from tests.missions.world.scan_errors import DEFAULT, ScanErrors
from tests.missions.world.scanner import FAR_M, Scanner, scanner
from tests.missions.world.world import Triangles, World, of_field

HEIGHTS_M, WIDTHS_M, AWAYS_M = (0.07, 0.08, 0.10, 0.15), (0.15, 0.40), (2.0, 4.0, 6.0, 8.0)
SEEDS = tuple(range(1, 51))  # places of each height and distance
MEDIAN_SLOPE_DEG, SALT = 3.0, 83
SECTOR_RAD, APART_M = math.radians(55), 1.0
PROMISED_M, PROMISED_AWAY_M = 0.08, 4.0  # each rock of this height and within this distance blocks
FEW_HEIGHT_M, FEW_BEAMS = 0.10, (5, 12)
OUTLIERS = ScanErrors(outlier_ratio=0.001)
HEADS = ("rock", *(f"{away_m:g} m away" for away_m in AWAYS_M))


@dataclass(frozen=True)
class RockRun:
    """A distance with its seeds. few: True: only 5 to 12 adjacent beams of the rock return."""

    away_m: float
    seeds: tuple[int, ...] = SEEDS
    errors: ScanErrors | None = DEFAULT
    few: bool = False


@dataclass(frozen=True)
class RockRow:
    """One rock.

    beams: that returned from it.
    free: free poses that roll over its top.
    poses: all poses that roll over its top.
    """

    away_m: float
    seed: int
    few: bool
    height_m: float
    width_m: float
    beams: int
    free: int
    poses: int

    @property
    def blocks(self) -> bool:
        """True if no pose that rolls over it is free."""
        return self.free == 0


@lru_cache(maxsize=1)
def _scanner() -> Scanner:
    return scanner(Config())


def fly(run: RockRun, seed: int) -> tuple[RockRow, ...]:
    """Run the four rocks of one sweep."""
    made, rng = _scanner(), np.random.default_rng([seed, SALT, round(10 * run.away_m), run.few])
    heights = (FEW_HEIGHT_M,) * len(HEIGHTS_M) if run.few else tuple(rng.permutation(HEIGHTS_M).tolist())
    field, world = rocky(run.away_m, heights, seed, rng)
    pose = world.stand(world.start.x_m, world.start.y_m, world.start.yaw_rad, made.config.rover)
    scans = made.sweep(world, pose, rng)
    on_rock = [beams_on(rock, field, made, world, pose) for rock in field.rocks]
    if run.few:
        scans = thinned(scans, on_rock, rng)
    scans = run.errors.apply(scans, rng) if run.errors else scans
    seen = (np.stack([scan.status for scan in scans]) == BeamStatus.OK).ravel()
    config = made.config
    surface = surface_around(map_of(made, [(pose, scans)]), pose, config.mapping.size_m, config)
    freedom = pose_freedom(surface, config.rover, config.planning)
    rows = []
    for rock, beams in zip(field.rocks, on_rock):
        over = rolling_over(top_of(rock), surface.grid, config.rover)
        rows.append(
            RockRow(
                run.away_m,
                seed,
                run.few,
                float(rock.height_m),
                round(rock.diameter_m, 3),
                int(seen[beams].sum()),
                free_of(freedom, over),
                len(over),
            )
        )
    return tuple(rows)


def rocky(away_m: float, heights_m: Sequence[float], seed: int, rng: np.random.Generator) -> tuple[Field, World]:
    """Return gentle ground with a rock of each height at the distance, the start heading along +x."""
    recipe = Recipe(rng.uniform(0.75, 0.9), median_slope_deg=MEDIAN_SLOPE_DEG)
    field = compose(recipe, Course(away_m=9.0), rng, seed)
    rocks = []
    for bearing, height_m in zip(_bearings(away_m, len(heights_m), rng), heights_m):
        x_m, y_m = field.start.x_m + away_m * math.cos(bearing), field.start.y_m + away_m * math.sin(bearing)
        rocks.append(standing(field, x_m, y_m, rng.uniform(*WIDTHS_M), height_m, rng))
    field = replace(field, rocks=tuple(rocks))
    return field, replace(of_field(field, "rocks"), caster=Triangles(field))


def standing(field: Field, x_m: float, y_m: float, width_m: float, height_m: float, rng: np.random.Generator) -> Rock:
    """Return a rock of this size on the field's soil."""
    z_m = float(soil_height(field.grid, field.soil_z, np.array([x_m]), np.array([y_m]))[0])
    return rock_of(x_m, y_m, z_m, width_m, height_m, rng)


def _bearings(away_m: float, count: int, rng: np.random.Generator) -> F64:
    """Return bearings within the sector, all APART_M apart at this distance."""
    while True:
        found = np.sort(rng.uniform(-SECTOR_RAD, SECTOR_RAD, count))
        if (2 * away_m * np.sin(np.diff(found) / 2) >= APART_M).all():
            return rng.permutation(found)


def beams_on(rock: Rock, field: Field, made: Scanner, world: World, pose: Pose) -> I32:
    """Return the numbers of the sweep's beams whose light truly meets the rock."""
    T, rover = pose.matrix(), made.config.rover
    origin = T[:3, :3] @ (rover.lidar_x_m, 0.0, rover.lidar_z_m) + T[:3, 3]
    ways = made.directions @ T[:3, :3].T
    off_m = rock.vertices_m.mean(axis=0) - origin
    reach_m = rock.diameter_m + rock.height_m
    aimed = np.flatnonzero(ways @ off_m > math.sqrt(max(off_m @ off_m - reach_m**2, 0.0)))
    ends = origin + np.minimum(world.rays.cast(origin, ways[aimed], FAR_M), FAR_M)[:, None] * ways[aimed]
    soil_m = soil_height(field.grid, field.soil_z, ends[:, 0], ends[:, 1])
    near = np.hypot(ends[:, 0] - rock.x_m, ends[:, 1] - rock.y_m) <= rock.diameter_m / 2 + 1e-3
    return aimed[near & (ends[:, 2] > soil_m + 1e-4)].astype(np.int32)


def thinned(scans: Sequence[Scan], on_rock: Sequence[I32], rng: np.random.Generator) -> tuple[Scan, ...]:
    """Return the scans with few of each rock's beams: those nearest, in the range image, to one of its upper third."""
    ranges_m, status = np.stack([s.ranges_m for s in scans]), np.stack([s.status for s in scans])
    for beams in on_rock:
        line, beam = np.unravel_index(beams, status.shape)
        upper = np.flatnonzero(line >= np.quantile(line, 2 / 3)) if len(line) else np.empty(0, int)
        if not len(upper):
            continue
        middle = rng.choice(upper)
        order = np.argsort(np.hypot(line - line[middle], beam - beam[middle]), kind="stable")
        gone = order[rng.integers(FEW_BEAMS[0], FEW_BEAMS[1] + 1) :]
        status[line[gone], beam[gone]], ranges_m[line[gone], beam[gone]] = BeamStatus.NO_RETURN, np.nan
    return tuple(replace(scan, ranges_m=r, status=s) for scan, r, s in zip(scans, ranges_m, status))


def top_of(rock: Rock) -> tuple[float, float]:
    """Return (x, y) of its highest point."""
    x_m, y_m, _ = rock.vertices_m[rock.vertices_m[:, 2].argmax()]
    return float(x_m), float(y_m)


def rolling_over(point_m: tuple[float, float], grid: Grid, rover: Rover) -> I32:
    """Return poses (k, 3) o, j, i on the grid that have a point under a wheel."""
    half_m, reach = rover.wheel_width_m / 2, math.ceil(1.0 / grid.cell_m)
    j0, i0 = grid.cell(*point_m)
    j, i = (part.ravel() for part in np.mgrid[j0 - reach : j0 + reach + 1, i0 - reach : i0 + reach + 1])
    inside = (j >= 0) & (j < grid.rows) & (i >= 0) & (i < grid.columns)
    j, i = j[inside], i[inside]
    dx, dy = point_m[0] - grid.x0_m - i * grid.cell_m, point_m[1] - grid.y0_m - j * grid.cell_m
    found = []
    for o in range(ORIENTATIONS):
        c, s = math.cos(o * math.pi / ORIENTATIONS), math.sin(o * math.pi / ORIENTATIONS)
        along, across = c * dx + s * dy, c * dy - s * dx
        under = np.zeros(len(j), np.bool_)
        for a, b in WHEEL_SIGNS:
            under |= (np.abs(along - a * rover.half_wheelbase_m) <= half_m) & (
                np.abs(across - b * rover.half_track_m) <= half_m
            )
        found.append(np.column_stack([np.full(under.sum(), o), j[under], i[under]]))
    return np.concatenate(found).astype(np.int32)


def free_of(freedom: U8, poses: I32) -> int:
    """Return the number of free poses among these."""
    return int((freedom[tuple(poses.T)] == Freedom.FREE).sum())


def cells(rows: Sequence[RockRow]) -> list[tuple[str, ...]]:
    """Return the table: number of blocking rocks by height and distance; then rocks seen by few beams."""
    whole, few_beams = [row for row in rows if not row.few], [row for row in rows if row.few]
    lines = [
        (f"{height_m:g} m high", *_shares([row for row in whole if row.height_m == height_m])) for height_m in HEIGHTS_M
    ]
    name = f"{FEW_HEIGHT_M:g} m high, seen by {FEW_BEAMS[0]} to {FEW_BEAMS[1]} beams, 0.1 % outliers"
    return [*lines, (name, *_shares(few_beams))]


def _shares(rows: Sequence[RockRow]) -> list[str]:
    return [_share([row for row in rows if row.away_m == away_m]) for away_m in AWAYS_M]


def _share(rows: Sequence[RockRow]) -> str:
    return f"{sum(row.blocks for row in rows)} of {len(rows)}" if rows else "-"


def shortfalls(rows: Sequence[RockRow]) -> list[str]:
    """Return every rock that should block and does not."""
    return [
        f"seed {row.seed}: a rock of {row.height_m:g} m x {row.width_m:g} m, {row.away_m:g} m away, {row.beams} beams: "
        f"{row.free} of {row.poses} poses that roll over it are free"
        for row in rows
        if not row.blocks and _promised(row)
    ]


def _promised(row: RockRow) -> bool:
    seen_enough = row.beams >= FEW_BEAMS[0] if row.few else row.height_m >= PROMISED_M
    return seen_enough and row.away_m <= PROMISED_AWAY_M
