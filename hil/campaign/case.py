"""Case of a campaign: the drawn values made into scenario, ground and rover, and its flight made into a row.

fly(plan, 17)                    the row of case 17, in this process; the same plan gives the same row
COLUMNS                          TABLE of the row's columns, beside the knobs
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import resource
import struct
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from hil.campaign.mission import Watch, edges, goto
from hil.campaign.plan import (
    DRAWN,
    BuildKnobs,
    GroundKnobs,
    MissionKnobs,
    OrbitKnobs,
    Plan,
    drawn,
    nested,
    table_of,
)
from hil.campaign.truth import TrueWay, true_way
from hil.faults.build_errors import BuildErrors
from hil.faults.build_errors import drawn as assembled
from hil.faults.plan import Injection
from hil.own_functions import generator
from hil.plant.plant import PlantAbortError
from hil.run.in_process import Flight, InMemory
from hil.scenarios.model import Scenario, ground_of
from hil.terrain import field_file
from hil.terrain.craters import CraterLaw
from hil.terrain.field import Field
from hil.terrain.fields import true_surface
from hil.terrain.recipe import Course, Recipe, compose
from hil.terrain.rock_sizes import Golombek, PowerLaw
from hil.world.contacts import line
from onboard.config import ConfigError
from onboard.config import Rover as Drawing
from onboard.native import elementary
from onboard.records import F64
from protocol.link.transactions import RequestState

GOAL_M = 0.3  # a rover that reports its arrival should be this near by truth
ROOT = Path(__file__).parents[2]
DEFECTS = (
    ConfigError, ValueError, ArithmeticError, LookupError, TypeError, AttributeError, RuntimeError, AssertionError,
    BufferError, EOFError, MemoryError, OSError, struct.error,
)  # fmt: skip
_SALT = {"ground": 0xCA5E, "orbit": 0x0B17}  # of the generators of a case's seed


@dataclass(frozen=True, slots=True)
class Column:
    """Column of a campaign's table.

    kind: type in DuckDB
    is_time: differs from run to run
    """

    name: str
    kind: str
    means: str
    is_time: bool = False


COLUMNS = (
    Column("case_number", "integer", "number in the plan, from 1"),
    Column("seed", "integer", "of ground, nodes and scanner"),
    Column("outcome", "varchar", "row of OUTCOMES"),
    Column("reason", "varchar", "reported by the rover, or why the bench ended the flight"),
    Column("reachable", "boolean", "by the truth planner: on a perfect map a path leads to the goal"),
    Column("optimum_m", "double", "length of that path, the cheapest by the planner's costs"),
    Column("straight_m", "double", "from start to goal"),
    Column("distance_to_goal_m", "double", "true, at the end"),
    Column("way_m", "double", "driven, by truth"),
    Column("way_ratio", "double", "way over optimum; only of arrivals"),
    Column("scans", "integer", "sweeps"),
    Column("bench_s", "double", "time of the bench"),
    Column("s_per_m", "double", "bench_s over way_m; only of arrivals"),
    Column("position_error_m", "double", "horizontal, of the reported pose at the end"),
    Column("max_position_error_m", "double", "the largest during the mission"),
    Column("heading_error_rad", "double", "at the end"),
    Column("max_heading_error_rad", "double", "the largest during the mission"),
    Column("sigma_m", "double", "the filter's own, along its worst axis, at the end"),
    Column("sigma_rad", "double", "of the heading, at the end"),
    Column("nees", "double", "x, y, yaw, mean over the stops before registration; about 3 if consistent"),
    Column("stops", "integer", "number of these stops"),
    Column("max_error_sigmas", "double", "largest horizontal error at a stop, over its sigma"),
    Column("max_tilt_deg", "double", "largest angle of the body from the vertical"),
    Column("contacts", "integer", "of wheels with rocks over 0.08 m, of the body with anything"),
    Column("first_contact", "varchar", "time, parts, place"),
    Column(
        "in_obstacle", "boolean", "a wheel came over a trench or step that was put into the ground; empty without one"
    ),
    Column("faults", "varchar", "raised by the flight program, with their times"),
    Column("faults_raised", "integer", "their number"),
    Column("injected", "varchar", "injections, with their times"),
    Column("fault_delay_s", "double", "from the first injection to the first fault after it"),
    Column("ticks", "integer", "of 10 ms"),
    Column("jobs", "integer", "started by the flight program: maps, plans"),
    Column("registered", "integer", "accepted registrations"),
    Column("lost_ratio", "double", "share of the due beams that returned nothing, as measured"),
    Column("median_slope_deg", "double", "of the ground"),
    Column("p95_slope_deg", "double", "of the ground"),
    Column("rock_area_ratio", "double", "of the ground, as drawn"),
    Column("states_sha256", "varchar", "of the plant's states at every tick"),
    Column("wires_sha256", "varchar", "of every channel's bytes"),
    Column("version", "varchar", "of the project, and a hash of its sources"),
    Column("wall_s", "double", "time of the flight on its machine", is_time=True),
    Column("peak_rss_mb", "double", "largest memory of its process so far", is_time=True),
)
OUTCOMES: Mapping[str, str] = {
    "arrived": f"reported its arrival, within {GOAL_M} m by truth",
    "silent": f"reported its arrival, and is farther than {GOAL_M} m by truth",
    "stopped": "reported why it does not go on",
    "undecided": "no outcome at the limit of time",
    "aborted": "the bench ended the flight: tipped, beside the ground",
    "error": "the bench itself failed: a defect of ours",
}


@dataclass(frozen=True, slots=True)
class Case:
    """Case ready to fly. built: the rover as it is."""

    number: int
    values: Mapping[str, Any]
    scenario: Scenario
    field: Field
    built: Drawing | None
    mission: MissionKnobs


def case_of(plan: Plan, number: int) -> Case:
    """Case of a plan. Raises ConfigError for values that do not go together, ValueError for a ground without field."""
    values = drawn(plan, number)
    mission = MissionKnobs(**table_of(values, "mission"))
    seed = seed_of(plan, number, values)
    scenario = _scenario(plan, values, mission, seed)
    field = drawn_ground(GroundKnobs(**table_of(values, "ground")), seed) if mission.terrain == DRAWN else None
    field = field or ground_of(scenario).field
    field = seen_from_orbit(field, OrbitKnobs(**table_of(values, "orbit")), seed)
    return Case(number, values, scenario, field, built(table_of(values, "build"), seed), mission)


def seed_of(plan: Plan, number: int, values: Mapping[str, Any]) -> int:
    """Seed of a case's ground, nodes and scanner: the drawn one, else the plan's, counted on by the case."""
    return int(values.get("mission.seed") or plan.seed + number - 1)


def _scenario(plan: Plan, values: Mapping[str, Any], mission: MissionKnobs, seed: int) -> Scenario:
    until_s = mission.blackout_from_s + mission.blackout_for_s
    rows = (table_of(values, f"faults.{k}") for k in range(1, plan.faults + 1))
    return Scenario(
        name=plan.name,
        terrain="flat" if mission.terrain == DRAWN else mission.terrain,
        seed=seed,
        blackout_s=(mission.blackout_from_s, until_s) if mission.blackout_for_s > 0 else (),
        limit_s=mission.limit_s,
        rays=mission.rays,
        soil=mission.soil,
        lidar=table_of(values, "lidar"),
        sensors=nested(table_of(values, "sensors")),
        set=table_of(values, "set"),
        faults=tuple(Injection(**row) for row in rows if row),
    )


def drawn_ground(knobs: GroundKnobs, seed: int) -> Field:
    """Field of a recipe, accepted as it is drawn."""
    bearing, towards = math.radians(knobs.goal_bearing_deg), math.radians(knobs.tilt_towards_deg)
    rise = elementary.tan(math.radians(knobs.tilt_deg))
    ahead, left = rise * elementary.cos(towards), rise * elementary.sin(towards)

    def plane(x_m: F64, y_m: F64) -> F64:
        return ahead * x_m + left * y_m

    law = Golombek if knobs.rock_law == "golombek" else PowerLaw
    recipe = Recipe(
        knobs.hurst,
        median_slope_deg=knobs.median_slope_deg,
        craters=CraterLaw() if knobs.craters else None,
        rocks=law(knobs.rocks_ratio) if knobs.rocks_ratio > 0 else None,
        relief=plane if rise else None,
    )
    course = Course(bearing_rad=bearing, away_m=knobs.goal_m)
    return compose(recipe, course, generator([seed, _SALT["ground"]]), seed)


def seen_from_orbit(field: Field, knobs: OrbitKnobs, seed: int) -> Field:
    """Field with errors in the orbiter's map."""
    gdem, rng = field.gdem, generator([seed, _SALT["orbit"]])
    heights = gdem.heights_m.astype(np.float64) + knobs.offset_m
    heights += knobs.noise_m * rng.standard_normal(heights.shape)
    heights[rng.random(heights.shape) < knobs.missing_ratio] = np.nan
    grid = replace(gdem.grid, x0_m=gdem.grid.x0_m + knobs.shift_x_m, y0_m=gdem.grid.y0_m + knobs.shift_y_m)
    return replace(field, gdem=replace(gdem, grid=grid, heights_m=heights.astype(np.float32)))


def built(table: Mapping[str, Any], seed: int) -> Drawing | None:
    """Rover as built; None without a table [build]."""
    if not table:
        return None
    knobs = BuildKnobs(**table)
    base = assembled(seed) if knobs.assembly else BuildErrors()
    axes = ("roll", "pitch", "yaw")
    errors = replace(
        base,
        wheel_radius_ratio=base.wheel_radius_ratio * knobs.wheel_radius_ratio,
        steer_rad=tuple(a + getattr(knobs, f"steer_{n}_rad") for n, a in enumerate(base.steer_rad, 1)),
        lidar_rad=tuple(a + getattr(knobs, f"lidar_{axis}_rad") for axis, a in zip(axes, base.lidar_rad)),
        imu_rad=tuple(a + getattr(knobs, f"imu_{axis}_rad") for axis, a in zip(axes, base.imu_rad)),
    )
    return errors.built(Drawing())


def fly(plan: Plan, number: int, folder: Path | None = None) -> dict[str, Any]:
    """Fly a case and return its row: the drawn values by knob, and COLUMNS.

    folder: gets onboard.mcap, truth.mcap and field.npz; None: no files. A flight that the bench cannot make is a row as
    well: its outcome is `aborted`, or `error` for a defect of ours. Raises OSError if the files cannot be written.
    """
    begun_s = time.perf_counter()
    values = drawn(plan, number)
    try:
        result = _flown(case_of(plan, number), folder)
    except PlantAbortError as abort:
        result = {"outcome": "aborted", "reason": f"before the first tick: {abort}"}
    except DEFECTS as error:
        if folder is not None and isinstance(error, OSError):
            raise
        result = {"outcome": "error", "reason": f"{type(error).__name__}: {error}"}
    seed = seed_of(plan, number, values)
    times = {
        "wall_s": round(time.perf_counter() - begun_s, 3),
        "peak_rss_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1),
    }
    return {**values, "case_number": number, "seed": seed, **result, "version": sources_version(), **times}


def _flown(case: Case, folder: Path | None) -> dict[str, Any]:
    orders = (*(edges(case.field) if case.mission.edges else ()), goto(case.field.goal_m))
    files = {} if folder is None else _files(folder, case.field)
    step_ns = round(case.mission.step_s * 1e9)
    bench = InMemory(case.scenario, orders, ground=case.field, step_ns=step_ns, built=case.built, **files)
    assert bench.rover is not None, "no fault is injected before the first tick"
    config, watch = bench.rover.config, Watch(bench.obstacles)
    flight = bench.run(watch)
    way = true_way(true_surface(case.field), case.field.start, case.field.goal_m, config)
    return {**_ground_figures(case.field, way), **figures(flight, watch, way.way_m)}


def _files(folder: Path, field: Field) -> dict[str, Path]:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "field.npz").write_bytes(field_file.to_npz(field))
    return {"record": folder / "onboard.mcap", "truth": folder / "truth.mcap"}


def _ground_figures(field: Field, way: TrueWay) -> dict[str, Any]:
    start = field.start
    return {
        "reachable": bool(way.reachable),
        "optimum_m": _rounded(way.way_m),
        "straight_m": _rounded(math.dist((start.x_m, start.y_m), field.goal_m)),
        **{key: _rounded(field.stats.get(key)) for key in ("median_slope_deg", "p95_slope_deg", "rock_area_ratio")},
    }


def figures(flight: Flight, watch: Watch, optimum_m: float) -> dict[str, Any]:
    """Columns of a flight that was flown."""
    outcome, reason = verdict(flight)
    arrived = outcome == "arrived"
    faults = [(event.now_ns / 1e9, event.text) for event in flight.events if event.name == "FAULT"]
    injected = [(float(str(row["t_s"])), f"{row['fault']} {row['what']}") for row in flight.faults]
    begun_s = min((t_s for t_s, _ in injected), default=math.inf)
    delays_s = [t_s - begun_s for t_s, _ in faults if t_s >= begun_s]
    nees = [stop.nees for stop in watch.stops]
    sigmas = [math.hypot(*stop.error[:2]) / stop.sigma_m for stop in watch.stops if stop.sigma_m > 0]
    row = {
        "outcome": outcome,
        "reason": reason,
        "distance_to_goal_m": flight.distance_to_goal_m,
        "way_m": flight.way_m,
        "way_ratio": flight.way_m / optimum_m if arrived and 0 < optimum_m < math.inf else None,
        "scans": flight.sweeps,
        "bench_s": flight.bench_s,
        "s_per_m": flight.bench_s / flight.way_m if arrived and flight.way_m > 0 else None,
        "position_error_m": watch.error_m,
        "max_position_error_m": watch.max_error_m,
        "heading_error_rad": watch.heading_rad,
        "max_heading_error_rad": watch.max_heading_rad,
        "sigma_m": watch.last.sigma_m,
        "sigma_rad": watch.last.sigma_rad,
        "nees": sum(nees) / len(nees) if nees else None,
        "stops": len(nees),
        "max_error_sigmas": max(sigmas, default=None),
        "max_tilt_deg": math.degrees(watch.max_tilt_rad),
        "contacts": len(flight.contacts),
        "first_contact": line(flight.contacts[0]) if flight.contacts else "",
        "in_obstacle": watch.in_obstacle,
        "faults": _timed(faults),
        "faults_raised": len(faults),
        "injected": _timed(injected),
        "fault_delay_s": min(delays_s, default=None),
        "ticks": round(flight.bench_s * 100),
        "jobs": watch.jobs,
        "registered": sum(event.name == "REGISTERED" for event in flight.events),
        "lost_ratio": flight.equipment["scanner"]["lost_ratio"],
        "states_sha256": flight.states_sha256,
        "wires_sha256": hashlib.sha256(json.dumps(flight.streams, sort_keys=True).encode()).hexdigest(),
    }
    return {name: _rounded(item) for name, item in row.items()}


def verdict(flight: Flight) -> tuple[str, str]:
    """Row of OUTCOMES, and the reason."""
    if flight.error:
        return "aborted", flight.error
    if flight.arrived:
        within = flight.distance_to_goal_m <= GOAL_M
        return ("arrived", "") if within else ("silent", "its arrival is false")
    for request in flight.requests:
        if request.state.final and request.state is not RequestState.COMPLETED:
            told = request.report.text if request.report else ""
            return "stopped", f"{request.telecommand.name}: {told or request.state.name}"
    return "undecided", "no outcome at the limit of time"


def _timed(rows: Sequence[tuple[float, str]]) -> str:
    return "; ".join(f"{t_s:.2f} s {text}" for t_s, text in rows)


def _rounded(item: Any) -> Any:
    """Figure with 6 digits behind the point; None for what is no number."""
    if not isinstance(item, float):
        return item
    return round(item, 6) if math.isfinite(item) else None


def reason_class(text: str) -> str:
    """Reason without its numbers, to group by."""
    return re.sub(r"[-+]?\d+(?:\.\d+)?", "#", text)


@cache
def sources_version() -> str:
    """Version of the project and hash of what flies here: sources and kernels of the bench and the flight program."""
    total = hashlib.sha256()
    for package in ("protocol", "transport", "onboard", "hil"):
        for path in sorted(path for end in ("py", "hpp", "cpp") for path in (ROOT / package).rglob(f"*.{end}")):
            total.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return f"{version('el-dorado')} {total.hexdigest()[:12]}"


def described(case: Case) -> dict[str, Any]:
    """Scenario of a case in plain words, for `hil case --dry`."""
    shown = asdict(case.scenario)
    return {key: shown[key] for key in ("terrain", "seed", "soil", "limit_s", "lidar", "sensors", "set", "faults")}
