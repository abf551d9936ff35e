"""Fields of the demo: rough ground with rocks, and optional craters, accepted by rules before any run.

A field is 20 m x 20 m in 0.05 m cells, with the start 2.5 m from its left side and the goal 15 m away. Of the seeds
1000 * index, + 1, + 2, ... the first is taken whose field passes these rules, in this order, on the true ground in 0.1
m cells:
  1. median slope 4.5 to 7.5 degrees and rocks on 2.5 to 5 % of the area (checked, though drawn from such ranges);
  2. the start pose is free, and so is a pose within 0.1 m of the goal;
  3. the straight line is blocked: of the poses along it, heading along it, not all are free;
  4. there is a route with room: over poses that stay free with step 0.07 m, under the belly 0.09 m, tilt 22 degrees
     (config: 0.08, 0.10, 25), and whose four neighbour cells are free too, so that noise of the scan and a few
     centimetres of drift do not close it.
Rejected seeds and their reasons are stored: the choice is part of the result. Of the first 40 seeds 38 pass; the other
two have a free straight line. Cratered fields (TERRAIN=craters) pass by the same rules, 16 of the first 20; the others
have a crater or its rim at the rover's start or end.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hil.own_functions import generator
from hil.terrain.craters import CraterLaw
from hil.terrain.field import Field, truth_height
from hil.terrain.recipe import GOAL_AWAY_M, Course, Recipe, compose
from hil.terrain.rock_sizes import Golombek, PowerLaw
from onboard.config import Planning, Rover
from onboard.native import elementary
from onboard.planning.local import poses
from onboard.records import CellClass, Grid, Surface

PLAN_CELL_M = 0.1
SEEDS_PER_INDEX = 1000
STEP_M = 0.07  # without the rule of tyres: the fields stay the same, whatever limits the flight program uses
NEAR_M = 0.1


@dataclass(frozen=True, slots=True)
class AcceptedField:
    """Accepted field.

    field: the field
    seed: its seed
    passed_over: (seed, reason) of the rejected seeds before it
    """

    field: Field
    seed: int
    passed_over: tuple[tuple[int, str], ...]


def demo_field(seed_index: int) -> AcceptedField:
    """Field of `make demo SEED=seed_index`. Raises ValueError if none of its seeds passes."""
    return first_accepted(seed_index, make_field)


def crater_field(seed_index: int) -> AcceptedField:
    """Field of `make demo TERRAIN=craters SEED=seed_index`. Raises ValueError if none of its seeds passes."""
    return first_accepted(seed_index, make_crater_field)


def first_accepted(seed_index: int, make: Callable[[int], Field]) -> AcceptedField:
    """First field of the seeds 1000 * seed_index ... that passes; ValueError if none does."""
    passed_over: list[tuple[int, str]] = []
    for seed in range(SEEDS_PER_INDEX * seed_index, SEEDS_PER_INDEX * (seed_index + 1)):
        field = make(seed)
        reason = refusal(field)
        if not reason:
            return AcceptedField(field, seed, tuple(passed_over))
        passed_over.append((seed, reason))
    raise ValueError(f"no field of seed {seed_index} passes; the last reason: {passed_over[-1][1]}")


def make_field(seed: int) -> Field:
    """Field of a seed, accepted or not."""
    rng = generator([seed, 20])
    hurst, median_deg, ratio = rng.uniform(0.75, 0.9), rng.uniform(4.7, 7.3), rng.uniform(0.026, 0.049)
    course = draw_course(rng)
    return compose(Recipe(hurst, median_slope_deg=median_deg, rocks=PowerLaw(ratio)), course, rng, seed)


def make_crater_field(seed: int) -> Field:
    """Field of a seed, accepted or not, with craters in steady state and rocks by Golombek's law."""
    rng = generator([seed, 61])
    hurst, median_deg, k = rng.uniform(0.75, 0.9), rng.uniform(4.2, 5.8), rng.uniform(0.055, 0.075)
    course = draw_course(rng)
    return compose(Recipe(hurst, None, median_deg, CraterLaw(), Golombek(k)), course, rng, seed)


def draw_course(rng: np.random.Generator) -> Course:
    """Random start 7 to 13 m and goal 4 to 16 m from the south side."""
    south_m = round(rng.uniform(7.0, 13.0), 1)
    return Course(south_m, elementary.asin(max(-0.5, min(0.5, (rng.uniform(4.0, 16.0) - south_m) / GOAL_AWAY_M))))


def true_surface(field: Field) -> Surface:
    """True ground as the best possible knowledge of a planner: every cell of 0.1 m hit."""
    return surface_of(field.grid, truth_height(field), PLAN_CELL_M)


def surface_of(fine: Grid, top: NDArray[np.float32], cell_m: float) -> Surface:
    """Surface in cells of `cell_m`, a whole multiple, from heights (rows, columns) on `fine`; every cell is hit."""
    factor = round(cell_m / fine.cell_m)
    if factor > 1:
        rows, columns = top.shape[0] // factor, top.shape[1] // factor
        cut = top[: rows * factor, : columns * factor]
        parts = cut.reshape(rows, factor, columns, factor).transpose(0, 2, 1, 3).reshape(rows, columns, -1)
        mean, high, low = parts.mean(axis=2), parts.max(axis=2), parts.min(axis=2)
    else:
        mean, high, low = top, top, top
    shift = (cell_m - fine.cell_m) / 2
    grid = Grid(fine.x0_m + shift, fine.y0_m + shift, cell_m, *mean.shape)
    hit = np.full(mean.shape, CellClass.HIT, np.uint8)
    return Surface(grid, hit, mean, high, low, np.full(mean.shape, np.inf, np.float32))


def refusal(field: Field) -> str:
    """'' if the field passes, else the first rule that it breaks (see the module head)."""
    median_deg, ratio = field.stats["median_slope_deg"], field.stats["rock_area_ratio"]
    if not (4.5 <= median_deg <= 7.5 and 0.025 <= ratio <= 0.05):
        return f"median slope {median_deg:.1f} deg, rocks on {100 * ratio:.1f} % of the area"
    surface, rover, planning = true_surface(field), Rover(), Planning(step_m=STEP_M)
    free = poses.pose_freedom(surface, rover, planning, tyres=False) == poses.Freedom.FREE
    start = pose_of(surface.grid, field.start.x_m, field.start.y_m, field.start.yaw_rad)
    goal = goal_poses(surface.grid, field.goal_m)
    if not (free[start] and any(free[pose] for pose in goal)):
        return "the start pose or every pose at the goal is not free"
    if all(free[pose] for pose in straight_line(surface.grid, field)):
        return "the straight line is free"
    roomy = free_with_room(surface, rover, planning)
    if not roomy[start]:
        return "no room at the start"
    freedom = np.where(roomy, poses.Freedom.FREE, poses.Freedom.BLOCKED).astype(np.uint8)
    reached = poses.reachable(freedom, start[1], start[2], start[0])
    return "" if any(reached[pose] for pose in goal) else "no way with room"


def free_with_room(surface: Surface, rover: Rover, planning: Planning) -> NDArray[np.bool_]:
    """True for poses that are free by the stricter limits, with their four neighbour cells, (8, rows, columns)."""
    strict = replace(planning, under_belly_m=0.09, tilt_limit_rad=math.radians(22))
    free = poses.pose_freedom(surface, rover, strict, tyres=False) == poses.Freedom.FREE
    shrunk = free.copy()
    for axis in (1, 2):
        for shift in (1, -1):
            shrunk &= np.roll(free, shift, axis)
    return shrunk


def pose_of(grid: Grid, x_m: float, y_m: float, yaw_rad: float) -> tuple[int, int, int]:
    """(orientation, j, i) of the pose nearest to a place and yaw."""
    j, i = grid.cell(x_m, y_m)
    return poses.orientation(yaw_rad), j, i


def goal_poses(grid: Grid, goal_m: tuple[float, float]) -> list[tuple[int, int, int]]:
    """Every orientation on the cells within 0.1 m of the goal."""
    j, i = grid.cell(*goal_m)
    near = [
        (j + dj, i + di)
        for dj in (-1, 0, 1)
        for di in (-1, 0, 1)
        if elementary.dist(grid.centre(j + dj, i + di), goal_m) <= NEAR_M
    ]
    return [(o, *cell) for o in range(poses.ORIENTATIONS) for cell in near]


def straight_line(grid: Grid, field: Field) -> list[tuple[int, int, int]]:
    """Poses along the straight line from start to goal, heading along it."""
    x, y = field.goal_m[0] - field.start.x_m, field.goal_m[1] - field.start.y_m
    steps = math.ceil(elementary.hypot(x, y) / (grid.cell_m / 2))
    yaw = elementary.atan2(y, x)
    return [
        pose_of(grid, field.start.x_m + x * k / steps, field.start.y_m + y * k / steps, yaw) for k in range(steps + 1)
    ]
