"""Accuracy of localisation: error at the end of 20 m, and consistency of the covariance at every stop.

Keep-outs lie along the edges of each field. Seeds 1 to 10 are the demo's fields; 21 to 24 slopes of 20 degrees with
rocks, up, across and down; 31 to 34 the demo's fields with a band of soft soil, 1.5 m deep, across the way. The
rover drives to the goal 15 m away, then 5 m back towards the start. Errors are against the truth in the map's
frame, whose origin and heading are the pose at the first order; the filter gets no other truth. NEES is e^T P^-1 e
over x, y, z, yaw, before and after the registration of each stop but the first; over n stops of a consistent filter
the sum is chi-square with 4 n degrees of freedom.
Noise figures are fitted on seeds from 101 on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol

import numpy as np
from scipy.stats import chi2

from hil.campaign.mission import LIMIT_S, edges
from hil.records import PlantState
from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory, goto
from hil.scenarios.model import Scenario
from hil.terrain.field import Field
from hil.terrain.fields import draw_course
from hil.terrain.grounds import GROUNDS
from hil.terrain.recipe import Recipe, compose
from hil.terrain.rock_sizes import PowerLaw
from hil.world.operator import TimedCommand
from hil.world.world import rotate
from onboard.core.rover import Rover
from onboard.motion.kinematics import wheel_places
from onboard.perception.pose.localisation import Localisation
from onboard.records import F64, Inputs, Outputs, Pose
from pictures.estimate import Trace
from protocol.conventions import wrap_rad
from protocol.link.transactions import RequestState
from protocol.tables.modes import Phase

SEEDS = (*range(1, 11), *range(21, 25), *range(31, 35))
SHORT = (1, 31)
SLOPE_DEG, SLOPE_ROCKS, BAND_M = 20.0, 0.02, (5.0, 6.5)
# A rover sent onto such slopes must be allowed them. Two cells of 0.1 m fall by 0.07 m there, and the step rule is
# between the lowest and the highest hit of two cells: 0.07 m of a stone, as on the level, are 0.14 m.
SLOPE_SETTINGS = {
    "planning.tilt_limit_rad": math.radians(27), "planning.slope_limit_rad": math.radians(27), "planning.step_m": 0.14,
}  # fmt: skip
BACK_M = 5.0
MEAN_PERCENT, ROUGH_PERCENT, WORST_M, HEADING_DEG = 0.5, 1.0, 0.1, 0.5
BAND, LEAST_STOPS = 0.95, 50
SAMPLE_TICKS = 50


@dataclass(frozen=True, slots=True)
class Row:
    """One flight, with its errors at the end. Odometry is a filter of the same sensors without registration."""

    seed: int
    ground: str
    outcome: str
    way_m: float
    scans: int
    error_m: float
    error_percent: float
    heading_deg: float
    odometry_m: float
    odometry_deg: float
    nees_before: tuple[float, ...]
    nees_after: tuple[float, ...]


class Stop(NamedTuple):
    """Filter against the truth at a stop: error (4,) of x, y, z, yaw, covariance (4, 4)."""

    error: F64
    covariance: F64

    @property
    def nees(self) -> float:
        """e^T P^-1 e; chi-square with 4 degrees of freedom for a consistent covariance."""
        return float(self.error @ np.linalg.solve(self.covariance, self.error))


class Recorder(Protocol):
    """Recorder of a flight (tests/scenarios/pose/tapes.py)."""

    def attach(self, bench: InMemory) -> None:
        """Attach to a bench before its first step."""

    def see(self, outputs: Outputs, true: Pose | None) -> None:
        """Record a tick. true: pose in the map's frame, None before there is a map."""


@dataclass(slots=True)
class Watch:
    """Observer of both filters against the truth at each tick, and of the stops."""

    alone: Localisation
    recorder: Recorder | None = None
    way_m: float = 0.0
    before: list[Stop] = field(default_factory=list)
    after: list[Stop] = field(default_factory=list)
    error: F64 = field(default_factory=lambda: np.zeros(4))
    drift: F64 = field(default_factory=lambda: np.zeros(4))
    samples: list[tuple[float, F64, F64, F64]] = field(default_factory=list)
    stops_m: list[float] = field(default_factory=list)
    _origin: Pose | None = None
    _start: Pose | None = None
    _last: F64 | None = None
    _phase: Phase = Phase.NONE

    def __call__(self, tick: int, inputs: Inputs, outputs: Outputs, rover: Rover, state: PlantState) -> None:
        self.alone.update(rover.nodes.wheels, rover.nodes.imu[-1] if rover.nodes.imu else None, inputs.now_ns)
        if self._last is not None:
            self.way_m += math.dist(state.position_m[:2], self._last[:2])
        self._last = state.position_m
        phase, was, self._phase = rover.executive.phase, self._phase, rover.executive.phase
        if self._origin is None and phase is not Phase.NONE:
            self._origin, self._start = rover.localisation.pose, _pose(state)
        true = self._in_map(_pose(state)) if self._origin else None
        if self.recorder:
            self.recorder.see(outputs, true)
        if true is None or phase is Phase.NONE:
            return
        self.error, self.drift = _off(rover.localisation.pose, true), _off(self.alone.pose, true)
        if tick % SAMPLE_TICKS == 0:
            sigma = np.sqrt(rover.localisation.estimate.covariance.diagonal())
            self.samples.append((self.way_m, self.error, sigma, self.drift))
        if phase is Phase.MAPPING and was is Phase.SCANNING:
            self.before.append(Stop(self.error, rover.localisation.estimate.covariance))
        for event in outputs.events:
            if event.name == "REGISTERED":
                self.after.append(Stop(self.error, rover.localisation.estimate.covariance))
                self.stops_m.append(self.way_m)
            elif event.name == "REGISTRATION_REFUSED":
                self.before.pop()  # mostly the look behind at the start: there is nothing to register to

    @property
    def trace(self) -> Trace:
        """Return the flight's trace for a picture."""
        way, error, sigma, drift = (np.array(column) for column in zip(*self.samples))
        return Trace(way, error, sigma, drift, np.array(self.stops_m))

    def _in_map(self, true: Pose) -> Pose:
        """Transform a true pose to the map frame, whose origin is the reported pose at the first order."""
        assert self._origin and self._start
        turn = self._origin.yaw_rad - self._start.yaw_rad
        dx, dy = true.x_m - self._start.x_m, true.y_m - self._start.y_m
        return replace(
            true,
            x_m=self._origin.x_m + math.cos(turn) * dx - math.sin(turn) * dy,
            y_m=self._origin.y_m + math.sin(turn) * dx + math.cos(turn) * dy,
            z_m=true.z_m - self._start.z_m + self._origin.z_m,
            yaw_rad=true.yaw_rad + turn,
        )


def fly(seed: int) -> Row:
    """Return the row of the seed's flight."""
    return flown(seed)[0]


def flown(seed: int, recorder: Recorder | None = None) -> tuple[Row, Watch]:
    """Fly to the goal of the seed's ground and 5 m back; returns the row and the observer."""
    name, ground = ground_of(seed)
    settings = SLOPE_SETTINGS if name == "slope" else {}
    bench = InMemory(
        Scenario(name="localisation", seed=seed, limit_s=LIMIT_S, set=settings),
        (*edges(ground), *goto(ground)),
        ground=ground,
        step_ns=CAMPAIGN_STEP_NS,
    )
    config = bench.rover.config
    watch = Watch(Localisation(config.rover, config.localisation), recorder)
    if recorder:
        recorder.attach(bench)
    patch = Patch(bench) if name == "soft" else None
    _until_done(bench, watch, patch)
    if bench.operator.requests[-1].state is RequestState.COMPLETED:
        back = 1.0 - BACK_M / math.hypot(*ground.goal_m)
        x_m, y_m = (round(back * v, 3) for v in ground.goal_m)
        bench.operator.ask(TimedCommand(0.0, "goto", {"x_m": x_m, "y_m": y_m}))
        _until_done(bench, watch, patch)
    bench.free()
    error_m = float(np.linalg.norm(watch.error[:3]))
    row = Row(
        seed,
        name,
        bench.operator.requests[-1].report.text,
        round(watch.way_m, 2),
        bench.progress.sweeps,
        round(error_m, 4),
        round(100 * error_m / watch.way_m, 3),
        round(abs(math.degrees(watch.error[3])), 3),
        round(float(np.linalg.norm(watch.drift[:3])), 3),
        round(abs(math.degrees(watch.drift[3])), 2),
        tuple(round(stop.nees, 2) for stop in watch.before[1:]),
        tuple(round(stop.nees, 2) for stop in watch.after),
    )
    return row, watch


def _until_done(bench: InMemory, watch: Watch, patch: Patch | None) -> None:
    while not bench.ended:
        if patch:
            patch.step()
        bench.step(watch)


def judge(rows: Sequence[Row]) -> list[str]:
    """Check the means of level and rough flights, the largest error, and both NEES if there are enough stops."""
    short = [f"seed {row.seed}: {row.outcome}" for row in rows if "from the goal" not in row.outcome]
    for names, limit in ((("level",), MEAN_PERCENT), (("slope", "soft"), ROUGH_PERCENT)):
        some = [row for row in rows if row.ground in names]
        if not some:
            continue
        mean = sum(row.error_percent for row in some) / len(some)
        heading = sum(row.heading_deg for row in some) / len(some)
        if mean > limit:
            short.append(f"{', '.join(names)}: mean error {mean:.2f} % of the way, {limit} promised")
        if heading > HEADING_DEG:
            short.append(f"{', '.join(names)}: mean heading error {heading:.2f} deg, {HEADING_DEG} promised")
    short += [
        f"seed {row.seed}: {row.error_m} m at the end, {WORST_M} promised"
        for row in rows
        if row.ground == "level" and row.error_m > WORST_M
    ]
    for when in ("before", "after"):
        values = [value for row in rows for value in getattr(row, f"nees_{when}")]
        low, high = chi2.interval(BAND, 4 * len(values)) if len(values) >= LEAST_STOPS else (0.0, math.inf)
        if not low <= sum(values) <= high:
            n = len(values)
            mean = sum(values) / n
            short.append(f"NEES {when} {n} registrations: mean {mean:.2f}, band {low / n:.2f} to {high / n:.2f}")
    return short


def ground_of(seed: int) -> tuple[str, Field]:
    """Return kind and field of a seed."""
    hundreds, rest = divmod(seed, 100)
    if 20 < rest < 30:
        return "slope", slope(seed)
    soft = 30 < rest < 40
    return "soft" if soft else "level", GROUNDS["fbm"](100 * hundreds + rest - 30 if soft else seed).field


def slope(seed: int) -> Field:
    """Return gentle waves and rocks on a plane of 20 degrees: up, across, down and across from start to goal, by seed.

    Without rocks nothing on a plane fixes x, y or yaw: scans there add nothing to odometry.
    """
    rng = np.random.default_rng([seed, 77])
    course = draw_course(rng)
    rise = course.bearing_rad + (seed - 21) * math.pi / 2
    ahead, left = (math.tan(math.radians(SLOPE_DEG)) * v for v in (math.cos(rise), math.sin(rise)))
    recipe = Recipe(
        0.85, median_slope_deg=2.0, rocks=PowerLaw(SLOPE_ROCKS), relief=lambda x_m, y_m: ahead * x_m + left * y_m
    )
    return compose(recipe, course, rng, seed)


class Patch:
    """Band of soft soil across the straight line from start to goal; each wheel is on it or off it."""

    def __init__(self, bench: InMemory) -> None:
        self._bench, self._soft = bench, [False] * 4
        start, goal = bench.field.start, bench.field.goal_m
        along = np.array([goal[0] - start.x_m, goal[1] - start.y_m])
        self._along = along / np.linalg.norm(along)
        self._from = np.array([start.x_m, start.y_m])
        self._wheels = np.array([(*place, 0.0) for place in wheel_places(bench.rover.config.rover)])

    def step(self) -> None:
        """Set the soil of each wheel before a tick."""
        state = self._bench.state
        places = state.position_m + rotate(np.tile(state.quaternion_xyzw, (4, 1)), self._wheels)
        for k, way_m in enumerate((places[:, :2] - self._from) @ self._along):
            soft = bool(BAND_M[0] <= way_m <= BAND_M[1])
            if soft != self._soft[k]:
                self._soft[k] = soft
                self._bench.plant.set_soil(k + 1, "soft" if soft else "nominal")


def _pose(state: PlantState) -> Pose:
    x, y, z, w = state.quaternion_xyzw.tolist()
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(2 * (w * y - z * x))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return Pose(*state.position_m.tolist(), roll, pitch, yaw)


def _off(pose: Pose, true: Pose) -> F64:
    """Return (4,): x, y, z, yaw of a pose minus the true one."""
    off = (pose.x_m - true.x_m, pose.y_m - true.y_m, pose.z_m - true.z_m)
    return np.array([*off, wrap_rad(pose.yaw_rad - true.yaw_rad)])
