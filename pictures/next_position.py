"""Choice of the next sensing position: score of every candidate, the best, its alternatives, their sectors."""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from onboard.planning.archive import PlanPicture
from onboard.records import NodeSet
from pictures import rim
from pictures.ldem import SET_COLOURS, SET_NAMES, set_picture
from pictures.marks import NEXT, RING, goal, rover, sector, star
from pictures.style import BLUE, PAGE_IN, drawn, figure, literal
from pictures.terrain import extent, map_axes

SCORES = "cividis"
_ALTERNATIVE_M, _BEST_M = 1.0, 2.0


@drawn
def next_position(plan: PlanPicture, sector_rad: float, body_m: tuple[float, float]) -> Figure:
    """The map of one stop. sector_rad: half the scan's sector. body_m: length and width.

    Cells with a score cover the node sets. If the strategy scored nothing, the picture states that.
    """
    made = figure(PAGE_IN * 0.8, PAGE_IN * 0.8)
    axes = made.subplots()
    left, right, bottom, top = extent(plan.grid)
    axes.imshow(set_picture(plan), origin="lower", extent=(left, right, bottom, top), interpolation="nearest")
    if np.isfinite(plan.score_map).any():
        image = axes.imshow(
            plan.score_map, origin="lower", extent=(left, right, bottom, top), cmap=SCORES, interpolation="nearest"
        )
        made.colorbar(image, ax=axes, label="score E (Eq. 28)", shrink=0.75, aspect=35)
    _choices(axes, plan, sector_rad)
    rover(axes, plan.pose, body_m)
    goal(axes, plan)
    axes.set(xlim=(left, right), ylim=(bottom, top))
    map_axes(axes)
    axes.set_title(literal(textwrap.fill(plan.scoring or "the strategy scored nothing here", 78)), fontsize=9.5)
    made.legend(handles=_legend(plan), loc="outside lower center", ncols=4, fontsize=8.5)
    return made


def _choices(axes: Axes, plan: PlanPicture, sector_rad: float) -> None:
    """The best with its sector, and the alternatives numbered in order."""
    for number, (x, y, heading, _) in enumerate(plan.alternatives, 1):
        sector(axes, (x, y, heading), sector_rad, BLUE, _ALTERNATIVE_M)
        axes.plot(x, y, "o", color=BLUE, markersize=11, markeredgecolor="white", zorder=6)
        axes.text(x, y, str(number), color="white", fontsize=8, ha="center", va="center_baseline", zorder=7)
    for x, y, heading, _ in plan.choice:
        sector(axes, (x, y, heading), sector_rad, NEXT, _BEST_M)
        star(axes, np.array([x, y]))


def _legend(plan: PlanPicture) -> list[Patch | Line2D]:
    shown = [s for s in NodeSet if (plan.node_sets == s).any()]
    lines = [Line2D([], [], label="goal, or the way to it", **RING)]
    if len(plan.choice):
        best = Line2D([], [], color=NEXT, marker="*", linestyle="none", markersize=11, label="best, its sector")
        lines.append(best)
    if len(plan.alternatives):
        dot = {"marker": "o", "linestyle": "none", "markeredgecolor": "white", "markersize": 9}
        lines.append(Line2D([], [], color=BLUE, label="alternatives, in order", **dot))
    sets = [Patch(facecolor=SET_COLOURS[s], edgecolor="#888888", label=f"{SET_NAMES[s]}, no score") for s in shown]
    if rim.rim(plan.node_sets, plan.heights_m, plan.grid.cell_m).any():
        sets.append(Patch(facecolor=rim.COLOUR, edgecolor="#888888", label=rim.NAME))
    return [*lines, *sets]
