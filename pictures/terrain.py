"""Shaded ground under a light from the north-west, with its rocks; true ground and the orbiter's map of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from onboard.records import F32, F64, Gdem, Grid
from pictures.style import PAGE_IN, RED, drawn, figure, literal

AZIMUTH_RAD, ALTITUDE_RAD = np.radians(135.0), np.radians(45.0)  # counter-clockwise from +x: from the north-west
SOIL = LinearSegmentedColormap.from_list("soil", ["#a89c8b", "#cfc6b8", "#f4f0e8"])
_NOTHING = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Ground:
    """Ground of a picture.

    grid: its grid.
    heights_m: (rows, columns) float32, NaN unknown.
    rocks: (n, 3) x, y, diameter.
    name: title.
    """

    grid: Grid
    heights_m: F32
    rocks: F64 = field(default_factory=lambda: np.empty((0, 3)))
    name: str = "the ground"


def ground_of(gdem: Gdem) -> Ground:
    """The orbiter's map as ground."""
    return Ground(gdem.grid, gdem.heights_m, name="the orbiter's map")


def extent(grid: Grid) -> tuple[float, float, float, float]:
    """Left, right, bottom, top edge of a grid, m."""
    half = grid.cell_m / 2
    x0, y0 = grid.x0_m - half, grid.y0_m - half
    return x0, x0 + grid.columns * grid.cell_m, y0, y0 + grid.rows * grid.cell_m


def hillshade(heights_m: F32, cell_m: float, exaggeration: float = 1.5) -> NDArray[np.float64]:
    """Brightness 0..1 of each cell under the light, (rows, columns); next to unknown cells it uses the known ones."""
    known = np.isfinite(heights_m)
    filled = np.where(known, heights_m, np.nanmean(heights_m) if known.any() else 0.0).astype(np.float64) * exaggeration
    slope_y, slope_x = np.gradient(filled, cell_m)
    blind = ~known | ~np.roll(known, 1, 0) | ~np.roll(known, -1, 0) | ~np.roll(known, 1, 1) | ~np.roll(known, -1, 1)
    slope_x, slope_y = np.where(blind, 0.0, slope_x), np.where(blind, 0.0, slope_y)
    light = np.array([np.cos(ALTITUDE_RAD) * np.cos(AZIMUTH_RAD), np.cos(ALTITUDE_RAD) * np.sin(AZIMUTH_RAD)])
    up = np.sin(ALTITUDE_RAD) - slope_x * light[0] - slope_y * light[1]
    return np.clip(up / np.sqrt(1 + slope_x**2 + slope_y**2), 0.0, 1.0)


def height_scale(grounds: Sequence[Ground]) -> Normalize:
    """One colour scale for the heights of all grounds."""
    heights = np.concatenate([ground.heights_m.ravel() for ground in grounds])
    known = heights[np.isfinite(heights)]
    return Normalize(*(np.percentile(known, (1, 99)) if len(known) else (0, 1)), clip=True)


def draw_ground(axes: Axes, ground: Ground, scale: Normalize | None = None) -> AxesImage:
    """Shaded ground with its rocks on map axes in metres; returns the image, whose colours are heights."""
    scale = scale or height_scale([ground])
    picture = shaded(ground, scale)
    image = axes.imshow(picture, origin="lower", extent=extent(ground.grid), interpolation="nearest", zorder=0)
    image.set_cmap(SOIL)
    image.set_norm(scale)
    draw_rocks(axes, ground.rocks)
    map_axes(axes)
    return image


def shaded(ground: Ground, scale: Normalize) -> NDArray[np.float64]:
    """The ground's picture under the light, (rows, columns, 3)."""
    heights = ground.heights_m.astype(np.float64)
    colour = SOIL(scale(np.nan_to_num(heights)))[..., :3]
    bright = 0.35 + 0.85 * hillshade(ground.heights_m, ground.grid.cell_m)
    picture: NDArray[np.float64] = np.clip(colour * bright[..., None], 0, 1)
    picture[~np.isfinite(heights)] = _NOTHING
    return picture


def draw_rocks(axes: Axes, rocks: F64) -> None:
    """The outlines of rocks, (n, 3) x, y, diameter."""
    if len(rocks):
        discs = [Circle((x, y), d / 2) for x, y, d in rocks]
        axes.add_collection(PatchCollection(discs, facecolor="none", edgecolor="#3a332b", linewidth=0.7, zorder=1))


def map_axes(axes: Axes) -> None:
    """East and north in metres, with equal scale."""
    axes.set_aspect("equal")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(nbins=9, steps=(1, 2, 5, 10), integer=True))
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")


def scale_bar(axes: Axes, length_m: float) -> None:
    """A bar of this length at the lower right, on a pale patch."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    x, y = right - length_m - 0.03 * (right - left), bottom + 0.03 * (top - bottom)
    axes.plot([x, x + length_m], [y, y], color="black", linewidth=3, solid_capstyle="butt", zorder=9)
    box = {"boxstyle": "square,pad=0.25", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    above = y + 0.02 * (top - bottom)
    axes.text(x + length_m / 2, above, f"{length_m:g} m", ha="center", va="bottom", bbox=box, zorder=9)


@drawn
def terrain(known: Ground, truth: Ground | None, goal_m: tuple[float, float] | None) -> Figure:
    """The orbiter's map and, if given, the true ground with its rocks, side by side."""
    grounds = [known] if truth is None else [truth, known]
    scale = height_scale(grounds)
    made = figure(PAGE_IN if truth else PAGE_IN * 0.62, 4.9 if truth else 5.2)
    panels = made.subplots(1, len(grounds), squeeze=False)[0]
    for axes, ground in zip(panels, grounds):
        image = draw_ground(axes, ground, scale)
        if goal_m is not None:
            axes.plot(*goal_m, marker="o", markersize=9, color=RED, markeredgecolor="white", linestyle="none")
        axes.plot(0, 0, marker="^", markersize=9, color="black", markeredgecolor="white", linestyle="none")
        note = f", {len(ground.rocks)} rocks" if len(ground.rocks) else ""
        axes.set_title(f"{literal(ground.name)}\n{ground.grid.cell_m:g} m cells{note}")
        left, right, bottom, top = extent(grounds[0].grid)
        axes.set(xlim=(left, right), ylim=(bottom, top))
    made.colorbar(image, ax=panels, label="height, m", location="bottom", shrink=0.5, aspect=40)
    return made
