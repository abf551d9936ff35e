"""The sweep of the kinematic scanner, by the default profile."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard.config import load
from onboard.perception.scan.cloud import cloud
from tests.missions.world.scanner import scanner
from tests.missions.world.small import world

CONFIG = load(None, {"scanning.range_m": 10.5})


@pytest.fixture(scope="module")
def full():
    return scanner(CONFIG)


def test_the_sweep_takes_eleven_and_a_half_seconds(full):
    assert full.tilt.times_ns[-1] / 1e9 == pytest.approx(11.5, rel=0.05)


def seen_from(made, pose, ground, noise_m, seed=1):
    config = replace(made.config, lidar=replace(made.config.lidar, range_noise_m=noise_m))
    scans = replace(made, config=config).sweep(ground, pose, np.random.default_rng(seed))
    found = cloud(scans, made.tilt, pose.matrix(), config.rover, config.scanning, noise_m)
    return found.origin_m, found.ends_m[found.hit].astype(np.float64)


def test_every_hit_on_flat_ground_lies_on_it_within_the_noise(full):
    flat = world(half_m=12.0)
    origin, hits = seen_from(full, flat.stand(-2.0, 0.0, 0.3, CONFIG.rover), flat, 0.02)
    assert len(hits) > 50_000
    falling = CONFIG.rover.lidar_z_m / np.linalg.norm(hits - origin, axis=1)
    assert np.abs(hits[:, 2].mean()) < 1e-3
    assert np.std(hits[:, 2] / falling) == pytest.approx(0.02, rel=0.05)
    assert np.abs(hits[:, 2] / falling).max() < 0.12  # six sigma


def test_the_sweep_hits_nine_of_ten_visible_cells_at_8_to_10_m(full):
    """Visible: a ray from the scanner to the cell's centre meets nothing before it."""
    rng = np.random.default_rng(4)
    bumps = rng.uniform(-11.0, 11.0, (60, 2))
    rolling = world(
        half_m=12.0,
        height_m=lambda x, y: (
            0.1 * np.sin(x / 1.7) * np.cos(y / 2.3)
            + sum(0.25 * np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.1) for a, b in bumps)
        ),
    )
    pose = rolling.stand(0.0, 0.0, 0.0, CONFIG.rover)
    origin, points = seen_from(full, pose, rolling, 0.0)
    hit = {(j, i) for j, i in np.floor(points[:, 1::-1] / 0.1).astype(int)}
    centres = (np.stack(np.meshgrid(np.arange(-110, 110), np.arange(-110, 110)), -1).reshape(-1, 2) + 0.5) * 0.1
    away = np.hypot(*(centres - origin[:2]).T)
    bearing = np.arctan2(*(centres - origin[:2]).T[::-1])
    centres = centres[(away > 8.0) & (away < 10.0) & (np.abs(bearing) < math.radians(60))]
    target = np.column_stack([centres, rolling.height_m(*centres.T)])
    way = np.linalg.norm(target - origin, axis=1)
    met = rolling.rays.cast(origin, (target - origin) / way[:, None], 20.0)
    visible = centres[np.abs(met - way) < 0.05]
    assert 500 < len(visible) < 0.95 * len(centres)
    found = [(j, i) in hit for j, i in np.floor(visible[:, ::-1] / 0.1).astype(int)]
    assert np.mean(found) >= 0.9
