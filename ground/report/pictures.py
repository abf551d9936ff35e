"""Pictures of a run, drawn from its record like the figures of the paper."""

from __future__ import annotations

import math

import numpy as np

from ground.report.run_files import Run
from onboard.planning.archive import PlanPicture
from onboard.records import F64, Gdem, Grid
from pictures import figures
from pictures.figures import Sigma
from pictures.ldem import ldems
from pictures.next_position import next_position
from pictures.orientation import orientation
from pictures.paths import Ways, paths
from pictures.run_time_line import Mark, run_time_line
from pictures.style import png
from pictures.terrain import Ground, ground_of, terrain
from protocol.conventions import TICK_NS


def paths_picture(run: Run) -> bytes:
    """Draw all paths on the ground, as in Fig. 13a. Returns PNG."""
    plans = [plan for _, plan in run.plans]
    local = [plan.path for plan in plans if len(plan.path) > 1]
    return png(
        paths(
            _ground(run),
            Ways(
                goal_m=_goal(run),
                tolerance_m=float(run.config.get("mission", {}).get("goal_tolerance_m", 0.3)),
                global_path=plans[0].global_path if plans else np.empty((0, 2)),
                local_paths=local,
                estimated=run.estimated.position_m,
                true=run.truth.track.position_m if run.truth else np.empty((0, 2)),
                stops=_stops(run),
                earlier_goals=_earlier_goals(run),
            ),
        )
    )


def orientation_picture(run: Run) -> bytes:
    """Draw yaw, roll and pitch, as in Fig. 13b. Returns PNG."""
    return png(orientation(run.estimated, run.truth.track if run.truth else None, run.spans()))


def ldem_picture(run: Run) -> bytes:
    """Draw the map of each stop in a panel, as in Fig. 9. Returns PNG."""
    return png(ldems([plan for _, plan in run.plans], *_looks(run)))


def choice_picture(run: Run, plan: PlanPicture) -> bytes:
    """Draw the places that the strategy scored at one stop. Returns PNG."""
    return png(next_position(plan, *_looks(run)))


def _looks(run: Run) -> tuple[float, tuple[float, float]]:
    """Return half the scan's sector in rad; length and width of the body in m."""
    rover = run.config.get("rover", {})
    body_m = (float(rover.get("body_length_m", 0.95)), float(rover.get("body_width_m", 0.56)))
    return float(run.config.get("scanning", {}).get("sector_rad", math.radians(65))), body_m


def terrain_picture(run: Run) -> bytes:
    """Draw the true ground and the orbiter's map. Returns PNG."""
    if run.gdem is None:
        return png(terrain(_ground(run), None, _goal(run)))
    return png(terrain(ground_of(run.gdem), run.ground, _goal(run)))


def link_picture(run: Run) -> bytes:
    """Draw delivered and lost datagrams in each direction. Returns PNG."""
    causes = ("queue_full", "blackout", "shadow", "noise")
    names = {"down": "rover to ground", "up": "ground to rover"}
    rows = {text: run.link[key] for key, text in names.items() if key in run.link}
    sent = {text: int(row.get("in", {}).get("datagrams", 0)) for text, row in rows.items()}
    lost = {text: {c.replace("_", " "): int(row.get(c, 0)) for c in causes} for text, row in rows.items()}
    return png(figures.link(sent, lost))


def tick_picture(histogram: dict[str, list[float]]) -> bytes:
    """Draw the wall times of the ticks. Returns PNG. histogram: edges_ms and counts, as in summary.json."""
    counts = {name.replace("_", " "): [int(n) for n in row] for name, row in histogram.items() if name != "edges_ms"}
    return png(figures.ticks(histogram["edges_ms"], counts, TICK_NS / 1e6))


def error_picture(run: Run) -> bytes:
    """Draw the estimated against the true pose. Returns PNG. Needs the truth."""
    assert run.truth
    sigma = Sigma(run.heard.item("sigma_position_m"), run.heard.item("sigma_yaw_rad"))
    return png(figures.pose_error(run.estimated, run.truth.track, run.spans(), sigma))


def time_line_picture(run: Run) -> bytes:
    """Draw battery, currents, link and events on one time line. Returns PNG."""
    marks = [Mark(event.time_s, event.severity, event.name) for event in run.events if event.name != "PHASE"]
    ends = [*run.estimated.times_s[-1:], *(mark.time_s for mark in marks)]
    return png(run_time_line(run.heard.lines(), marks, run.spans(), max(ends, default=0.0)))


def motion_picture(run: Run) -> bytes:
    """Draw the speed, and with the truth wheel rates and steering. Returns PNG."""
    truth = run.truth
    none, no_wheels = np.empty(0), np.empty((0, 4))
    return png(
        figures.motion(
            truth.track if truth else run.estimated,
            truth.track.times_s if truth else none,
            truth.wheel_rates_radps if truth else no_wheels,
            truth.steer_rad if truth else no_wheels,
            run.spans(),
        )
    )


def _goal(run: Run) -> tuple[float, float] | None:
    """Return the last goal: of the plans, of the bench, or of the telemetry; None if none of them has one."""
    if run.plans:
        x, y = run.plans[-1][1].goal_m
        return float(x), float(y)
    if (goal := run.facts.get("goal_m")) is not None:
        return float(goal[0]), float(goal[1])
    east, north = run.heard.item("goal_x_m"), run.heard.item("goal_y_m")
    return (float(east[-1, 1]), float(north[-1, 1])) if len(east) and len(north) else None


def _earlier_goals(run: Run) -> F64:
    """Return the goals before the last one, (m, 2)."""
    goals = dict.fromkeys((float(x), float(y)) for x, y in (plan.goal_m for _, plan in run.plans))
    return np.array([goal for goal in goals if goal != _goal(run)]).reshape(-1, 2)


def _stops(run: Run) -> F64:
    """Return where plans were made: one row of x, y in m for each."""
    return np.array([plan.pose[:2] for _, plan in run.plans]).reshape(-1, 2)


def _ground(run: Run) -> Ground:
    """Return the best known ground: the truth, else the orbiter's map, else an empty plain."""
    if run.ground is not None:
        return run.ground
    if run.gdem is not None:
        return ground_of(run.gdem)
    plain = Gdem(Grid(-49.0, -49.0, 2.0, 50, 50), np.full((50, 50), np.nan, np.float32))
    return Ground(plain.grid, plain.heights_m, name="no map of the ground")
