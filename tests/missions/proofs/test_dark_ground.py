"""Tests of ground that loses beams by grazing incidence: it is not dark, and costs the map unseen cells."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hil.devices.lidar.errors import LidarErrors
from hil.devices.lidar.light import Light
from hil.terrain.field import Field
from hil.terrain.recipe import Course, Recipe, compose
from hil.world.surfaces import Surfaces
from onboard.config import Config
from onboard.planning.local.poses import Freedom, pose_freedom
from onboard.records import BeamStatus, Pose, Scan
from tests.missions.proofs.map_proof import map_of, surface_around
from tests.missions.world.scan_errors import DEFAULT
from tests.missions.world.scanner import Scanner, scanner
from tests.missions.world.world import of_field

MADE = scanner(Config())
GRAZING = LidarErrors(grazing_rad=math.radians(5.0))


def grazed(field: Field, pose: Pose, scans: tuple[Scan, ...], made: Scanner, rng: np.random.Generator) -> np.ndarray:
    """Return the mask (lines, beams) of a sweep's beams that the bench's scanner would lose by grazing incidence."""
    T, rover = pose.matrix(), made.config.rover
    origin = T[:3, :3] @ (rover.lidar_x_m, 0.0, rover.lidar_z_m) + T[:3, 3]
    ways = made.directions @ T[:3, :3].T
    ranges_m = np.where(np.isfinite(made.hull_m), np.inf, np.stack([scan.ranges_m for scan in scans]).ravel())
    ranges_m = np.where(np.isnan(ranges_m), np.inf, ranges_m).astype(np.float64)
    surface = Surfaces(field, GRAZING, field.seed).met(np.broadcast_to(origin, ways.shape), ways, ranges_m)
    lost = Light(GRAZING.applied(), rng).lost(ranges_m, surface)
    return (lost & np.isfinite(ranges_m)).reshape(len(scans), -1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_grazing_loss_on_rough_ground_takes_no_pose_though_it_takes_beams(seed):
    rng = np.random.default_rng([seed, 97])
    field = compose(Recipe(0.8, median_slope_deg=6.0), Course(away_m=9.0), rng, seed)
    world, config = of_field(field, "rough"), MADE.config
    pose = world.stand(world.start.x_m, world.start.y_m, world.start.yaw_rad, config.rover)
    scans = MADE.sweep(world, pose, rng)
    gone = grazed(field, pose, scans, MADE, rng)
    ranges_m = np.stack([scan.ranges_m for scan in scans])
    assert gone[(ranges_m > 4.0) & (ranges_m < 8.0)].mean() > 0.03
    scans = DEFAULT.apply(
        [
            replace(
                scan,
                ranges_m=np.where(row, np.nan, scan.ranges_m).astype(np.float32),
                status=np.where(row, BeamStatus.NO_RETURN, scan.status).astype(np.uint8),
            )
            for scan, row in zip(scans, gone)
        ],
        rng,
    )
    memory = map_of(MADE, [(pose, scans)])
    free = [
        (pose_freedom(surface_around(of, pose, 20.0, config), config.rover, config.planning) == Freedom.FREE).sum()
        for of in (memory, replace(memory, unseen_m=()))
    ]
    assert free[0] >= 0.98 * free[1] > 5000
