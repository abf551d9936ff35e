"""Map in half-blocks: two picture elements in each character, one above the other.

A terminal's character is about twice as high as wide, so its upper and lower half are nearly square. `draw` colours
the elements (map, path, trail, goal), then puts the rover's arrow over them. North (+y) is up, east (+x) is right.

    columns x rows characters  ->  columns x 2 rows elements  ->  "▀" with two colours in each character
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.color import Color
from rich.style import Style
from rich.text import Text

from protocol.products import LdemProduct

Place = tuple[float, float]
Colour = tuple[int, int, int]
Sign = tuple[str, Colour]
Pixels = NDArray[np.uint8]  # (2 rows, columns, 3) RGB, row 0 at the top
FREE, OBSTACLE, HIDDEN, NOTHING = (0, 150, 110), (213, 94, 0), (110, 110, 118), (22, 24, 30)
PATH, TRAIL, GOAL = (86, 180, 233), (245, 245, 245), (240, 228, 66)
_NODE_SETS = np.array([NOTHING, HIDDEN, OBSTACLE, FREE], np.float64)  # by node set 0 to 3
_ARROWS = "→↗↑↖←↙↓↘"  # by eighths of a turn from east
_LEAST_SPAN_M, _MARGIN_M = 4.0, 0.5
_SHADES = 12  # steps of brightness: fewer changes of colour to send over ssh
_SHADE = 0.65  # darkest share of a colour on the lowest ground


class Scene(NamedTuple):
    """Content of the map, in the map frame, m.

    terrain: newest fetched map, or None.
    rover: x, y and yaw (rad), or None.
    trail: places where the rover was.
    path: corners of the predicted path.
    goal: or None.
    """

    terrain: LdemProduct | None = None
    rover: tuple[float, float, float] | None = None
    trail: Sequence[Place] = ()
    path: Sequence[Place] = ()
    goal: Place | None = None


class Window(NamedTuple):
    """Part of the map frame that is drawn: its centre, and the size of an element, m."""

    x_m: float
    y_m: float
    element_m: float


def window(scene: Scene, columns: int, rows: int, zoom: int) -> Window:
    """Window for a picture of columns x rows characters.

    zoom 0: all that is known fits; each step more halves the span, around the rover.
    """
    corners = [*scene.trail, *scene.path, *([scene.goal] if scene.goal else [])]
    if scene.rover:
        corners.append(scene.rover[:2])
    if scene.terrain is not None:
        corners += _known_corners(scene.terrain)
    xs, ys = ([corner[axis] for corner in corners] or [0.0] for axis in (0, 1))
    wide_m, high_m = (max(max(v) - min(v) + 2 * _MARGIN_M, _LEAST_SPAN_M) for v in (xs, ys))
    element_m = max(wide_m / columns, high_m / (2 * rows)) / 2**zoom
    if zoom and scene.rover:
        return Window(scene.rover[0], scene.rover[1], element_m)
    return Window((min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2, element_m)


def draw(scene: Scene, frame: Window, columns: int, rows: int) -> Text:
    """Draw the scene as `rows` lines of `columns` characters."""
    pixels = _terrain(scene.terrain, frame, columns, rows)
    _mark(pixels, frame, _points_along(scene.path, frame.element_m), PATH)
    _mark(pixels, frame, scene.trail, TRAIL)
    text = Text(no_wrap=True, end="")
    signs = _signs(scene, frame, columns, rows)
    for row in range(rows):
        cells = [_cell(pixels[2 * row : 2 * row + 2, column], signs.get((row, column))) for column in range(columns)]
        for (colours, bold), run in groupby(cells, key=lambda cell: cell[1:]):
            text.append("".join(sign for sign, *_ in run), _style(colours, bold))
        if row < rows - 1:
            text.append("\n")
    return text


def _cell(halves: Pixels, sign: Sign | None) -> tuple[str, tuple[Colour, Colour], bool]:
    """Character, its two colours, bold or not."""
    if sign is not None:
        return sign[0], (sign[1], NOTHING), True
    upper, lower = ((int(half[0]), int(half[1]), int(half[2])) for half in halves)
    return "▀", (upper, lower), False


@lru_cache(maxsize=4096)
def _style(colours: tuple[Colour, Colour], bold: bool) -> Style:
    return Style(color=Color.from_rgb(*colours[0]), bgcolor=Color.from_rgb(*colours[1]), bold=bold)


def element_of(x_m: float, y_m: float, frame: Window, columns: int, rows: int) -> tuple[int, int]:
    """(row, column) of the element of a place; it may lie outside the picture."""
    column = math.floor((x_m - frame.x_m) / frame.element_m + columns / 2)
    row = math.floor((frame.y_m - y_m) / frame.element_m + rows)
    return row, column


def _terrain(terrain: LdemProduct | None, frame: Window, columns: int, rows: int) -> Pixels:
    pixels = np.full((2 * rows, columns, 3), NOTHING, np.uint8)
    if terrain is None:
        return pixels
    grid = terrain.grid
    x_m = frame.x_m + (np.arange(columns) + 0.5 - columns / 2) * frame.element_m
    y_m = frame.y_m - (np.arange(2 * rows) + 0.5 - rows) * frame.element_m
    j, i = np.rint((x_m - grid.x0_m) / grid.cell_m).astype(int), np.rint((y_m - grid.y0_m) / grid.cell_m).astype(int)
    inside = ((i >= 0) & (i < grid.rows))[:, None] & ((j >= 0) & (j < grid.columns))[None, :]
    cells = np.ix_(np.clip(i, 0, grid.rows - 1), np.clip(j, 0, grid.columns - 1))
    colours = _NODE_SETS[terrain.node_sets[cells]] * _shade(terrain.heights_m[cells], terrain.heights_m)[..., None]
    return np.where(inside[..., None], colours, pixels).astype(np.uint8)


def _shade(heights_m: NDArray[np.float32], whole_m: NDArray[np.float32]) -> NDArray[np.float64]:
    """Brightness by height; 1 where the height is not known."""
    if not np.isfinite(whole_m).any():
        return np.ones(heights_m.shape)
    low_m, high_m = (float(v) for v in np.nanpercentile(whole_m, (2, 98)))
    ratio = np.clip((heights_m - low_m) / max(high_m - low_m, 0.05), 0.0, 1.0)
    return np.where(np.isfinite(heights_m), _SHADE + (1 - _SHADE) * np.round(ratio * _SHADES) / _SHADES, 1.0)


def _known_corners(terrain: LdemProduct) -> list[Place]:
    known = np.argwhere(terrain.node_sets > 0)
    if not len(known):
        return []
    grid, (low, high) = terrain.grid, (known.min(axis=0), known.max(axis=0))
    return [(grid.x0_m + int(j) * grid.cell_m, grid.y0_m + int(i) * grid.cell_m) for i, j in (low, high)]


def _mark(pixels: Pixels, frame: Window, places: Iterable[Place], colour: Colour) -> None:
    high, columns = pixels.shape[:2]
    for x_m, y_m in places:
        row, column = element_of(x_m, y_m, frame, columns, high // 2)
        if 0 <= row < high and 0 <= column < columns:
            pixels[row, column] = colour


def _points_along(path: Sequence[Place], step_m: float) -> Iterable[Place]:
    """Points along a path, no further apart than a step."""
    for (x0, y0), (x1, y1) in pairwise(path):
        count = max(1, math.ceil(math.hypot(x1 - x0, y1 - y0) / step_m))
        yield from ((x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count) for k in range(count + 1))


def _signs(scene: Scene, frame: Window, columns: int, rows: int) -> dict[tuple[int, int], Sign]:
    """(row, column) of characters -> sign and colour: the goal, and over it the rover's arrow."""
    signs: dict[tuple[int, int], Sign] = {}
    if scene.goal:
        row, column = element_of(*scene.goal, frame, columns, rows)
        signs[row // 2, column] = ("◎", GOAL)
    if scene.rover:
        x_m, y_m, yaw_rad = scene.rover
        row, column = element_of(x_m, y_m, frame, columns, rows)
        signs[row // 2, column] = (_ARROWS[round(yaw_rad / (math.pi / 4)) % 8], TRAIL)
    return signs
