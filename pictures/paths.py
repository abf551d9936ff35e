"""Figure 13a of the chapter: the global path, the local paths that replaced it, and the driven path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import matplotlib.patheffects as effects
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from onboard.records import F64
from pictures.style import BLACK, BLUE, PAGE_IN, RED, SKY, drawn, figure
from pictures.terrain import Ground, draw_ground, extent, scale_bar

_MARGIN_M = 1.5
_HALO = [effects.withStroke(linewidth=3.2, foreground="white", alpha=0.75)]


@dataclass(frozen=True, slots=True)
class Ways:
    """Lines on the map, each (k, 2 or more) x, y, ...; a line without rows is not drawn.

    goal_m, tolerance_m: goal and its radius; None: no goal is known.
    global_path, local_paths: planned paths.
    estimated, true: driven path.
    stops: (n, 2 or more) places of the stops.
    earlier_goals: (m, 2) goals before the last one.
    """

    goal_m: tuple[float, float] | None
    tolerance_m: float = 0.3
    global_path: F64 = field(default_factory=lambda: np.empty((0, 2)))
    local_paths: Sequence[F64] = ()
    estimated: F64 = field(default_factory=lambda: np.empty((0, 2)))
    true: F64 = field(default_factory=lambda: np.empty((0, 2)))
    stops: F64 = field(default_factory=lambda: np.empty((0, 2)))
    earlier_goals: F64 = field(default_factory=lambda: np.empty((0, 2)))


@drawn
def paths(ground: Ground, ways: Ways) -> Figure:
    """All paths on the shaded ground, equal axes in metres, limited to the relevant area."""
    left, right, bottom, top = _window(ground, ways)
    width, height = right - left, top - bottom
    page_in = min(PAGE_IN, 7.0 * width / height + 0.7)
    made = figure(page_in, (page_in - 0.7) * height / width + 1.1)
    axes = made.subplots()
    draw_ground(axes, ground)
    if len(ground.rocks):
        axes.plot([], [], "o", markersize=8, markerfacecolor="none", markeredgecolor="#3a332b", label="rocks")
    _lines(axes, ways)
    _marks(axes, ways)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    scale_bar(axes, 1.0 if width < 12 else 2.0 if width < 30 else 10.0)
    made.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return made


def _lines(axes: Axes, ways: Ways) -> None:
    for number, path in enumerate(ways.local_paths):
        if len(path):
            name = "local paths" if number == 0 else None
            axes.plot(path[:, 0], path[:, 1], color=SKY, linewidth=6, alpha=0.75, label=name, zorder=3)
    if len(ways.global_path):
        line = ways.global_path
        axes.plot(line[:, 0], line[:, 1], color=BLUE, linestyle=(0, (5, 3)), label="global path", zorder=4, linewidth=2)
    if len(ways.true):
        axes.plot(ways.true[:, 0], ways.true[:, 1], color=BLACK, label="true way", zorder=5, linewidth=1.8)
    if len(ways.estimated):
        line = ways.estimated
        style = (0, (3, 2)) if len(ways.true) else "solid"
        axes.plot(line[:, 0], line[:, 1], color=RED, linestyle=style, label="estimated way", zorder=6, linewidth=1.6)


def _marks(axes: Axes, ways: Ways) -> None:
    goal = {"marker": "o", "color": RED, "markersize": 10, "markeredgecolor": "white", "linestyle": "none"}
    if ways.goal_m is not None:
        axes.plot(*ways.goal_m, label=f"goal, within {ways.tolerance_m:g} m", zorder=7, **goal)
        axes.add_patch(Circle(ways.goal_m, ways.tolerance_m, fill=False, color=RED, zorder=7))
    if len(ways.earlier_goals):
        axes.plot(*ways.earlier_goals.T, label="earlier goals", zorder=7, **{**goal, "markersize": 6})
    if len(ways.stops):
        style = {"marker": "s", "color": "white", "markeredgecolor": BLACK, "markersize": 6, "linestyle": "none"}
        axes.plot(ways.stops[:, 0], ways.stops[:, 1], label="stops, numbered", zorder=8, **style)
    for number, (x, y) in spread(ways.stops):
        text = axes.annotate(number, (x, y), xytext=(6, 6), textcoords="offset points", zorder=9, weight="bold")
        text.set_path_effects(_HALO)


def spread(stops: F64) -> list[tuple[str, tuple[float, float]]]:
    """Labels of stops; stops at one place share a label."""
    places: list[tuple[list[str], tuple[float, float]]] = []
    for number, stop in enumerate(stops, 1):
        here = (float(stop[0]), float(stop[1]))
        near = next((names for names, place in places if math.dist(place, here) < 0.25), None)
        if near is None:
            places.append(([str(number)], here))
        else:
            near.append(str(number))
    return [(",".join(names), place) for names, place in places]


def _window(ground: Ground, ways: Ways) -> tuple[float, float, float, float]:
    """Bounds of all lines with a margin, inside the ground; never narrower than 1 : 2."""
    lines = [
        np.array([ways.goal_m or (0.0, 0.0), (0.0, 0.0)]),
        ways.global_path,
        ways.estimated,
        ways.true,
        *ways.local_paths,
        ways.earlier_goals,
    ]
    points = np.concatenate([line[:, :2] for line in lines if len(line)])
    left, bottom = points.min(axis=0) - _MARGIN_M
    right, top = points.max(axis=0) + _MARGIN_M
    short = max(right - left, top - bottom) / 2
    grow_x, grow_y = (max(0.0, short - side) / 2 for side in (right - left, top - bottom))
    edges = extent(ground.grid)
    return (
        max(left - grow_x, edges[0]),
        min(right + grow_x, edges[1]),
        max(bottom - grow_y, edges[2]),
        min(top + grow_y, edges[3]),
    )
