"""Pictures of `docs/as-printed.md`: the chapter's equations as printed, and the flown ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

from onboard.records import F64, I32, Grid
from pictures.style import BLACK, PAGE_IN, RED, drawn, figure, quiet
from pictures.terrain import Ground, draw_ground, draw_rocks, extent, hillshade, map_axes
from pictures.wheels import RING, draw_angle, draw_body, draw_wheel


@dataclass(frozen=True, slots=True)
class Scores:
    """Score E over a grid of nodes.

    score: (rows, columns), NaN where there is none.
    climbs: (k, 2) nodes j, i.
    best: the chosen node.
    """

    title: str
    score: F64
    climbs: Sequence[I32] = ()
    best: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class WheelSteering:
    """Wheels of a rover for a turn.

    places_m: (4, 2) in body axes.
    angles_rad: (4,) steering angles.
    v_mps, rate_radps: the commanded turn.
    """

    title: str
    places_m: F64
    angles_rad: F64
    v_mps: float
    rate_radps: float


@drawn
def visibility(ground: Ground, nodes: Grid, maps: Sequence[tuple[str, F64]]) -> Figure:
    """The ground and Vis of each of its nodes by several rules, all on one scale from 0 to 1."""
    made = figure(PAGE_IN * 0.78, 7.6)
    panels = made.subplots(2, 2).ravel()
    draw_ground(panels[0], ground)
    panels[0].set_title("the ground\n")
    for axes, (title, vis) in zip(panels[1:], maps):
        image = axes.imshow(
            vis, origin="lower", extent=extent(nodes), vmin=0, vmax=1, cmap="viridis", interpolation="nearest"
        )
        axes.set_title(f"{title}\nmedian Vis {np.median(vis):.3f}")
        map_axes(axes)
    made.colorbar(image, ax=panels, label="Vis", location="bottom", shrink=0.5, aspect=40)
    return made


@drawn
def search(ground: Ground, nodes: Grid, goal_m: tuple[float, float], answers: Sequence[Scores]) -> Figure:
    """E by several rules, with the climbs over it and the chosen node."""
    made = figure(PAGE_IN, 5.3)
    for axes, answer in zip(made.subplots(1, len(answers)), answers):
        axes.imshow(
            hillshade(ground.heights_m, ground.grid.cell_m),
            origin="lower",
            extent=extent(ground.grid),
            cmap="gray",
            vmin=0.2,
            vmax=1.2,
            interpolation="nearest",
        )
        image = axes.imshow(
            answer.score, origin="lower", extent=extent(nodes), cmap="viridis", alpha=0.75, interpolation="nearest"
        )
        for climb in answer.climbs:
            x, y = nodes.x0_m + climb[:, 1] * nodes.cell_m, nodes.y0_m + climb[:, 0] * nodes.cell_m
            axes.plot(x, y, color="white", linewidth=2.6)
            axes.plot(x, y, color=BLACK, linewidth=1.2)
            axes.plot(x[0], y[0], "o", color="white", markeredgecolor=BLACK, markersize=6)
            axes.plot(x[-1], y[-1], "X", color=RED, markeredgecolor="white", markersize=9)
        draw_rocks(axes, ground.rocks)
        if answer.best is not None:
            axes.plot(*nodes.centre(*answer.best), "*", color="white", markeredgecolor=BLACK, markersize=16)
        axes.plot(*goal_m, **RING)
        axes.set_title(answer.title)
        map_axes(axes)
        made.colorbar(image, ax=axes, location="bottom", shrink=0.8, label="E")
    dot = {"color": "none", "markeredgecolor": BLACK, "markerfacecolor": "white"}
    made.legend(
        loc="outside upper center",
        ncols=4,
        handles=[
            Line2D([], [], marker="o", markersize=6, label="start of a climb", **dot),
            Line2D(
                [],
                [],
                marker="X",
                markersize=9,
                color="none",
                markerfacecolor=RED,
                markeredgecolor="white",
                label="where it was cut off",
            ),
            Line2D([], [], marker="*", markersize=15, label="best node", **dot),
            Line2D([], [], label="goal", **RING),
        ],
    )
    return made


@drawn
def steering(turns: Sequence[WheelSteering], rates_radps: F64, rims_mps: Sequence[tuple[str, F64]]) -> Figure:
    """Wheels from above with their axles, and the rim speed of wheel 1 over the rate of turn."""
    made = figure(PAGE_IN, 2.9)
    *plans, chart = made.subplots(1, len(turns) + 1, width_ratios=[1.25] * len(turns) + [1])
    for axes, turn in zip(plans, turns):
        _rover(axes, turn)
    for (name, rim), (colour, style) in zip(rims_mps, ((RED, "-"), (BLACK, (0, (5, 2))))):
        chart.plot(rates_radps, rim, color=colour, linestyle=style, label=name)
    chart.set_title("rim speed of wheel 1")
    chart.set_xlabel("rate of turn, rad/s")
    chart.set_ylabel("m/s")
    chart.margins(x=0)
    chart.set_ylim(0, 0.2)
    chart.set_yticks(np.arange(0, 0.21, 0.05))
    quiet(chart)
    chart.legend(loc="upper left")
    return made


def _rover(axes: Axes, turn: WheelSteering) -> None:
    """Plan view, forward upwards: map +x up, +y to the left."""
    centre = -turn.v_mps / turn.rate_radps  # across the picture: left is -x here
    for number, (place, angle) in enumerate(zip(turn.places_m, turn.angles_rad), 1):
        draw_angle(axes, place, float(angle))
        draw_wheel(axes, number, place, float(angle))
    draw_body(axes)
    axes.annotate("", (0, 0.3), (0, -0.1), arrowprops={"arrowstyle": "-|>", "color": BLACK}, zorder=6)
    axes.plot(centre, 0, **RING, zorder=6)
    axes.set_title(turn.title)


@drawn
def fractal(sizes: Sequence[int], sigmas: Sequence[tuple[str, F64]], grounds: Sequence[Ground]) -> Figure:
    """Ratio of sigma measured over the map's size, and the effect of the frequencies on the ground."""
    made = figure(PAGE_IN, 3.7)
    chart, *maps = made.subplots(1, 1 + len(grounds), width_ratios=[1.25] + [1] * len(grounds))
    for (name, sigma), (colour, marker) in zip(sigmas, ((RED, "s"), (BLACK, "o"))):
        chart.plot(sizes, sigma, color=colour, marker=marker, markersize=5, label=name)
    chart.set_xscale("log")
    chart.xaxis.set_major_locator(FixedLocator(list(sizes)))
    chart.xaxis.set_major_formatter(FixedFormatter([str(size) for size in sizes]))
    chart.xaxis.set_minor_locator(NullLocator())
    chart.set_ylim(0, 1.35)
    chart.set_xlabel("cells of the map's side")
    chart.set_ylabel("sigma found / sigma asked for")
    quiet(chart)
    chart.legend(loc="upper right")
    for axes, ground in zip(maps, grounds):
        axes.imshow(
            hillshade(ground.heights_m, ground.grid.cell_m),
            origin="lower",
            extent=extent(ground.grid),
            cmap="gray",
            vmin=0.2,
            vmax=1,
            interpolation="nearest",
        )
        axes.set_title(ground.name)
        map_axes(axes)
    return made
