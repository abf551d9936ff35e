"""Map semantics against the true ground: two scans by the true beams, ahead and behind, then the rules."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy import ndimage

from onboard.config import Config
from onboard.perception.map.stop_map import look, remember
from onboard.planning.local import poses
from onboard.planning.local.poses import Freedom
from onboard.records import CellClass, Grid, NodeSet, Pose, Surface
from tests.missions.proofs.map_proof import surface_around
from tests.missions.world.fields import main_field, pits
from tests.missions.world.scanner import hull_way_m, scanner
from tests.missions.world.world import HARD, HARD_BELLY_M, SOFT, World, true_surface

CONFIG = Config()
SCANNER = scanner(CONFIG)
SEEDS = range(1, 9)
POSES = 10_000 // len(SEEDS)
pytestmark = [pytest.mark.campaign, pytest.mark.xdist_group("map-semantics")]  # the scans are made once


class Seen(NamedTuple):
    """A world, the map of two scans at its start, and the distance of each cell from there, (rows, columns) m."""

    world: World
    surface: Surface
    freedom: np.ndarray
    away_m: np.ndarray


def see(world: World) -> Seen:
    start, memory = world.start, None
    rng = np.random.default_rng([world.seed, 78])
    for turn in (0.0, math.pi):
        pose = world.stand(start.x_m, start.y_m, start.yaw_rad + turn, CONFIG.rover)
        scans = SCANNER.sweep(world, pose, rng)
        seen = look(scans, SCANNER.tilt, pose.matrix(), None, CONFIG)
        memory = remember(memory, seen.cloud_base, pose.matrix(), 0, CONFIG, seen.dark_base_m)
    surface = surface_around(memory, start, CONFIG.mapping.size_m, CONFIG)
    x, y = centres(surface.grid)
    away_m = np.hypot(x[None, :] - start.x_m, y[:, None] - start.y_m)
    return Seen(world, surface, poses.pose_freedom(surface, CONFIG.rover, CONFIG.planning), away_m)


def centres(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    return grid.x0_m + np.arange(grid.columns) * grid.cell_m, grid.y0_m + np.arange(grid.rows) * grid.cell_m


@pytest.fixture(scope="module")
def smooth() -> list[Seen]:
    """Fields of the campaign without holes."""
    return [see(main_field(seed)) for seed in SEEDS]


@pytest.fixture(scope="module")
def pitted() -> list[Seen]:
    """Fields with 60 holes per 400 m2."""
    return [see(pits(seed)) for seed in SEEDS]


def drawn(seen: Seen, within_m: float) -> list[Pose]:
    """Return poses that are free in the map, with the rover settled there on the true ground."""
    free = np.argwhere((seen.freedom == Freedom.FREE) & (seen.away_m <= within_m))
    x, y = centres(seen.surface.grid)
    chosen = np.random.default_rng([seen.world.seed, 79]).permutation(len(free))[:POSES]
    assert len(chosen) == POSES
    return [seen.world.stand(x[i], y[j], o * math.pi / poses.ORIENTATIONS, CONFIG.rover) for o, j, i in free[chosen]]


def scanned(surface: Surface, pose: Pose) -> np.ndarray:
    """Return cells (rows, columns) of even ground at height 0 whose four corners a scan from `pose` reaches.

    Within sector, tilts and range, 3 sigma of its noise off, and not behind the rover's own hull.
    """
    rover, scanning = CONFIG.rover, CONFIG.scanning
    x, y = centres(surface.grid)
    inside = np.ones(surface.cell_class.shape, bool)
    for dx, dy in ((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)):
        east, north = np.broadcast_arrays(*np.ix_(x + dx * surface.grid.cell_m, y + dy * surface.grid.cell_m))
        c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        ahead, left = (c * east + s * north).T - rover.lidar_x_m, (c * north - s * east).T
        way_m = np.sqrt(ahead**2 + left**2 + rover.lidar_z_m**2)
        down = np.arctan2(rover.lidar_z_m, ahead)
        inside &= np.abs(np.arcsin(left / way_m)) <= scanning.sector_rad
        inside &= (down <= scanning.start_rad) & (way_m <= scanning.range_m - 3 * CONFIG.lidar.range_noise_m)
        beams = np.stack([ahead, left, np.full_like(left, -rover.lidar_z_m)], axis=-1) / way_m[..., None]
        inside &= (hull_way_m(CONFIG, beams.reshape(-1, 3)) > way_m.ravel()).reshape(inside.shape)
    return inside


def test_flat_ground_has_no_occluded_cell_wherever_a_scan_looks() -> None:
    nodes, cell_m = 400, 0.05
    first_m = -(nodes - 1) / 2 * cell_m
    grid, flat = Grid(first_m, first_m, cell_m, nodes, nodes), np.zeros((nodes, nodes), np.float32)
    seen = see(World(grid, flat, Pose(0.0, 0.0), (5.0, 0.0), 0, "flat", np.empty((0, 4))))
    inside = scanned(seen.surface, Pose(0.0, 0.0)) | scanned(seen.surface, Pose(0.0, 0.0, yaw_rad=math.pi))
    assert inside.sum() > 14_000
    kinds, counts = np.unique(seen.surface.cell_class[inside], return_counts=True)
    assert set(kinds) <= {CellClass.HIT, CellClass.FILLED}, dict(zip(kinds, counts))
    assert not (seen.freedom == Freedom.BLOCKED).any()


def test_the_sets_are_disjoint_and_complete_and_the_free_one_is_connected_with_the_rover(
    smooth: list[Seen], pitted: list[Seen]
) -> None:
    for seen in smooth + pitted:
        start = seen.world.start
        own = poses.pose_index(seen.surface.grid, start.x_m, start.y_m, start.yaw_rad)
        freedom = poses.trail(seen.freedom, np.array([own]))
        sets = poses.node_sets(seen.surface, freedom, poses.reachable(freedom, *own))
        members = np.array([sets == one for one in NodeSet])
        assert (members.sum(axis=0) == 1).all() and members.any(axis=(1, 2)).all()
        labels, count = ndimage.label(sets == NodeSet.FREE, np.ones((3, 3)))
        assert count == 1 and labels[own[:2]] == 1


def test_20_mm_of_noise_make_at_most_3_percent_of_the_good_cells_within_3_m_obstacles(smooth: list[Seen]) -> None:
    """Good: free in all orientations on the true ground. Obstacle: no orientation free, at least one blocked."""
    assert CONFIG.lidar.range_noise_m == 0.02
    goods = obstacles = 0
    for seen in smooth:
        truth = true_surface(seen.world, CONFIG.mapping.cell_m)
        free = (poses.pose_freedom(truth, CONFIG.rover, CONFIG.planning) == Freedom.FREE).all(axis=0)
        x, y = centres(truth.grid)
        good = np.zeros_like(seen.away_m, bool)
        cells = np.array([seen.surface.grid.cell(x[i], y[j]) for j, i in np.argwhere(free)])
        on = ((cells >= 0) & (cells < good.shape)).all(axis=1)
        good[tuple(cells[on].T)] = True
        good &= (seen.away_m <= 3.0) & (seen.surface.cell_class == CellClass.HIT)
        goods += good.sum()
        closed = ~(seen.freedom == Freedom.FREE).any(axis=0) & (seen.freedom == Freedom.BLOCKED).any(axis=0)
        obstacles += (good & closed).sum()
    print(f"\n{obstacles} of {goods} good cells within 3 m became obstacles: {obstacles / goods:.2%}")
    assert goods > 5_000
    assert obstacles <= 0.03 * goods


def test_a_rover_settled_at_10000_poses_free_in_the_map_of_hole_free_fields_never_touches(smooth: list[Seen]) -> None:
    """Neither with its belly nor, over 0.12 m, with a wheel."""
    settled = [(seen.world, pose) for seen in smooth for pose in drawn(seen, math.inf)]
    belly_m = max(world.belly_m(pose, CONFIG.rover) for world, pose in settled)
    found = [world.contact(pose, CONFIG.rover) for world, pose in settled]
    print(
        f"\n{len(found)} free poses: ground up to {belly_m:.3f} m above the wheel plane, "
        f"{found.count(HARD)} hard, {found.count(SOFT)} soft contacts"
    )
    assert len(found) == 10_000
    assert belly_m <= HARD_BELLY_M
    assert found.count(HARD) == 0


def test_at_most_0_7_percent_of_the_free_poses_within_4_m_of_60_holes_are_hazardous(pitted: list[Seen]) -> None:
    """Hazardous: a hard contact of the rover settled there, by belly, tilt or a wheel's step (the study's measure).

    The study found 13 % of all poses of such fields hazardous, with Golombek rocks on 6 % of the ground; here 12 % are,
    with 5 %: the measure is much like the one that its 0.6 to 0.7 % of the free poses were counted by.
    """
    settled = [(seen.world, pose) for seen in pitted for pose in drawn(seen, 4.0)]
    hazardous = sum(world.contact(pose, CONFIG.rover) == HARD for world, pose in settled)
    print(f"\n{len(settled)} free poses within 4 m: {hazardous} hazardous, {hazardous / len(settled):.2%}")
    assert hazardous <= 0.007 * len(settled)
