"""Film of a run from above: true ground, rover, scan points, map, plan and texts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from onboard.planning.archive import PlanPicture
from onboard.records import F64
from pictures.ldem import set_picture
from pictures.style import BLACK, BLUE, GREEN, ORANGE, RED, drawn_frames, figure, literal
from pictures.terrain import Ground, draw_ground, extent, height_scale, scale_bar, shaded

WIDTH_IN, TOP_IN, WORDS_IN, DOTS_PER_INCH = 7.2, 0.35, 1.0, 100  # even numbers of dots, which some films need
RAYS, LOCAL, MAP_ALPHA = "#d627b4", "#7a2d8f", 0.55
WHEEL_M = (0.2, 0.1)


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture of a film.

    pose: x, y, heading.
    title: text above the picture.
    wheels: (4, 3) x, y, heading of each.
    points: (n, 2 or more) hit by the scanner.
    way, believed: (k, 2 or more) true and estimated path.
    plan: the last plan.
    lines: texts.
    alarm: texts in red.
    ground: the present ground, if it has changed.
    """

    pose: tuple[float, float, float]
    title: str
    wheels: F64
    points: F64
    way: F64
    believed: F64
    plan: PlanPicture | None = None
    lines: tuple[str, ...] = ()
    alarm: str = ""
    ground: Ground | None = None


class Stage:
    """A figure whose moving parts are updated for each shot."""

    def __init__(self, ground: Ground, goal_m: tuple[float, float], body_m: tuple[float, float]) -> None:
        left, right, bottom, top = extent(ground.grid)
        height_in = TOP_IN + WORDS_IN + WIDTH_IN * (top - bottom) / (right - left)
        self._figure = figure(WIDTH_IN, round(height_in / 0.04) * 0.04)
        self._figure.set_layout_engine("none")
        total = self._figure.get_figheight()
        axes = self._figure.add_axes((0.0, WORDS_IN / total, 1.0, 1.0 - (WORDS_IN + TOP_IN) / total))
        self._ground, self._soil, self._scale = ground, draw_ground(axes, ground), height_scale([ground])
        axes.set_axis_off()
        axes.plot(*goal_m, "o", markersize=11, color=RED, markeredgecolor="white", zorder=7)
        axes.set(xlim=(left, right), ylim=(bottom, top))
        scale_bar(axes, 2.0 if right - left < 30 else 10.0)
        self._body_m, self._axes = body_m, axes
        self._map: AxesImage | None = None
        self._mapped: PlanPicture | None = None
        self._lines = _lines(axes)
        self._wheels = [axes.add_patch(Polygon(np.zeros((4, 2)), facecolor=BLACK, zorder=8)) for _ in range(4)]
        self._body = axes.add_patch(Polygon(np.zeros((5, 2)), facecolor=ORANGE, edgecolor=BLACK, zorder=9))
        high = 1.0 - TOP_IN / total
        self._title = self._figure.text(0.015, (1.0 + high) / 2, "", va="center", weight="bold", family="monospace")
        self._alarm = self._figure.text(0.985, (1.0 + high) / 2, "", va="center", ha="right", color=RED, weight="bold")
        self._words = self._figure.text(0.015, (WORDS_IN - 0.08) / total, "", va="top", fontsize=9, linespacing=1.35)

    def draw(self, shot: Shot) -> NDArray[np.uint8]:
        """Draw one shot, (rows, columns, 3)."""
        self._draw_ground(shot.ground)
        self._draw_plan(shot.plan)
        plan, lines = shot.plan, self._lines
        for name, way in (
            ("points", shot.points),
            ("driven", shot.way),
            ("believed", shot.believed),
            ("global", plan.global_path if plan else _NOTHING),
            ("local", plan.path if plan else _NOTHING),
        ):
            lines[name].set_data(way[:, 0], way[:, 1])
        for patch, place in zip(self._wheels, shot.wheels):
            patch.set_xy(_placed(_SQUARE * WHEEL_M, place))
        self._body.set_xy(_placed(_ARROW * self._body_m, shot.pose))
        for text, words in ((self._title, shot.title), (self._alarm, shot.alarm), (self._words, "\n".join(shot.lines))):
            text.set_text(literal(words))
        self._figure.set_dpi(DOTS_PER_INCH)
        self._figure.canvas.draw()
        return np.asarray(self._figure.canvas.buffer_rgba())[..., :3].copy()

    def _draw_ground(self, ground: Ground | None) -> None:
        if ground is not None and ground is not self._ground:
            self._ground = ground
            self._soil.set_data(shaded(ground, self._scale))

    def _draw_plan(self, plan: PlanPicture | None) -> None:
        if plan is self._mapped:
            return
        _drop(self._map)
        self._mapped, self._map = plan, None
        if plan is not None:
            alpha = np.where(np.isfinite(plan.heights_m), MAP_ALPHA, 0.0)
            picture = np.dstack((set_picture(plan), alpha))
            x_limits, y_limits = self._axes.get_xlim(), self._axes.get_ylim()
            self._map = self._axes.imshow(picture, origin="lower", extent=extent(plan.grid), zorder=2)
            self._axes.set(xlim=x_limits, ylim=y_limits)


@drawn_frames
def film(
    ground: Ground, goal_m: tuple[float, float], body_m: tuple[float, float], shots: Iterable[Shot]
) -> Iterator[NDArray[np.uint8]]:
    """Pictures of the shots, all (rows, columns, 3) of one size, both even. body_m: length and width."""
    stage = Stage(ground, goal_m, body_m)
    for shot in shots:
        yield stage.draw(shot)


_NOTHING = np.empty((0, 2))
_SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
_ARROW = np.array([(-0.5, -0.5), (0.3, -0.5), (0.5, 0.0), (0.3, 0.5), (-0.5, 0.5)])


def _lines(axes: Axes) -> dict[str, Line2D]:
    looks = {
        "points": {"color": RAYS, "marker": ".", "markersize": 2.5, "linestyle": "none", "zorder": 3},
        "global": {"color": BLUE, "linestyle": (0, (4, 3)), "linewidth": 1.6, "zorder": 4},
        "local": {"color": LOCAL, "linewidth": 2.4, "zorder": 5},
        "believed": {"color": GREEN, "linewidth": 1.6, "zorder": 6},
        "driven": {"color": BLACK, "linewidth": 1.6, "zorder": 6},
    }
    return {name: axes.plot([], [], **look)[0] for name, look in looks.items()}


def _placed(corners: F64, place: tuple[float, ...] | F64) -> F64:
    cosine, sine = math.cos(place[2]), math.sin(place[2])
    return corners @ np.array([[cosine, sine], [-sine, cosine]]) + np.asarray(place[:2])


def _drop(artist: Artist | None) -> None:
    if artist is not None:
        artist.remove()
