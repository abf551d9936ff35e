"""`python -m tests.missions.guard.guard_picture OUT.png`: a trench opens on even ground, the guard stops."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from onboard.config import load
from onboard.planning.guard import guarded_leg
from onboard.records import Grid, Pose
from pictures.drive_guard import GuardedLegEnd, guard_figure
from pictures.style import png
from tests.missions.guard.guarded import LINE_M, Guarded
from tests.missions.mission import Errors
from tests.missions.world.drift import NO_DRIFT
from tests.missions.world.scanner import scanner
from tests.missions.world.world import World

GRID = Grid(-2.975, -2.975, 0.05, 120, 200)
TRENCH_M, DEEP_M = (2.6, 2.9), 0.12


def stopped() -> GuardedLegEnd:
    """Return the rover on its way along +x, at the first bad cell."""
    config = load(None, {"drive_guard.on": True})
    even = World(
        GRID, np.zeros((GRID.rows, GRID.columns), np.float32), Pose(0.0, 0.0), (4.0, 0.0), 1, "even", np.empty((0, 4))
    )
    mission = Guarded(even, scanner(config), Errors(), 1, NO_DRIFT)
    mission._scan()
    x_m = GRID.x0_m + np.arange(GRID.columns) * GRID.cell_m
    inside = (x_m >= TRENCH_M[0]) & (x_m <= TRENCH_M[1])
    even.heights_m[:, inside] -= np.float32(DEEP_M)
    trench = World(GRID, even.heights_m, even.start, even.goal_m, 1, "trench", even.holes)
    stations = np.column_stack([np.arange(0.0, 4.0, 0.05), np.zeros(80), np.zeros(80)])
    assert mission.flight.memory
    leg = guarded_leg.begin(mission.flight.memory, Pose(0.0, 0.0), (stations, np.empty((0, 3))), config)
    for k in range(200):
        pose = Pose(k * LINE_M, 0.0)
        line = mission.lines.line(trench, pose, pose, mission.rng)
        leg, bad = guarded_leg.hear(leg, line, pose, mission.settings)
        if bad:
            return GuardedLegEnd(leg, line, pose, bad, np.column_stack([x_m, even.heights_m[GRID.rows // 2]]))
    raise RuntimeError("the guard drove into the trench")


if __name__ == "__main__":
    Path(sys.argv[1]).write_bytes(png(guard_figure(stopped(), load())))
