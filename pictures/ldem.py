"""Figure 9 of the chapter, one panel for each stop: the local map's four node sets and the next sensing position."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from onboard.planning.archive import PlanPicture
from onboard.records import NodeSet
from pictures import rim
from pictures.marks import NEXT, RING, goal, rover, sector, star
from pictures.style import BLACK, BLUE, PAGE_IN, RED, drawn, figure, literal
from pictures.terrain import extent, hillshade, map_axes

SET_COLOURS = {
    NodeSet.OUTSIDE: "#f7f7f7",
    NodeSet.OCCLUDED: "#9a9aa6",
    NodeSet.OBSTACLE: "#d98550",
    NodeSet.FREE: "#bfe0d2",
}
SET_NAMES = {
    NodeSet.OUTSIDE: "outside",
    NodeSet.OCCLUDED: "occluded",
    NodeSet.OBSTACLE: "obstacle",
    NodeSet.FREE: "free",
}
COLUMNS = 3


@drawn
def ldems(plans: Sequence[PlanPicture], sector_rad: float, body_m: tuple[float, float]) -> Figure:
    """Small multiples in the order of the stops. sector_rad: half the scan's sector. body_m: length and width."""
    columns = min(COLUMNS, max(1, len(plans)))
    rows = math.ceil(max(1, len(plans)) / columns)
    side = PAGE_IN / COLUMNS
    made = figure(max(side * columns, 6.0), (side + 0.05 if columns > 1 else 5.4) * rows + 0.85)
    panels = made.subplots(rows, columns, squeeze=False).ravel()
    for number, (axes, plan) in enumerate(zip(panels, plans), 1):
        panel(axes, plan, sector_rad, body_m)
        axes.set_title(literal(f"stop {number}: {plan.kind}, {plan.rule}"), fontsize=10)
        if number % columns != 1 and columns > 1:
            axes.set_ylabel("")
        if number <= len(plans) - columns:
            axes.set_xlabel("")
    for axes in panels[len(plans) :]:
        axes.set_axis_off()
    made.legend(handles=legend(plans), loc="outside upper center", ncols=5, fontsize=8.5)
    return made


def set_picture(plan: PlanPicture) -> np.ndarray:
    """(rows, columns, 3) colours of the node sets and the rim, shaded by the heights where they are known."""
    picture = np.ones((*plan.node_sets.shape, 3))
    for node_set, colour in SET_COLOURS.items():
        picture[plan.node_sets == node_set] = _rgb(colour)
    picture[rim.rim(plan.node_sets, plan.heights_m, plan.grid.cell_m)] = _rgb(rim.COLOUR)
    shade = np.where(np.isfinite(plan.heights_m), 0.55 + 0.7 * hillshade(plan.heights_m, plan.grid.cell_m), 1.0)
    return np.clip(picture * shade[..., None], 0, 1)


def set_patches() -> list[Patch]:
    """Legend entries of `set_picture`."""
    colours = [(SET_NAMES[node_set], colour) for node_set, colour in SET_COLOURS.items()]
    return [
        Patch(facecolor=colour, edgecolor="#888888", label=name) for name, colour in [*colours, (rim.NAME, rim.COLOUR)]
    ]


def _rgb(colour: str) -> list[float]:
    return [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]


def panel(axes: Axes, plan: PlanPicture, sector_rad: float, body_m: tuple[float, float]) -> None:
    """The panel of one stop."""
    left, right, bottom, top = extent(plan.grid)
    axes.imshow(set_picture(plan), origin="lower", extent=(left, right, bottom, top), interpolation="nearest")
    if len(plan.optimistic_path):
        axes.plot(*plan.optimistic_path[:, :2].T, color=BLUE, linestyle=(0, (3, 2)), linewidth=1.2)
    if len(plan.path) > 1:
        axes.plot(*plan.path[:, :2].T, color=BLACK, linewidth=2)
    if len(plan.marked):
        axes.plot(*plan.marked.T, "x", color=RED, markersize=6)
    if len(plan.alternatives):
        axes.plot(*plan.alternatives[:, :2].T, "o", color=BLUE, markersize=5, markeredgecolor="white")
    if plan.kind in ("drive", "goal") and len(plan.path):
        if plan.kind == "drive":
            sector(axes, (*plan.path[-1, :2], plan.heading_rad), sector_rad)
        star(axes, plan.path[-1, :2])
    rover(axes, plan.pose, body_m)
    goal(axes, plan)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    map_axes(axes)


def legend(plans: Sequence[PlanPicture]) -> list[Patch | Line2D]:
    """Legend entries for the panels of these stops."""
    dot = {"marker": "o", "linestyle": "none", "markeredgecolor": "white"}
    lines = [
        Line2D([], [], color=BLACK, linewidth=2, label="path to drive"),
        Line2D([], [], color=BLUE, linestyle=(0, (3, 2)), label="optimistic path"),
        Line2D([], [], color=NEXT, marker="*", linestyle="none", markersize=11, label="next sensing position, sector"),
        Line2D([], [], label="goal, or the way to it", **RING),
    ]
    if any(len(plan.alternatives) for plan in plans):
        lines.append(Line2D([], [], color=BLUE, markersize=6, label="candidates", **dot))
    if any(len(plan.marked) for plan in plans):
        lines.append(Line2D([], [], color=RED, marker="x", linestyle="none", label="counted as blocked"))
    return [*set_patches(), *lines]
