"""One mission in the kinematic world: the flight program's map, poses and rule, without its clock and devices.

    scan (true beams, range noise) -> cloud -> map at the estimated pose -> plan -> drive -> turn -> scan ...

The estimate has an error drawn at each stop (that of a registration), and on the way a drift (that of the odometry). A
path is planned in the estimate's frame and driven in the true one. Contacts are checked at every station of the path
and on turns; tyres on rocks in small steps between them as well, so at headings between the planner's orientations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from onboard.config import Rover
from onboard.perception.map import ldem
from onboard.perception.map.cell_classes import classify
from onboard.perception.map.stop_map import NO_POINTS, StopMap, look, remember
from onboard.planning.cycle import plan
from onboard.planning.fences import Fence
from onboard.planning.guard.wheel_footprint import lattice
from onboard.planning.mission_rule import MissionState
from onboard.planning.plan_records import PlanningSettings, PlanRequest, PlanResult
from onboard.records import F64, Bool, CellClass, Decision, Gdem, Grid, Pose
from protocol.conventions import wrap_rad
from tests.missions.world.drift import NO_DRIFT, Drift
from tests.missions.world.scanner import Scanner
from tests.missions.world.touch import between, touches
from tests.missions.world.world import HARD, SOFT, World, wheels

TRAIL_POSES = 400
TURN_STEP_RAD = math.radians(10)


@dataclass(frozen=True)
class Errors:
    """1 sigma of the estimate at a stop: each of x and y, and heading."""

    place_m: float = 0.0
    heading_rad: float = 0.0


@dataclass(frozen=True)
class Stop:
    """One sensing stop: the rover's true pose, and the decision there."""

    pose: Pose
    result: PlanResult
    driven: F64  # (k, 3) true stations of the way from here


@dataclass
class Flight:
    """Result of a mission.

    kind: 'arrived', 'unreachable' or 'endless' (ended by the stop limit alone).
    miss_m: true distance from the goal at the end.
    hard, soft: poses in contact.
    contacts: (k, 3) x, y, severity.
    unseen: wheels on cells of the map that were neither seen nor assumed at the start.
    on_rocks: each rock over the plant's limit with the wheel that touched it.
    """

    kind: str = ""
    reason: str = ""
    stops: list[Stop] = field(default_factory=list)
    scans: int = 0
    way_m: float = 0.0
    miss_m: float = math.inf
    contacts: list[tuple[float, float, int]] = field(default_factory=list)
    unseen: int = 0
    memory: StopMap | None = None
    on_rocks: set[tuple[int, int]] = field(default_factory=set)

    @property
    def hard(self) -> int:
        """Poses in hard contact."""
        return sum(severity == HARD for _, _, severity in self.contacts)

    @property
    def soft(self) -> int:
        """Poses in soft contact."""
        return sum(severity == SOFT for _, _, severity in self.contacts)


class Kinematic:
    """State of one mission; `fly` runs it to its end."""

    def __init__(
        self,
        world: World,
        scanner: Scanner,
        errors: Errors,
        seed: int,
        gdem: Gdem | None = None,
        drift: Drift = NO_DRIFT,
    ) -> None:
        self.drift = drift
        self.world, self.scanner, self.config, self.errors, self.gdem = world, scanner, scanner.config, errors, gdem
        self.rng = np.random.default_rng([seed, 77])
        self.flight = Flight()
        self.true = self._stand(world.start.x_m, world.start.y_m, world.start.yaw_rad)
        self.estimate = self.felt = self.true
        self.rule = MissionState()
        self.fences: tuple[Fence, ...] = ()
        self.trail: list[tuple[float, float, float]] = []

    def fly(self) -> Flight:
        """Fly the whole mission."""
        self._scan()
        self._turn(wrap_rad(self.estimate.yaw_rad + math.pi))
        self._scan()
        while not self._decided():
            self._err()
            self._scan()
        self.flight.miss_m = math.dist((self.true.x_m, self.true.y_m), self.world.goal_m)
        return self.flight

    def _decided(self) -> bool:
        """Plan and drive; returns whether the mission has ended."""
        result = self._plan()
        decision = result.decision
        self.rule, self.gdem = result.state, result.gdem
        self.flight.stops.append(Stop(self.true, result, np.empty((0, 3))))
        if decision.kind in ("arrived", "unreachable"):
            stopped = decision.kind == "unreachable" and self.rule.number > self.config.mission.stop_limit
            self._end("endless" if stopped else decision.kind, decision.reason)
            return True
        if not self._drive(decision):
            return False
        if decision.kind == "goal" and self._at_goal():
            self._end("arrived", "at the goal")
            return True
        self._turn(decision.heading_rad)
        return False

    def _end(self, kind: str, reason: str) -> None:
        self.flight.kind, self.flight.reason = kind, reason

    def _at_goal(self) -> bool:
        here = (self.estimate.x_m, self.estimate.y_m)
        return math.dist(here, self.world.goal_m) <= self.config.mission.goal_tolerance_m

    def _scan(self) -> None:
        scans = self.scanner.sweep(self.world, self.true, self.rng)
        T_map_base = self.estimate.matrix()
        seen = look(scans, self.scanner.tilt, T_map_base, None, self.config)
        stop = len(self.flight.stops)
        kept = remember(self.flight.memory, seen.cloud_base, T_map_base, stop, self.config, seen.dark_base_m)
        self.flight.memory = replace(kept, target_points=NO_POINTS)  # nothing is registered here
        self.flight.scans += 1

    def _plan(self) -> PlanResult:
        assert self.flight.memory
        config, pose = self.config, self.estimate
        request = PlanRequest(
            ldem=ldem.window(self.flight.memory.cells, pose.x_m, pose.y_m, config.mapping.size_m),
            pose=pose,
            goal_m=self.world.goal_m,
            gdem=self.gdem,
            state=self.rule,
            settings=PlanningSettings(
                config.rover, config.mapping, config.planning, config.mission, config.scanning, config.drive_guard
            ),
            trail=self._driven(),
            blocked_m=self.flight.memory.blocked_m,
            unseen_m=self.flight.memory.unseen_m,
            fences=self.fences,
        )
        return plan(request)

    def _driven(self) -> F64:
        return np.array(self.trail[-TRAIL_POSES:]).reshape(-1, 3)

    def _drive(self, decision: Decision) -> bool:
        """Drive along the path, station by station, in the true frame; returns whether it was completed."""
        stations = decision.path.stations
        true = self._in_truth(stations) + self._drifted(stations)
        self.trail += [tuple(station) for station in stations]  # type: ignore[misc]
        self.flight.stops[-1] = replace(self.flight.stops[-1], driven=true)
        self.flight.way_m += decision.path.length_m
        for x, y, yaw in true:
            self._feel(self._stand(x, y, yaw))
        self._look_under(stations)
        self.true = self._stand(*true[-1])
        self.estimate = self._believed(*stations[-1])
        return True

    def _drifted(self, stations: F64) -> F64:
        """Return (k, 3) true offsets x, y, yaw from the estimated path: the odometry error."""
        if self.drift == NO_DRIFT:
            return np.zeros((len(stations), 3))
        way_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(stations[:, :2], axis=0).T))])
        errors = self.drift.draw(way_m, self.config.motion.cruise_mps, self.rng)[:, [0, 1, 5]]
        return np.asarray(errors - errors[0])  # it starts where the last stop ended

    def _look_under(self, stations: F64) -> None:
        """Count wheels at estimated stations (k, 3) on unknown cells, except in the lattice pose of the start.

        There an error of the pose may have shifted the map under a wheel.
        """
        assert self.flight.memory
        surface = classify(self.flight.memory.cells, self.config.mapping)
        known = surface.cell_class >= CellClass.HIT
        cells = lattice(stations, surface.grid)
        left = stations[(cells != cells[0]).any(axis=1)]
        self.flight.unseen += sum(unseen(station, known, surface.grid, self.config.rover) for station in left)

    def _turn(self, yaw_rad: float) -> None:
        """Turn on the spot to a heading of the estimate."""
        turn = wrap_rad(yaw_rad - self.estimate.yaw_rad)
        for k in range(1, math.ceil(abs(turn) / TURN_STEP_RAD) + 1):
            part = self.true.yaw_rad + turn * k / math.ceil(abs(turn) / TURN_STEP_RAD)
            self._feel(self._stand(self.true.x_m, self.true.y_m, part))
        self.true = self._stand(self.true.x_m, self.true.y_m, wrap_rad(self.true.yaw_rad + turn))
        self.estimate = self._believed(self.estimate.x_m, self.estimate.y_m, yaw_rad)
        self.trail.append((self.estimate.x_m, self.estimate.y_m, self.estimate.yaw_rad))

    def _err(self) -> None:
        """Draw a new error of the estimate, as after the registration of a new stop."""
        dx, dy = self.rng.normal(0.0, self.errors.place_m, 2) if self.errors.place_m else (0.0, 0.0)
        turn = float(self.rng.normal(0.0, self.errors.heading_rad)) if self.errors.heading_rad else 0.0
        self.estimate = self._believed(self.true.x_m + dx, self.true.y_m + dy, wrap_rad(self.true.yaw_rad + turn))

    def _in_truth(self, stations: F64) -> F64:
        """Transform stations (k, 3) from the estimate's frame to the true one, by the error of this stop."""
        turn = self.true.yaw_rad - self.estimate.yaw_rad
        c, s = math.cos(turn), math.sin(turn)
        x, y = stations[:, 0] - self.estimate.x_m, stations[:, 1] - self.estimate.y_m
        return np.column_stack([self.true.x_m + c * x - s * y, self.true.y_m + s * x + c * y, stations[:, 2] + turn])

    def _believed(self, x_m: float, y_m: float, yaw_rad: float) -> Pose:
        """Return the estimate of a true pose; height and attitude are the true ones (IMU)."""
        return replace(self.true, x_m=float(x_m), y_m=float(y_m), yaw_rad=float(yaw_rad))

    def _stand(self, x_m: float, y_m: float, yaw_rad: float) -> Pose:
        return self.world.stand(float(x_m), float(y_m), float(yaw_rad), self.config.rover)

    def _feel(self, pose: Pose) -> None:
        """Check contacts at a true pose, and tyres on rocks on the way from the last one."""
        severity = self.world.contact(pose, self.config.rover)
        if severity:
            self.flight.contacts.append((pose.x_m, pose.y_m, severity))
        for x_m, y_m, yaw_rad, on_spot in between(self.felt, pose) if self.world.rocks else ():
            there = Pose(x_m, y_m, yaw_rad=yaw_rad)
            self.flight.on_rocks.update(touches(self.world, there, self.config.rover, on_spot))
        self.felt = pose


def unseen(station: F64, known: Bool, grid: Grid, rover: Rover) -> int:
    """Return the number of wheels at a station x, y, yaw on cells that are not `known` (rows, columns)."""
    x, y, yaw = (float(part) for part in station)
    return sum(not known[grid.cell(*at)] for at in wheels(Pose(x, y, yaw_rad=yaw), rover))
