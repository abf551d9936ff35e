"""Mission with the drive guard: lines of the fixed scanner while driving, and an estimate that drifts during the drive.

The rover follows its estimate, so the drift moves its true path; errors of height and attitude enter the lines only. A
line is cast every 22 mm of path (every other one of the scanner's, for speed) and every 1.5 degrees of a turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from hil.campaign.mission import strips
from onboard.config import Config, Rover
from onboard.perception.map import ldem
from onboard.planning.fences import KEEP_OUT, Fence
from onboard.planning.guard import guarded_leg
from onboard.planning.guard.drive_guard import Bad
from onboard.planning.mission_rule import interrupted
from onboard.planning.plan_records import GuardLine, PlanResult
from onboard.records import F64, BeamStatus, CellClass, Cloud, Decision, Pose, Scan, Surface
from protocol.conventions import wrap_rad
from tests.missions.mission import Errors, Flight, Kinematic, unseen
from tests.missions.world.drift import FLOWN_DRIFT, Drift
from tests.missions.world.scan_errors import ScanErrors
from tests.missions.world.scanner import BEAM_NS, FAR_M, STEP_RAD, Scanner, hull_way_m
from tests.missions.world.world import World, wheels

LINE_M, LINE_RAD = 0.022, math.radians(1.5)
FEEL_M, FEEL_RAD = 0.05, math.radians(11.25)  # contacts and tracks are checked this often
STOPPING_M, BACK_OFF_M = 0.10, 0.30
PATCH_M, PATCH_DEPTH_M = 0.10, 0.08  # a wheel over such a patch of a hole is in it


@dataclass(frozen=True)
class LineScanner:
    """The scanner fixed at the guard's tilt: directions (beams, 3) in base axes, distance to the rover's own hull."""

    config: Config
    directions: F64
    hull_m: F64
    errors: ScanErrors | None = None

    def line(self, world: World, true: Pose, believed: Pose, rng: np.random.Generator) -> Cloud:
        """Cast one line from the true pose and enter it at the estimated pose, by the flight program's own rules."""
        config, rover = self.config, self.config.rover
        T_true = true.matrix()
        origin = T_true[:3, :3] @ (rover.lidar_x_m, 0.0, rover.lidar_z_m) + T_true[:3, 3]
        found = np.minimum(world.rays.cast(origin, self.directions @ T_true[:3, :3].T, FAR_M), self.hull_m)
        found += rng.normal(0.0, config.lidar.range_noise_m, len(found))
        hit = np.isfinite(found) & (found <= FAR_M)
        ranges_m = np.where(hit, found, np.nan).astype(np.float32)
        status = np.where(hit, BeamStatus.OK, BeamStatus.NO_RETURN).astype(np.uint8)
        scans: tuple[Scan, ...] = (Scan(0, BEAM_NS, -(len(found) - 1) / 2 * STEP_RAD, STEP_RAD, ranges_m, status),)
        if self.errors:
            scans = self.errors.apply(scans, rng)
        return guarded_leg.cloud_of(GuardLine(scans[0], config.drive_guard.tilt_rad, believed), config)


def line_scanner(config: Config) -> LineScanner:
    """Return the fixed scanner of a configuration."""
    half = int(config.scanning.sector_rad / STEP_RAD)
    phi, down = np.arange(-half, half + 1) * STEP_RAD, config.drive_guard.tilt_rad
    directions = np.stack([np.cos(phi) * math.cos(down), np.sin(phi), -np.cos(phi) * math.sin(down)], axis=1)
    return LineScanner(config, directions, hull_way_m(config, directions))


@dataclass(frozen=True)
class GuardStop:
    """Stop of the guard with the cells that caused it. real: True if the true ground has a step or hole there."""

    pose: Pose
    bad: tuple[Bad, ...]
    real: bool


@dataclass
class GuardedFlight(Flight):
    """Flight with the count in_hole: wheel poses in a hole."""

    guard_stops: list[GuardStop] = field(default_factory=list)
    in_hole: int = 0


@dataclass(frozen=True)
class Drive:
    """A path in small steps. stations: (k, 3) estimated; true: (k, 3); errors: (k, 6); way_m, feel: (k,)."""

    stations: F64
    true: F64
    errors: F64
    way_m: F64
    feel: F64


class Guarded(Kinematic):
    """A mission whose drives drift, with keep-outs along the field's edges; with `drive_guard.on` the guard is active.

    There is no ground beyond the edges: a line that crosses one has no return there, and the guard would stop.
    """

    def __init__(self, world: World, scanner: Scanner, errors: Errors, seed: int, drift: Drift = FLOWN_DRIFT) -> None:
        super().__init__(world, scanner, errors, seed, drift=drift)
        self.flight: GuardedFlight = GuardedFlight()
        self.lines = replace(line_scanner(self.config), errors=scanner.errors)
        self.settings = guarded_leg.settings_of(self.config)
        self.before = self.rule
        self.fences = tuple(Fence(name, KEEP_OUT, corners) for name, corners in strips(world.grid).items())

    def _plan(self) -> PlanResult:
        self.before = self.rule
        return super()._plan()

    def _drive(self, decision: Decision) -> bool:
        assert self.flight.memory
        pose = self.estimate
        drive = self._in_steps(decision.path.stations)
        ways = (drive.stations[drive.feel > 0], self._driven())
        leg = guarded_leg.begin(self.flight.memory, pose, ways, self.config)
        bad: tuple[Bad, ...] = ()
        k, end = -1, len(drive.stations) - 1
        while k < end:
            k += 1
            true, believed = self._at(drive, k)
            if drive.feel[k]:
                self._roll(true, drive.stations[k] if k else None, leg.watch.surface, leg.watch.strip)
                self.trail.append(tuple(float(part) for part in drive.stations[k]))  # type: ignore[arg-type]
            if self.config.drive_guard.on:
                line = self.lines.line(self.world, true, believed, self.rng)
                leg, found = guarded_leg.hear(leg, line, believed, self.settings)
                if found and not bad:
                    end = min(end, int(np.searchsorted(drive.way_m, drive.way_m[k] + STOPPING_M)))
                bad += found
        self.flight.stops[-1] = replace(self.flight.stops[-1], driven=drive.true[: k + 1])
        self.flight.way_m += float(drive.way_m[k])
        self.true, self.estimate = self._at(drive, k)
        self.flight.memory = guarded_leg.credit(self.flight.memory, leg, self.estimate, bad, self.config)
        if bad:
            self._stopped(bad)
            self.true, self.estimate = self._at(drive, self._back(drive, k))
        return not bad

    def _in_steps(self, stations: F64) -> Drive:
        """Return the path with a line at every step, and the true path under drift."""
        fine, feel = [stations[:1]], [1.0]
        since_m = since_rad = 0.0
        for a, b in pairwise(stations):
            turn, way = wrap_rad(b[2] - a[2]), math.dist(a[:2], b[:2])
            pieces = max(1, math.ceil(way / LINE_M - 1e-9), math.ceil(abs(turn) / LINE_RAD - 1e-9))
            share = np.arange(1, pieces + 1)[:, None] / pieces
            fine.append(a + share * np.array([b[0] - a[0], b[1] - a[1], turn]))
            for _ in range(pieces):
                since_m, since_rad = since_m + way / pieces, since_rad + abs(turn) / pieces
                due = since_m >= FEEL_M or since_rad >= FEEL_RAD
                feel.append(float(due))
                since_m, since_rad = (0.0, 0.0) if due else (since_m, since_rad)
        feel[-1] = 1.0
        steps = np.concatenate(fine)
        way_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(steps[:, :2], axis=0).T))])
        errors = self.drift.draw(way_m, self.config.motion.cruise_mps, self.rng)
        errors[:, [0, 1, 5]] -= errors[0, [0, 1, 5]]  # it starts where the last stop ended
        true = self._in_truth(steps) + errors[:, [0, 1, 5]]
        return Drive(steps, true, errors, way_m, np.array(feel))

    def _at(self, drive: Drive, k: int) -> tuple[Pose, Pose]:
        """Return the true and the estimated pose at a step."""
        true = self._stand(*drive.true[k])
        x, y, yaw = (float(part) for part in drive.stations[k])
        dz, droll, dpitch = (float(part) for part in drive.errors[k, 2:5])
        return true, Pose(x, y, true.z_m + dz, true.roll_rad + droll, true.pitch_rad + dpitch, wrap_rad(yaw))

    def _roll(self, true: Pose, station: F64 | None, surface: Surface, strip: ldem.Ldem) -> None:
        """Check a step for contact, a hole, and unseen ground. station: None where the rover stands."""
        self._feel(true)
        self.flight.in_hole += in_hole(self.world, true, self.config.rover)
        if station is not None:
            known = (surface.cell_class >= CellClass.HIT) | (strip.n > 0)
            self.flight.unseen += unseen(station, known, surface.grid, self.config.rover)

    def _stopped(self, bad: tuple[Bad, ...]) -> None:
        """Tell the rule to count the leg as not tried."""
        real = any(really_bad(self.world, cell.x_m, cell.y_m) for cell in bad)
        self.flight.guard_stops.append(GuardStop(self.true, bad, real))
        self.rule = interrupted(self.rule, self.before)

    def _back(self, drive: Drive, k: int) -> int:
        """Drive 0.3 m back along the path; returns the step at its end."""
        last = int(np.searchsorted(drive.way_m, max(0.0, drive.way_m[k] - BACK_OFF_M)))
        for at in range(k - 1, last - 1, -1):
            if drive.feel[at]:
                self._feel(self._stand(*drive.true[at]))
        self.flight.way_m += float(drive.way_m[k] - drive.way_m[last])
        return last


def in_hole(world: World, pose: Pose, rover: Rover) -> bool:
    """Return whether a patch of 10 x 10 cm under a wheel lies in a hole of 0.08 m or more."""
    half = PATCH_M / 2
    deep = world.holes[world.holes[:, 3] >= PATCH_DEPTH_M]
    for x, y in wheels(pose, rover):
        away_x, away_y = np.abs(deep[:, 0] - x) + half, np.abs(deep[:, 1] - y) + half
        if (np.hypot(away_x, away_y) <= deep[:, 2] / 2).any():
            return True
    return False


def really_bad(world: World, x_m: float, y_m: float) -> bool:
    """Return whether the true ground has a hole within 0.3 m of a point, or a step of 0.08 m in one cell's cross."""
    edge = np.hypot(world.holes[:, 0] - x_m, world.holes[:, 1] - y_m) - world.holes[:, 2] / 2
    side = np.arange(-0.15, 0.151, 0.05)
    dx, dy = (part.ravel() for part in np.meshgrid(side, side))
    z = world.height_m(x_m + dx, y_m + dy)
    basis = np.stack([np.ones_like(dx), dx, dy], axis=1)
    flat = z - basis @ np.linalg.lstsq(basis, z, rcond=None)[0]
    return bool((edge <= 0.3).any() or np.ptp(flat) > 0.08)
