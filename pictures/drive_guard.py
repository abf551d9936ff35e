"""View of the drive guard when it stops: its last scan line from the side, and its strip of the ground from above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from onboard.config import Config
from onboard.perception.map.cell_classes import classify
from onboard.planning.guard.drive_guard import Bad
from onboard.planning.guard.guarded_leg import Leg
from onboard.records import F64, Cloud, Pose
from pictures.style import BLACK, BLUE, GREEN, GREY, PAGE_IN, RED, drawn, figure

_WAY_M = (-0.6, 3.6)
_NEAR_M = 0.12  # of the section: beams and cells this near to the middle of the leg


@dataclass(frozen=True, slots=True)
class GuardedLegEnd:
    """State of the drive guard at the end of a leg along +x.

    leg: the leg.
    line: last scan line.
    pose: pose of the rover.
    bad: hazards found.
    ground_m: (n, 2) x and true height along its middle.
    """

    leg: Leg
    line: Cloud
    pose: Pose
    bad: tuple[Bad, ...]
    ground_m: F64


@drawn
def guard_figure(at: GuardedLegEnd, config: Config) -> Figure:
    """Above: rover, scanner, line and true ground from the side. Below: heights of the strip, tracks, hazards."""
    page = figure(PAGE_IN, 6.4)
    side, above = page.subplots(2, 1, height_ratios=[1.0, 1.25])
    _side(side, at, config)
    _above(above, page, at, config)
    return page


def _side(axes: Axes, at: GuardedLegEnd, config: Config) -> None:
    rover, x = config.rover, at.pose.x_m
    axes.fill_between(*at.ground_m.T, -0.3, color="#d9d0c3")
    axes.plot(*at.ground_m.T, color=GREY)
    deck = (x - rover.half_wheelbase_m, rover.belly_m)
    axes.add_patch(Rectangle(deck, 2 * rover.half_wheelbase_m, 0.35, facecolor="white", edgecolor=BLACK))
    for end in (-1, 1):
        place = (x + end * rover.half_wheelbase_m, rover.wheel_radius_m)
        axes.add_patch(Circle(place, rover.wheel_radius_m, facecolor="white", edgecolor=BLACK))
    axes.plot(x + rover.lidar_x_m, rover.lidar_z_m, "s", color=BLUE)
    ends = at.line.ends_m[at.line.hit & (np.abs(at.line.ends_m[:, 1]) < _NEAR_M)]
    for end_x, _, end_z in ends[::4]:
        axes.plot([x + rover.lidar_x_m, end_x], [rover.lidar_z_m, end_z], color=BLUE, linewidth=0.8)
    axes.set(xlim=_WAY_M, ylim=(-0.25, 0.85), aspect="equal", ylabel="height (m)")
    axes.set_title("The line that stopped it, held at 40° down")


def _above(axes: Axes, page: Figure, at: GuardedLegEnd, config: Config) -> None:
    grid, cell_m = at.leg.watch.surface.grid, at.leg.watch.surface.grid.cell_m
    heights = classify(at.leg.watch.strip, config.mapping).z_mean
    west, south = grid.x0_m - cell_m / 2, grid.y0_m - cell_m / 2
    extent = (west, west + grid.columns * cell_m, south, south + grid.rows * cell_m)
    shown = axes.imshow(100.0 * heights, origin="lower", extent=extent, cmap="cividis", vmin=-12, vmax=2)
    page.colorbar(shown, ax=axes, label="height in the strip (cm)", shrink=0.9)
    j, i = np.nonzero(at.leg.ahead)
    axes.plot(grid.x0_m + i * cell_m, grid.y0_m + j * cell_m, ".", color=GREEN, markersize=3, label="wheels' way")
    axes.plot([cell.x_m for cell in at.bad], [cell.y_m for cell in at.bad], "x", color=RED, label="stops the rover")
    body = (at.pose.x_m - config.rover.body_length_m / 2, -config.rover.body_width_m / 2)
    axes.add_patch(Rectangle(body, config.rover.body_length_m, config.rover.body_width_m, fill=False, edgecolor=BLACK))
    axes.set(xlim=_WAY_M, ylim=(-1.2, 1.2), aspect="equal", xlabel="along the way (m)", ylabel="across (m)")
    axes.set_title("Its strip map, and the cells that are blocked from now on")
    axes.legend(loc="upper left")
