"""The scanner of the kinematic world: every beam of a sweep at its own time and tilt, cast on the true ground.

It returns the driver's types, scans and a tilt track, so that the flight program's own `cloud` makes the points. The
deck and the wheels block beams: their returns are there, and nothing behind them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.config import Config
from onboard.perception.scan.cloud import hull_boxes
from onboard.perception.scan.sweep import LINE_S, segments
from onboard.records import F32, F64, BeamStatus, Pose, Scan, TiltTrack
from tests.missions.world.scan_errors import ScanErrors
from tests.missions.world.world import World

STEP_RAD, BEAM_NS, LINE_NS = math.radians(0.25), 25e6 / 1440, round(LINE_S * 1e9)
TRACK_NS = 10_000_000
FAR_M = 30.0  # a return from beyond the mapping range is a return


@dataclass(frozen=True)
class Scanner:
    """Beams of one sweep in base_link axes: directions (lines * beams, 3), distance to the rover's own hull (inf.

    None).

    noise_m: true 1 sigma of a range; None: as configured.
    errors: added to an ideal sweep.
    """

    config: Config
    tilt: TiltTrack
    lines: int
    beams: int
    directions: F64
    hull_m: F64
    noise_m: float | None = None
    errors: ScanErrors | None = None

    def sweep(self, world: World, pose: Pose, rng: np.random.Generator) -> tuple[Scan, ...]:
        """Return the scans of a stop, taken from the true pose, with range noise."""
        T_map_base = pose.matrix()
        rover = self.config.rover
        origin = T_map_base[:3, :3] @ (rover.lidar_x_m, 0.0, rover.lidar_z_m) + T_map_base[:3, 3]
        ways = self.directions @ T_map_base[:3, :3].T
        found = world.rays.cast(origin, ways, FAR_M)
        found[world.is_dark(origin[:2] + np.minimum(found, FAR_M)[:, None] * ways[:, :2])] = np.inf
        found = np.minimum(found, self.hull_m)
        noise_m = self.config.lidar.range_noise_m if self.noise_m is None else self.noise_m
        found += rng.normal(0.0, noise_m, len(found))
        hit = np.isfinite(found) & (found <= FAR_M)
        ranges_m: F32 = np.where(hit, found, np.nan).astype(np.float32).reshape(self.lines, self.beams)
        status = np.where(hit, BeamStatus.OK, BeamStatus.NO_RETURN).astype(np.uint8).reshape(ranges_m.shape)
        first_rad = -(self.beams - 1) / 2 * STEP_RAD
        scans = tuple(
            Scan(k * LINE_NS, BEAM_NS, first_rad, STEP_RAD, ranges_m[k], status[k]) for k in range(self.lines)
        )
        return self.errors.apply(scans, rng) if self.errors else scans


def scanner(config: Config) -> Scanner:
    """Return the scanner of a configuration: its sweep profile and sector."""
    pieces = segments(config.scanning, config.rover.lidar_z_m)
    ends_ns = np.cumsum([0] + [piece.duration_ns for piece in pieces])
    angles = np.array([pieces[0].start_rad] + [piece.end_rad for piece in pieces])
    times_ns = np.arange(0, ends_ns[-1] + TRACK_NS, TRACK_NS)
    tilt = TiltTrack(times_ns, np.interp(times_ns, ends_ns, angles))
    lines = int(ends_ns[-1] // LINE_NS)
    beams = 2 * int(config.scanning.sector_rad / STEP_RAD) + 1
    phi = (np.arange(beams) - (beams - 1) / 2) * STEP_RAD
    at_ns = np.arange(lines)[:, None] * LINE_NS + np.arange(beams) * BEAM_NS
    down = np.interp(at_ns, times_ns, tilt.angles_rad)
    ahead = np.cos(phi)
    directions = np.stack([ahead * np.cos(down), np.broadcast_to(np.sin(phi), down.shape), -ahead * np.sin(down)], -1)
    directions = np.ascontiguousarray(directions.reshape(-1, 3))
    return Scanner(config, tilt, lines, beams, directions, hull_way_m(config, directions))


def hull_way_m(config: Config, directions: F64) -> F64:
    """Return the distance of each beam to the nearest box of the rover's own hull; inf if it meets none (slab test)."""
    rover = config.rover
    origin = np.array([rover.lidar_x_m, 0.0, rover.lidar_z_m])
    nearest = np.full(len(directions), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for low, high in hull_boxes(rover, 0.0):
            a, b = (low - origin) / directions, (high - origin) / directions
            enter, leave = np.fmin(a, b).max(axis=1), np.fmax(a, b).min(axis=1)
            met = (leave >= enter) & (leave > 0.0)
            nearest = np.where(met, np.minimum(nearest, np.maximum(enter, 0.0)), nearest)
    return nearest
