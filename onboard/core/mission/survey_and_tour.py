"""Missions other than one `goto`: a scan where the rover stands, and a tour of several goals in order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from onboard.config import Config
from onboard.core.context import Context
from onboard.core.mission.mission import Mission
from onboard.planning.mission_rule import MissionState
from onboard.records import Gdem
from protocol.tables.modes import Phase

if TYPE_CHECKING:
    from onboard.perception.map.stop_map import StopMap

Point = tuple[float, float]


class Survey(Mission):
    """One scan at the present place, registered and entered in the map, without driving."""

    done, plans = "scanned", False

    def _begin(self, ctx: Context) -> None:
        pose = ctx.localisation.pose
        self.goal, self._behind_wanted = (pose.x_m, pose.y_m), False
        self._scan()

    def _plan(self, ctx: Context) -> None:
        pose = ctx.localisation.pose
        self._end(Phase.NONE, True, f"scanned at {pose.x_m:.2f} {pose.y_m:.2f}; it is in the map")


class Tour(Mission):
    """Several goals in order; the mission rule restarts for each, on the map as it is by then."""

    def __init__(self, config: Config, gdem: Gdem | None, goals: Sequence[Point], memory: StopMap | None) -> None:
        super().__init__(config, gdem, goals[0], memory)
        self._goals, self._reached = tuple(goals), 0

    def _arrive(self, reason: str) -> None:
        self._reached += 1
        if self._reached == len(self._goals):
            super()._arrive(f"all {self._reached} goals; {reason}")
            return
        self.progress.append(f"goal {self._reached} of {len(self._goals)}: {reason}")
        self.goal = self._goals[self._reached]
        self._rule = self._rule_before = MissionState(number=1)
        self._foreseen = False
        self._scan()
