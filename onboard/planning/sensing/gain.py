"""Gain of a next sensing position (Eq. 28): the expected view of a scan from a place.

    "visibility"  Vis (Eq. 6): the cells seen of those of the map in range, in the sector that faces the goal
    "newly-seen"  the unknown cells seen, of all cells of a sector, in the sector of the best heading

Beyond the map all is unknown: when newly seen cells are counted, a margin as wide as the range represents it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from onboard.native import each
from onboard.planning.sensing import visibility
from onboard.planning.sensing.visibility import Sector, Visibility, VisibilityRequest
from onboard.records import F32, F64, Bool, Grid

GAINS = ("visibility", "newly-seen")


@dataclass(frozen=True, slots=True)
class Eyes:
    """Scanner for which the visibility is computed.

    height_m: height above the ground.
    range_m: range.
    sector_rad: half the usable sector.
    beams: number of beams around the circle.
    optimistic: unknown cells do not hide the ground behind them.
    """

    height_m: float = 0.7
    range_m: float = 8.0
    sector_rad: float = math.radians(65)
    beams: int = 360
    optimistic: bool = True


class Sight:
    """Views over one ground.

    z_mean: float32 (rows, columns), NaN = unknown.
    goal_m: x, y of the goal.
    eyes: the scanner.
    gain: one of GAINS.
    """

    def __init__(self, grid: Grid, z_mean: F32, goal_m: tuple[float, float], eyes: Eyes, gain: str) -> None:
        self._eyes, self._new = eyes, gain == "newly-seen"
        self._beams = visibility.beams(eyes.range_m, grid.cell_m, eyes.beams)
        self._margin = self._beams.dj.shape[1] if self._new else 0
        self._inner = np.s_[self._margin : self._margin + grid.rows, self._margin : self._margin + grid.columns]
        known = np.pad(z_mean, self._margin, constant_values=np.nan)
        self._scene = visibility.scene(known, optimistic=eyes.optimistic)
        x, y = centres(grid)
        self._to_goal_rad = each.atan2(goal_m[1] - y, goal_m[0] - x)

    def gains(self, where: Bool) -> tuple[F64, F64]:
        """Gain of every cell `where`, 0 to 1, and the heading that gives it, (rows, columns); undefined elsewhere.

        The heading faces the goal if nothing new would be seen.
        """
        half = self._eyes.sector_rad
        if not self._new:
            return self._total(
                where, VisibilityRequest(sector=Sector(self._to_goal_rad, half))
            ).index, self._to_goal_rad
        seen = self._total(where, VisibilityRequest(new_half_rad=half))
        new, heading = seen.new_cells[self._inner], seen.heading_rad[self._inner]
        return seen.gain[self._inner], np.where(new > 0.0, heading, self._to_goal_rad)

    def gain_from(self, cell: tuple[int, int]) -> float:
        """Gain of one cell (j, i), with the same bits as `gains`."""
        if not self._new:
            sector = Sector(float(self._to_goal_rad[cell]), self._eyes.sector_rad)
            return visibility.from_node(self._scene, self._beams, self._eyes.height_m, cell, sector).index
        where = np.zeros(self._to_goal_rad.shape, dtype=bool)
        where[cell] = True
        return float(self.gains(where)[0][cell])

    def views(self, where: Bool, heading_rad: F64) -> tuple[F64, F64]:
        """Vis and the number of unknown cells seen in the sector of each heading, for the cells `where`."""
        half, turned = self._eyes.sector_rad, np.pad(np.where(where, heading_rad, 0.0), self._margin)
        seen = self._total(where, VisibilityRequest(sector=Sector(turned, half), new_half_rad=half))
        return seen.index[self._inner], seen.new_cells[self._inner]

    def _total(self, where: Bool, asked: VisibilityRequest) -> Visibility:
        question = replace(asked, where=np.pad(where, self._margin))
        return visibility.total(self._scene, self._beams, self._eyes.height_m, question)


def centres(grid: Grid) -> tuple[F64, F64]:
    """x (1, columns) and y (rows, 1) of the cells' centres."""
    x = grid.x0_m + np.arange(grid.columns, dtype=np.float64) * grid.cell_m
    y = grid.y0_m + np.arange(grid.rows, dtype=np.float64) * grid.cell_m
    return x[None, :], y[:, None]
