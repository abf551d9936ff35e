"""The rover from above, forward upwards (+x up, +y to the left): body, wheels, axles, turning centres, paths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.transforms import Affine2D

from onboard.records import F64
from pictures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PAGE_IN, RED, SKY, drawn, figure, quiet

WHEEL_M = (0.2, 0.1)
RING = {
    "marker": "o",
    "markersize": 11,
    "markerfacecolor": "none",
    "markeredgecolor": RED,
    "markeredgewidth": 2,
    "linestyle": "none",
}
_PALE_BOX = {"boxstyle": "square,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
_ARROW = {"arrowstyle": "-|>", "color": BLACK}
_REACH = np.array([-2.5, 2.5])


@dataclass(frozen=True, slots=True)
class Turning:
    """A moving rover.

    places_m: (4, 2) in body axes.
    angles_rad: (4,) steering angles.
    twist: vx, vy, yaw rate.
    fixed: index of a stuck wheel.
    """

    title: str
    places_m: F64
    angles_rad: F64
    twist: tuple[float, float, float]
    fixed: int | None = None


def draw_wheel(axes: Axes, number: int, place_m: F64, angle_rad: float, colour: str = GREY) -> None:
    """A wheel with its number and its axle's line."""
    (a, b), (length, width) = place_m, WHEEL_M
    shape = Rectangle((-width / 2, -length / 2), width, length, facecolor=colour, edgecolor=BLACK, zorder=4)
    shape.set_transform(Affine2D().rotate(angle_rad).translate(-b, a) + axes.transData)
    axes.add_patch(shape)
    along = (-b + _REACH * math.cos(angle_rad), a + _REACH * math.sin(angle_rad))
    axes.plot(*along, color=BLUE if colour == GREY else colour, linewidth=0.8, zorder=2)
    axes.text(-b, a, str(number), color="white", ha="center", va="center", fontsize=8, zorder=5)


def draw_angle(axes: Axes, place_m: F64, angle_rad: float) -> None:
    """A wheel's steering angle next to it, in degrees."""
    a, b = place_m
    axes.text(
        (-1 if b > 0 else 1) * 0.48,
        math.copysign(0.62, a),
        f"{math.degrees(angle_rad):+.1f}°",
        ha="center",
        va="center",
        fontsize=8.5,
        bbox=_PALE_BOX,
        zorder=6,
    )


def draw_body(axes: Axes) -> None:
    """The deck between the wheels, and the frame of the picture."""
    axes.add_patch(Rectangle((-0.14, -0.375), 0.28, 0.75, facecolor="white", edgecolor=BLACK, zorder=3))
    axes.set_aspect("equal")
    axes.set(xlim=(-1.4, 1.4), ylim=(-0.85, 0.85))
    axes.set_xlabel("to the right, m")
    axes.set_ylabel("ahead, m")


@drawn
def turning(rovers: Sequence[Turning]) -> Figure:
    """Four rovers, each with its axles, which meet in the ring, and the path of base_link."""
    made = figure(PAGE_IN, 6.4)
    for axes, rover in zip(made.subplots(2, 2).ravel(), rovers):
        for k, (place, angle) in enumerate(zip(rover.places_m, rover.angles_rad)):
            draw_angle(axes, place, float(angle))
            draw_wheel(axes, k + 1, place, float(angle), ORANGE if k == rover.fixed else GREY)
        draw_body(axes)
        vx, vy, yaw = rover.twist
        speed = math.hypot(vx, vy)
        if speed > 1e-9:
            tip = (-0.3 * vy / speed, 0.3 * vx / speed)
            axes.annotate("", tip, (0, 0), arrowprops=_ARROW, zorder=7)
        if abs(yaw) > 1e-9:
            axes.plot(-vx / yaw, -vy / yaw, **RING, zorder=7)
        axes.set_title(rover.title)
    return made


@drawn
def carrots(ways: Sequence[tuple[str, F64]], law: Sequence[tuple[str, F64]]) -> Figure:
    """Distances from a straight path, each (k, 2) of path length and distance, m; the carrot and the other laws."""
    made = figure(PAGE_IN, 3.3)
    colours = (RED, ORANGE, BLUE, GREEN, SKY)
    for axes, lines, title in zip(
        made.subplots(1, 2, sharey=True),
        (ways, law),
        ("the chapter's carrot, $K_p$ 0.22 / s", "as it flies, L = 0.35 m"),
    ):
        for (name, line), colour in zip(lines, colours):
            axes.plot(line[:, 0], 1000.0 * line[:, 1], color=colour, label=name)
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        axes.set_title(title)
        axes.set_xlabel("way, m")
        axes.margins(x=0)
        quiet(axes)
        axes.legend(loc="upper right")
    made.axes[0].set_ylabel("to the left of the path, mm")
    return made
