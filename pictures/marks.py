"""Marks that pictures of a stop's plan share: rover, goal, next sensing position and its sector."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon, Wedge

from onboard.planning.archive import PlanPicture
from onboard.records import F64
from pictures.style import BLACK, RED
from pictures.terrain import extent

NEXT = "#7a2d8f"
RING = {
    "marker": "o",
    "markersize": 11,
    "markerfacecolor": "none",
    "markeredgecolor": RED,
    "markeredgewidth": 2,
    "linestyle": "none",
}
SECTOR_M = 2.0


def star(axes: Axes, place_m: F64) -> None:
    """The next sensing position."""
    axes.plot(*place_m, "*", color=NEXT, markersize=12, markeredgecolor="white", zorder=6)


def sector(
    axes: Axes, pose: tuple[float, float, float], half_rad: float, colour: str = NEXT, reach_m: float = SECTOR_M
) -> None:
    """The sector of a scan from x, y, heading, limited to `reach_m`."""
    x, y, heading = pose
    a, b = (math.degrees(heading + part) for part in (-half_rad, half_rad))
    axes.add_patch(Wedge((x, y), reach_m, a, b, facecolor=colour, alpha=0.22, edgecolor=colour, linewidth=1))


def goal(axes: Axes, plan: PlanPicture) -> None:
    """The goal, or an arrow towards it at the map's edge."""
    left, right, bottom, top = extent(plan.grid)
    rim = 0.04 * (right - left)
    inside = np.clip(plan.goal_m, (left + rim, bottom + rim), (right - rim, top - rim))
    away = plan.goal_m - plan.pose[:2]
    beyond = not np.array_equal(inside, plan.goal_m)
    if beyond:
        marker = (3, 0, math.degrees(math.atan2(away[1], away[0])) - 90)
        axes.plot(*inside, marker=marker, color=RED, markersize=10, markeredgecolor="white", zorder=7)
    else:
        axes.plot(*inside, **RING, zorder=7)


def rover(axes: Axes, pose: np.ndarray, body_m: tuple[float, float]) -> None:
    """The body's outline with a pointed nose."""
    outline = np.array([(-0.5, -0.5), (0.3, -0.5), (0.5, 0), (0.3, 0.5), (-0.5, 0.5)]) * body_m
    cosine, sine = math.cos(pose[3]), math.sin(pose[3])
    corners = outline @ np.array([[cosine, sine], [-sine, cosine]]) + pose[:2]
    axes.add_patch(Polygon(corners, facecolor="white", edgecolor=BLACK, linewidth=1.2, zorder=5))
