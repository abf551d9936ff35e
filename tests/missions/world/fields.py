"""Fields of the campaign, drawn from seeds. The truth planner, not this module, decides whether a goal is reachable.

main   20 m x 20 m, fBm of median slope 4.5 to 7.5 degrees, H 0.75 to 0.9; rocks by kind (seed modulo 5); goal 10 to
       16 m away; the rover looks within 45 degrees of it
trap   a U of walls, 0.5 to 0.9 m high, 3 to 6 m deep, 4 to 8 m wide, open towards the start, before the goal
ring   a closed wall round the goal, whole in the field with room to drive round it
far    50 m x 50 m, goal 36 to 42 m away
demo   those of `make demo`
pits   main with Golombek rocks and 60 holes of 0.2 to 0.7 m x 0.12 to 0.30 m on 400 m2
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from hil.terrain.field import Field
from hil.terrain.fields import demo_field
from hil.terrain.fractal import fractal_heights
from hil.terrain.mesh import block_mean, slopes_deg
from hil.terrain.rock_sizes import Golombek, PowerLaw, RockLaw
from hil.terrain.rocks import scatter_rocks
from onboard.records import F32, F64, Gdem, Grid, Pose
from tests.missions.world.world import Triangles, World, of_field

CELL_M, SIDE_M, FAR_SIDE_M = 0.05, 20.0, 50.0
EDGE_M = 1.5  # of start and goal from the border
RING_EDGE_M = 4.0  # of a goal with a wall round it: no path beyond the border stays open
START_CLEAR_M, GOAL_CLEAR_M = 1.0, 0.5
STEEPEST_P95_DEG = 16.0
HOLES_PER_M2 = 60 / 400
KINDS: tuple[tuple[str, RockLaw | None], ...] = (
    ("no rocks", None),
    ("power law 2.5 %", PowerLaw(0.025)),
    ("power law 5 %", PowerLaw(0.05)),
    ("Golombek 5 %", Golombek(0.05)),
    ("Golombek 7.5 %", Golombek(0.075)),
)


@dataclass(frozen=True)
class Course:
    """A square field, the distance from start to goal, and the goal's least distance from the border."""

    side_m: float = SIDE_M
    away_m: tuple[float, float] = (10.0, 16.0)
    goal_edge_m: float = EDGE_M


def main_field(seed: int) -> World:
    """Return one of the 60 main fields."""
    kind, law = KINDS[seed % len(KINDS)]
    return _field(seed, 1, Course(), kind, law)


def trap(seed: int) -> World:
    """Return a field with a U across the straight path, its mouth towards the start."""
    rng = np.random.default_rng([seed, 2])
    world = _field(seed, 2, Course(away_m=(11.0, 14.0)), "U-trap", PowerLaw(0.01))
    high_m, deep_m, wide_m = rng.uniform(0.5, 0.9), rng.uniform(3.0, 6.0), rng.uniform(4.0, 8.0)
    along, across = _about_goal(world)
    back = -2.0  # the closed end, before the goal
    walls = (np.abs(along - back) <= 0.15) & (np.abs(across) <= wide_m / 2)
    sides = (np.abs(np.abs(across) - wide_m / 2) <= 0.15) & (along <= back) & (along >= back - deep_m)
    return _raised(world, walls | sides, high_m)


def ring(seed: int) -> World:
    """Return a field with a closed wall round the goal."""
    rng = np.random.default_rng([seed, 3])
    world = _field(seed, 3, Course(away_m=(10.0, 14.0), goal_edge_m=RING_EDGE_M), "ring", PowerLaw(0.01))
    along, across = _about_goal(world)
    wall = np.abs(np.hypot(along, across) - rng.uniform(1.2, 2.0)) <= 0.15
    return _raised(world, wall, rng.uniform(0.5, 0.9))


def far(seed: int) -> World:
    """Return a field with a distant goal."""
    return _field(seed, 4, Course(FAR_SIDE_M, (36.0, 42.0)), "far", PowerLaw(0.02))


def pits(seed: int) -> World:
    """Return a field with holes that a distant scan cannot prove."""
    rng = np.random.default_rng([seed, 5])
    world = _field(seed, 5, Course(), "pits", Golombek(0.05))
    return with_holes(world, round(HOLES_PER_M2 * SIDE_M**2), rng)


def demo(seed: int) -> World:
    """Return the demo's field; beams meet its rocks by their own triangles, as in the demo."""
    field = demo_field(seed).field
    return replace(of_field(field, "demo"), caster=Triangles(field))


FIELDS: Mapping[str, Callable[[int], World]] = {
    "main": main_field, "trap": trap, "ring": ring, "far": far, "pits": pits, "demo": demo,
}  # fmt: skip


def with_holes(world: World, count: int, rng: np.random.Generator) -> World:
    """Return the world with holes of 0.2 to 0.7 m x 0.12 to 0.30 m, none near start or goal."""
    grid, holes = world.grid, []
    low = np.array([grid.x0_m, grid.y0_m])
    high = low + grid.cell_m * np.array([grid.columns - 1, grid.rows - 1])
    while len(holes) < count:
        x, y = rng.uniform(low, high)
        width, depth = rng.uniform(0.2, 0.7), rng.uniform(0.12, 0.30)
        from_start = math.dist((x, y), (world.start.x_m, world.start.y_m))
        if from_start > START_CLEAR_M + width and math.dist((x, y), world.goal_m) > GOAL_CLEAR_M + width:
            holes.append((x, y, width, depth))
    return world.sunk(np.array(holes))


def from_orbit(world: World, cell_m: float) -> Gdem:
    """Return the orbiter's map of a world: means over blocks of whole cells; the rest at the far borders is cut off."""
    grid = world.grid
    factor = round(cell_m / grid.cell_m)
    heights = block_mean(world.heights_m[: grid.rows // factor * factor, : grid.columns // factor * factor], factor)
    first_m = (cell_m - grid.cell_m) / 2
    coarse = Grid(grid.x0_m + first_m, grid.y0_m + first_m, cell_m, *heights.shape)
    return Gdem(coarse, heights.astype(np.float32), f"block means of {cell_m:g} m")


def _field(seed: int, salt: int, course: Course, kind: str, law: RockLaw | None) -> World:
    """Return a square field; the start is the origin of the map."""
    rng = np.random.default_rng([seed, salt])
    nodes = round(course.side_m / CELL_M)
    soil = _soil(nodes, rng)
    start, goal = _ends(course, rng)
    grid = Grid(_on_lattice(-start[0]), _on_lattice(-start[1]), CELL_M, nodes, nodes)
    bearing = math.atan2(goal[1] - start[1], goal[0] - start[0])
    goal_m = (goal[0] - start[0], goal[1] - start[1])
    soil = (soil - soil[grid.cell(0.0, 0.0)]).astype(np.float32)
    clear = ((0.0, 0.0, START_CLEAR_M), (*goal_m, GOAL_CLEAR_M))
    rocks = () if law is None else scatter_rocks(grid, soil, law, clear, rng)
    yaw = bearing + rng.uniform(-math.pi / 4, math.pi / 4)
    nothing = Gdem(Grid(0.0, 0.0, 10.0, 1, 1), np.zeros((1, 1), np.float32))
    return of_field(Field(grid, soil, rocks, Pose(0.0, 0.0, yaw_rad=yaw), goal_m, nothing, seed, {}), kind)


def _soil(nodes: int, rng: np.random.Generator) -> F64:
    """Return fBm of the required slopes; drawn again while its steepest twentieth is too steep."""
    while True:
        hurst, median_deg = rng.uniform(0.75, 0.9), rng.uniform(4.5, 7.5)
        tile = fractal_heights(2 * nodes, CELL_M, hurst, 1.0, rng)[:nodes, :nodes]
        tile *= math.tan(math.radians(median_deg)) / math.tan(math.radians(np.median(slopes_deg(tile, CELL_M))))
        if np.percentile(slopes_deg(tile, CELL_M), 95) <= STEEPEST_P95_DEG:
            return tile


def _ends(course: Course, rng: np.random.Generator) -> tuple[F64, F64]:
    """Return start and goal from the field's corner, at the required distance."""
    while True:
        start, goal = rng.uniform(EDGE_M, course.side_m - EDGE_M, (2, 2))
        inside = min(*goal, *(course.side_m - goal)) >= course.goal_edge_m
        if inside and course.away_m[0] <= math.dist(start, goal) <= course.away_m[1]:
            return start, goal


def _on_lattice(edge_m: float) -> float:
    """Return the first centre of a cell at or after an edge."""
    return (math.floor(edge_m / CELL_M) + 0.5) * CELL_M


def _about_goal(world: World) -> tuple[F64, F64]:
    """Return each node's distance beyond the goal, seen from the start, and left of that line, (rows, columns)."""
    grid, (gx, gy) = world.grid, world.goal_m
    x, y = grid.x0_m + np.arange(grid.columns) * grid.cell_m - gx, grid.y0_m + np.arange(grid.rows) * grid.cell_m - gy
    bearing = math.atan2(gy, gx)
    c, s = math.cos(bearing), math.sin(bearing)
    return c * x[None, :] + s * y[:, None], c * y[:, None] - s * x[None, :]


def _raised(world: World, where: F64, by_m: float) -> World:
    heights: F32 = world.heights_m + np.where(where, np.float32(by_m), np.float32(0.0))
    return replace(world, heights_m=heights)
