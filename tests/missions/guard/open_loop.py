"""Objects placed on the wheels' tracks after the scan.

Does the guard detect each before a wheel reaches it (study 9.3)?

Paths are the truth planner's on fields without holes, a scan every 4 m; each leg gets one object at least 2.5 m of path
behind its scan. The guard only reports, nothing stops. Counted are objects that a wheel truly meets; an object is
missed if no trigger named it 0.10 m before.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from rich.table import Table

from onboard.config import Rover, load
from onboard.perception.map import ldem
from onboard.perception.map.cell_classes import classify
from onboard.planning.guard import drive_guard
from onboard.planning.guard.guarded_leg import MARGIN_M
from onboard.planning.guard.wheel_footprint import tracks
from onboard.records import F64, Pose
from tests.missions.guard.guard_runs import GUARDED
from tests.missions.guard.guarded import STOPPING_M, Guarded
from tests.missions.mission import Errors
from tests.missions.world.fields import main_field
from tests.missions.world.scanner import scanner
from tests.missions.world.truth import truth
from tests.missions.world.world import World, wheels

LEG_M, FROM_M = 4.0, 2.5
AT_ONCE = 8  # fields
MISSED_RATIO = 0.01
BESIDE_M = 0.2  # a trigger this near to an object's rim names it
HALF_PATCH_M = 0.05


@dataclass(frozen=True)
class Put:
    """A round object with steep walls. up_m: height of a rock; negative: depth of a hole."""

    x_m: float
    y_m: float
    width_m: float
    up_m: float

    def into(self, world: World) -> World:
        """Return the world with the object."""
        grid = world.grid
        x = grid.x0_m + np.arange(grid.columns) * grid.cell_m - self.x_m
        y = grid.y0_m + np.arange(grid.rows) * grid.cell_m - self.y_m
        inside = np.hypot(x[None, :], y[:, None]) <= self.width_m / 2
        return replace(world, heights_m=(world.heights_m + np.where(inside, self.up_m, 0.0)).astype(np.float32))

    def met(self, pose: Pose, rover: Rover) -> bool:
        """Return whether a wheel's patch of 10 cm lies wholly in the hole, or touches the rock."""
        for x, y in wheels(pose, rover):
            part = HALF_PATCH_M if self.up_m < 0 else -HALF_PATCH_M  # the patch's farthest corner, or its nearest side
            if math.hypot(*(max(0.0, abs(d) + part) for d in (x - self.x_m, y - self.y_m))) <= self.width_m / 2:
                return True
        return False


@dataclass(frozen=True)
class Outcome:
    """Result of the guard on one leg.

    lead_m: of the first trigger that names the object before a wheel meets it; nan if none did.
    met: False: no wheel met the object.
    other: triggers that name something else, counted once for every 0.3 m of path.
    """

    seed: int
    rock: bool
    met: bool
    lead_m: float
    other: int
    way_m: float

    @property
    def missed(self) -> bool:
        """Met without a trigger 0.10 m before."""
        return self.met and not self.lead_m >= STOPPING_M


class OpenLoop(Guarded):
    """One path in legs of 4 m, each driven once with a hole and once with a rock."""

    def outcomes(self, path: F64, seed: int) -> Iterator[Outcome]:
        """Return the outcomes of every leg, in the path's order."""
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))])
        bare = self.world
        for first_m in np.arange(0.0, way[-1] - LEG_M, LEG_M):
            first, last = np.searchsorted(way, [first_m, first_m + LEG_M])
            leg = path[first : last + 1]
            self.true = self.estimate = self._stand(*leg[0])
            self.world = bare
            self._scan()
            if not _ahead(leg).all():
                continue
            for up in (-1.0, 1.0):
                thing = self._draw(leg, way[first : last + 1] - way[first], up)
                self.world = thing.into(bare)
                yield self._outcome(leg, thing, seed)

    def _draw(self, leg: F64, way_m: F64, up: float) -> Put:
        """Return an object on a front wheel's track."""
        at_m = self.rng.uniform(FROM_M, LEG_M - 0.6)
        x, y, yaw = leg[int(np.searchsorted(way_m, at_m))]
        spot = wheels(Pose(x, y, yaw_rad=yaw), self.config.rover)[int(self.rng.choice([0, 3]))]
        if up < 0:
            return Put(*spot, self.rng.uniform(0.2, 0.7), -self.rng.uniform(0.12, 0.30))
        return Put(*spot, self.rng.uniform(0.2, 0.5), self.rng.uniform(0.10, 0.25))

    def _outcome(self, leg: F64, thing: Put, seed: int) -> Outcome:
        assert self.flight.memory
        drive = self._in_steps(leg)
        reach = MARGIN_M + float(np.abs(leg[:, :2] - leg[0, :2]).max())
        window = ldem.window(self.flight.memory.cells, leg[0, 0], leg[0, 1], 2 * reach)
        watch = drive_guard.begin(classify(window, self.config.mapping))
        ahead = np.zeros(watch.surface.z_mean.shape, np.bool_)
        named_m, met_m, others = math.nan, math.nan, set()
        for k in range(len(drive.stations)):
            true, believed = self._at(drive, k)
            if thing.met(true, self.config.rover):
                met_m = float(drive.way_m[k])
                break
            if drive.feel[k]:
                to_come = drive.stations[k:][drive.feel[k:] > 0]
                ahead = tracks(to_come, np.empty((0, 3)), window.grid, self.config.rover)
            heard = self.lines.line(self.world, true, believed, self.rng)
            watch, bad = drive_guard.hear(watch, heard, believed, ahead, self.settings)
            for cell in bad:
                if math.dist(cell[:2], (thing.x_m, thing.y_m)) > thing.width_m / 2 + BESIDE_M:
                    others.add(round(float(drive.way_m[k]) / 0.3))
                elif math.isnan(named_m):
                    named_m = float(drive.way_m[k])
        return Outcome(seed, thing.up_m > 0, not math.isnan(met_m), met_m - named_m, len(others), float(drive.way_m[k]))


def outcomes(seed: int) -> list[Outcome]:
    """Return the outcomes of all legs of one field; none if its goal cannot be reached."""
    config = load(None, GUARDED)
    world = main_field(seed)
    perfect = truth(world, config)
    if perfect.path is None:
        return []
    return list(OpenLoop(world, scanner(config), Errors(), seed).outcomes(perfect.path.stations, seed))


def until_met(each: int, workers: int) -> Iterator[list[Outcome]]:
    """Yield the legs so far, field by field from seed 1 on, until a wheel has met `each` holes and `each` rocks."""
    found: list[Outcome] = []
    with ProcessPoolExecutor(workers) as pool:
        for first in count(1, AT_ONCE):
            for field in pool.map(outcomes, range(first, first + AT_ONCE)):
                found += field
                yield found
                if min(met(found)) >= each:
                    return


def met(found: Sequence[Outcome]) -> tuple[int, int]:
    """Return the numbers of holes and rocks that a wheel met."""
    rocks = sum(one.rock for one in found if one.met)
    return sum(one.met for one in found) - rocks, rocks


def shortfalls(found: Sequence[Outcome]) -> list[str]:
    """Of 100 holes and 100 rocks met by a wheel at most 2 may be missed."""
    total, missed = sum(met(found)), sum(one.missed for one in found)
    return [f"{missed} of {total} objects were missed"] if missed > MISSED_RATIO * total else []


def table(found: Sequence[Outcome]) -> Table:
    """Return the table of holes and rocks: placed, met by a wheel, missed by the guard, with the lead."""
    made = Table(
        "objects on the tracks",
        "put",
        "met by a wheel",
        "missed",
        "lead least / 5 % / median, m",
        "other triggers per 10 m",
    )
    for name, rock in (("holes", False), ("rocks", True)):
        mine = [one for one in found if one.rock == rock]
        reached = [one for one in mine if one.met]
        leads = [one.lead_m for one in reached if not one.missed] or [math.nan]
        spread = " / ".join(f"{value:.2f}" for value in (min(leads), *np.percentile(leads, [5, 50])))
        way_m = sum(one.way_m for one in mine)
        others, missed = 10 * sum(one.other for one in mine) / max(way_m, 1e-9), sum(one.missed for one in reached)
        made.add_row(name, str(len(mine)), str(len(reached)), str(missed), spread, f"{others:.2f}")
    return made


def _ahead(leg: F64) -> F64:
    """Return for each step of a leg whether it goes ahead (or turns): backwards the guard sees nothing."""
    step = np.diff(leg[:, :2], axis=0)
    ahead: F64 = step[:, 0] * np.cos(leg[1:, 2]) + step[:, 1] * np.sin(leg[1:, 2]) >= -1e-9
    return ahead
