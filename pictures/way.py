"""A predicted path on the rover's map: known ground, path to drive, straight rest to the goal."""

from __future__ import annotations

from typing import NamedTuple

from matplotlib.figure import Figure

from onboard.records import F32, F64, U8, Grid
from pictures.ldem import set_patches, set_picture
from pictures.style import BLACK, BLUE, RED, drawn, figure, literal
from pictures.terrain import extent, map_axes


class Sets(NamedTuple):
    """Map of a prediction.

    heights_m: (rows, columns), NaN unknown.
    node_sets: (rows, columns) uint8 of NodeSet.
    """

    grid: Grid
    heights_m: F32
    node_sets: U8


@drawn
def way(sets: Sets, path: F64, beyond: F64, goal_m: tuple[float, float], title: str) -> Figure:
    """Draw a predicted path.

    path: (k, 2 or more) x, y to drive.
    beyond: (m, 2) x, y of the rest to the goal; may have no rows.
    """
    made = figure(7.0, 7.4)
    axes = made.subplots()
    axes.imshow(set_picture(sets), origin="lower", extent=extent(sets.grid), interpolation="nearest")
    if len(beyond):
        axes.plot(beyond[:, 0], beyond[:, 1], color=BLUE, linestyle=(0, (4, 3)), label="hoped for, not seen yet")
    axes.plot(path[:, 0], path[:, 1], color=RED, linewidth=2.2, label="to be driven")
    axes.plot(*path[0, :2], "s", color=BLACK, markeredgecolor="white", markersize=8, linestyle="none", label="rover")
    axes.plot(*goal_m, "o", color=RED, markeredgecolor="white", markersize=9, linestyle="none", label="goal")
    map_axes(axes)
    axes.set_title(literal(title), fontsize=10)
    made.legend(handles=[*axes.get_legend_handles_labels()[0], *set_patches()], loc="outside lower center", ncols=4)
    return made
