"""A run's folder as the bench leaves it, made up: an arc in three legs, with a pose that drifts."""

import json
import math
from dataclasses import replace

import numpy as np

from hil.records import PlantState, TrueTurn, WheelTruth
from hil.terrain import field_file
from hil.terrain.field import Field, truth_height
from hil.terrain.fractal import fractal_heights
from hil.terrain.rock_sizes import PowerLaw
from hil.terrain.rocks import scatter_rocks
from hil.world.truth import Truth
from onboard.config import load
from onboard.planning.mission_rule import MissionState, Stop
from onboard.planning.plan_records import PlanReport, PlanResult
from onboard.planning.sensing.next_position import Choice, NextPosition
from onboard.record.writer import Recorder
from onboard.records import Decision, Event, Gdem, Grid, Inputs, JobDone, NodeSet, Outputs, Path, Pose

GOAL = (15.0, 2.0)
END_S, SCAN_S = 90.0, 12.0
LEGS = ((12.0, 30.0), (42.0, 56.0), (68.0, 82.0))  # when it drives, s
LDEM_CELLS, LDEM_CELL_M = 100, 0.1
TICK_WALL_MS = {
    "plant_and_devices": {"p50": 0.4, "p99": 3.0, "p99_9": 7.0, "max": 20.0},
    "until_onboard_answered": {"p50": 0.5, "p99": 4.0, "p99_9": 9.0, "max": 300.0},
    "histogram": {
        "edges_ms": [0.1, 1.0, 10.0, 1000.0],
        "plant_and_devices": [8000, 990, 10],
        "until_onboard_answered": [7000, 1980, 20],
    },
}


def way(share):
    """x, y, yaw at a share 0..1 of the way: an arc that leaves the straight line to the left."""
    x = GOAL[0] * share
    y = GOAL[1] * share + 2.5 * math.sin(math.pi * share)
    slope = GOAL[1] / GOAL[0] + 2.5 * math.pi / GOAL[0] * math.cos(math.pi * share)
    return x, y, math.atan(slope)


def share_at(time_s):
    total = sum(end - start for start, end in LEGS)
    return sum(min(max(time_s - start, 0), end - start) for start, end in LEGS) / total


def field(seed=3):
    rng = np.random.default_rng(seed)
    grid = Grid(-2.45, -7.95, 0.1, 200, 200)
    soil = fractal_heights(256, 0.1, 0.8, 0.012, rng)[:200, :200].astype(np.float32)
    soil -= soil[80, 25]
    clear = tuple((*way(k / 20)[:2], 0.8) for k in range(21))
    rocks = scatter_rocks(grid, soil, PowerLaw(0.035), clear, rng)
    coarse = soil.reshape(10, 20, 10, 20).mean(axis=(1, 3)).astype(np.float32)
    gdem = Gdem(Grid(-1.5, -7.0, 2.0, 10, 10), coarse, "made up")
    stats = {"median_slope_deg": 5.0, "p95_slope_deg": 11.0, "rock_area_ratio": 0.035, "rocks": float(len(rocks))}
    return Field(grid, soil, rocks, Pose(0, 0), GOAL, gdem, seed, stats)


def plan_at(number, heights, grid):
    """A plan with all four node sets around the place of stop `number`."""
    x, y, yaw = way(share_at(LEGS[number][0]))
    half = LDEM_CELLS // 2 * LDEM_CELL_M
    x0, y0 = round(x - half, 1) + 0.05, round(y - half, 1) + 0.05
    j, i = np.mgrid[:LDEM_CELLS, :LDEM_CELLS]
    px, py = x0 + i * LDEM_CELL_M, y0 + j * LDEM_CELL_M
    away, bearing = np.hypot(px - x, py - y), np.arctan2(py - y, px - x)
    seen = (away < 6) & (np.abs(np.angle(np.exp(1j * (bearing - yaw)))) < 1.9)
    rows = np.clip(np.rint((py - grid.y0_m) / grid.cell_m).astype(int), 0, grid.rows - 1)
    columns = np.clip(np.rint((px - grid.x0_m) / grid.cell_m).astype(int), 0, grid.columns - 1)
    z = heights[rows, columns]
    sets = np.where(seen, NodeSet.FREE, NodeSet.OUTSIDE)
    shadow = seen & (away > 3) & (np.sin(9 * bearing) > 0.8)
    sets = np.where(seen & (np.hypot(px - x - 3, py - y + 1) < 0.6), NodeSet.OBSTACLE, sets)
    sets = np.where(shadow, NodeSet.OCCLUDED, sets)
    z = np.where((sets == NodeSet.FREE) | (sets == NodeSet.OBSTACLE), z, np.nan).astype(np.float32)
    shares = np.linspace(share_at(LEGS[number][0]), share_at(LEGS[number][1]), 40)
    path = np.array([way(s) for s in shares])
    last = number == len(LEGS) - 1
    ahead = np.array([way(s)[:2] for s in np.linspace(shares[-1], min(1, shares[-1] + 0.2), 10)])
    reason = "the goal is reached over free poses" if last else "3.00 m to the last free pose, then look at <the rest>"
    decision = Decision(
        "goal" if last else "drive",
        "R4" if last else "R5",
        reason,
        Path(path),
        path[-1, 2],
        {} if last else {"target_m": tuple(ahead[-1])},
    )
    best, *others = (Choice((1, 2), x + k, y + 1, 0.5, 0.6, 0.7, -0.1, 0.7, 50.0, 9.0) for k in (1, 2, 3))
    found = None if last else NextPosition(best, tuple(others), z.astype(np.float64), {"not free": 9})
    report = PlanReport(
        Grid(x0, y0, LDEM_CELL_M, LDEM_CELLS, LDEM_CELLS),
        sets.astype(np.uint8),
        z,
        np.array([(x, y), GOAL]),
        ahead,
        found,
    )
    state = MissionState(number=number + 1, stops=(Stop(x, y, yaw),))
    return PlanResult(decision, state, report, Pose(x, y, 0, yaw_rad=yaw), GOAL)


def phase_events():
    """time_s -> (name, text), as the executive tells them."""
    told = {2.0: [("MODE", "STANDBY -> AUTONOMOUS: goto"), ("PHASE", "SCANNING at stop 0")]}
    for number, (start, end) in enumerate(LEGS):
        told[start - 1.0] = [("PHASE", f"MAPPING at stop {number}")]
        told[start - 0.5] = [("PHASE", f"PLANNING at stop {number}")]
        told[start] = [("PHASE", f"DRIVING at stop {number + 1}"), ("DECISION", "R5 drive: some reason")]
        if number < len(LEGS) - 1:
            told[end] = [("PHASE", f"TURNING at stop {number + 1}")]
            told[end + 2.0] = [("PHASE", f"SCANNING at stop {number + 1}")]
    told[LEGS[-1][1]] = [("ARRIVED", "0.12 m from the goal"), ("MODE", "AUTONOMOUS -> STANDBY: arrived")]
    return told


RHYTHM = {
    "rate_groups": [
        {"name": "executive", "rate_hz": 100.0, "budget_us": 2000.0, "worst_us": 2345.0, "over_budget": 6, "slips": 0}
    ],
    "ticks": {
        "lateness": [0, 9],
        "late_below_us": {"p50": 128, "p99": 256, "p999": 2048},
        "late_worst_ms": 3.21,
        "worst_ms": 8.0,
        "slipped": 4,
        "slips": [{"cause": "record", "job": "plan", "ticks": 4, "worst_ms": 23.4}],
    },
    "jobs": {"running": [], "kept": {"remember": {"done": 17, "late": 3, "worst_late_ticks": 29, "worst_ms": 5.0}}},
    "real_time": [],
}


def write_run(folder, ground=True, bench=True, step=10):
    """Write the folder; `step` in ticks of the record. ground: with truth and field. bench: with summary and so on."""
    made = field()
    heights = truth_height(made)
    base = load()
    config = replace(base, record=replace(base.record, path=str(folder / "onboard.mcap")))
    told, plans = phase_events(), {start: plan_at(k, heights, made.grid) for k, (start, _) in enumerate(LEGS)}
    with Recorder(config, made.gdem) as recorder:
        for tick in range(0, round(END_S * 100), step):
            time_s = tick / 100
            x, y, yaw = way(share_at(time_s))
            pose = (x + 0.002 * time_s, y - 0.001 * time_s, 0.0, 0.02 * math.sin(x), 0.03 * math.cos(x), yaw + 0.005)
            events = tuple(Event(tick * 10**7, "info", *row) for row in told.get(time_s, ()))
            jobs = (JobDone(1, plans[time_s]),) if time_s in plans else ()
            outputs = Outputs(pose=pose, events=events, state_digest=b"8" * 8)
            recorder.write(Inputs(tick, tick * 10**7, jobs=jobs), outputs)
        recorder.end(None, RHYTHM)
    if ground:
        (folder / "field.npz").write_bytes(field_file.to_npz(made))
        write_truth(folder / "truth.mcap")
    if bench:
        write_bench(folder, made)


def write_truth(path, dug=None, touches=()):
    """As the bench writes it: a sweep before each leg, of turns that meet two points; a fault on the second leg.

    dug: (seconds, field): the ground becomes this one. touches: (begin, end in s, Touch).
    """
    truth, zero = Truth(path), np.zeros(3)
    for k in range(round(END_S * 10)):
        time_s, now_ns = k / 10, k * 10**8
        x, y, yaw = way(share_at(time_s))
        driving = any(start <= time_s < end for start, end in LEGS)
        steer_rad = 0.1 * driving
        wheels = tuple(WheelTruth(sign * steer_rad, 0.15 * k, 1.5 * driving, 0.0) for sign in (1, -1, -1, 1))
        touching = tuple(touch for begin_s, end_s, touch in touches if begin_s <= time_s < end_s)
        turned = np.array([0, 0, math.sin(yaw / 2), math.cos(yaw / 2)])
        truth.add(PlantState(now_ns, np.array([x, y, 0.0]), turned, zero, zero, zero, wheels, touching, (0.02, -0.02)))
        sweep = next((n for n, (start, _) in enumerate(LEGS, 1) if start - SCAN_S <= time_s < start), 0)
        truth.add_turn(
            TrueTurn(
                now_ns,
                sweep,
                np.full((12, 3), (x, y, 0.7)),
                np.full((12, 3), (0.0, 0.0, -1.0)),
                np.where(np.arange(12) == 8, np.inf, 0.7),
            )
        )
        if time_s in (LEGS[1][0], LEGS[1][1]):
            what = "begin" if time_s == LEGS[1][0] else "heal"
            truth.add_fault(now_ns, {"t_s": time_s, "fault": "wheel_stuck", "target": 2, "what": what})
        if dug and dug[0] == time_s:
            truth.add_ground(now_ns, field(), dug[1])
    truth.close()


def write_bench(folder, made):
    summary = {
        "goal_reached": True,
        "distance_to_goal_m": 0.1234,
        "outcome": "arrived: 0.12 m from the goal",
        "collisions": 0,
        "contacts": [],
        "scans": 4,
        "replans": 2,
        "strategy": "optimistic",
        "bench_s": END_S,
        "wall_s": 15.0,
        "rtf": 6.0,
        "way_m": 17.25,
        "replay": "identical",
        "replay_ticks": 9000,
        "can_frames": 123456,
        "scip_bytes": 7890123,
        "link_by_direction": {
            "down": {"sent": 900, "lost": 45, "delivered": 855},
            "up": {"sent": 300, "lost": 15, "delivered": 285},
        },
        "onboard_peak_rss_mb": 190.1,
        "seed": 3,
        "terrain": "fbm",
        "link_profile": "ets8-b",
        "link_note": "256 kbit/s both ways",
        "tick_wall_ms": TICK_WALL_MS,
        "field": made.stats,
        "goal_m": list(GOAL),
        "faults": [],
        "soil": "firm",
        "sensor_noise": "LIDAR 20 mm to 10 m",
        "scanner": {
            "profile": "utm-30lx",
            "lost_ratio": 0.0312,
            "lost_by": {"dark": 0.0, "grazing": 0.021, "random": 0.0102},
            "outlier_ratio": 0.0002,
            "mixed_ratio": 0.001,
            "rate_error_ppm": 80.0,
            "motor_jitter_s": 3e-5,
        },
        "passed_over": [{"seed": 3000, "reason": "the straight line is free"}],
        "replay_difference": "",
    }
    (folder / "summary.json").write_text(json.dumps(summary))
    link = {
        name: {
            "queue_full": 2,
            "blackout": 0,
            "shadow": 0,
            "noise": 43,
            "lost": 45,
            "in": {"datagrams": 900 // k},
            "out": {"datagrams": 855 // k},
        }
        for name, k in (("down", 1), ("up", 3))
    }
    (folder / "link.json").write_text(json.dumps(link))
    certificate = {
        "scenario": "demo",
        "scenario_sha256": "ab" * 32,
        "versions": {"python": "3.11.2", "numpy": "2"},
        "machine": "x86_64",
        "channels": {"can_to_nodes": {"pieces": 5, "bytes": 40, "sha256": "cd" * 32}},
        "plant": {"states": 9000, "sha256": "ef" * 32},
    }
    (folder / "certificate.json").write_text(json.dumps(certificate))
