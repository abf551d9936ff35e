"""A mission stop by stop: the true ground with the driven path, the decisions as text, the map at each stop."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from onboard.planning.archive import PlanPicture
from onboard.records import F64
from pictures.ldem import COLUMNS, legend, panel
from pictures.paths import spread
from pictures.style import BLACK, PAGE_IN, RED, SKY, drawn, figure, literal
from pictures.terrain import Ground, draw_ground, scale_bar

LINES_OF_TEXT = 30  # next to the ground
WIDTH_OF_TEXT = 54
TOP_IN = 4.9


@dataclass(frozen=True, slots=True)
class Story:
    """Result of a mission.

    ground, goal_m: true ground and goal.
    way: (k, 2 or more) true x, y.
    stops: (n, 2 or more) true places of the stops.
    contacts: (m, 3) x, y and whether hard.
    best: (k, 2 or more) the cheapest path on the true ground.
    plans: one for each stop.
    outcome: text.
    """

    ground: Ground
    goal_m: tuple[float, float]
    way: F64
    stops: F64
    contacts: F64
    best: F64
    plans: Sequence[PlanPicture]
    outcome: str


@drawn
def mission(story: Story, sector_rad: float, body_m: tuple[float, float]) -> Figure:
    """One page with the whole mission. sector_rad: half the scan's sector. body_m: length and width."""
    rows = math.ceil(len(story.plans) / COLUMNS)
    side = PAGE_IN / COLUMNS
    below_in = (side + 0.05) * rows + 0.75
    made = figure(PAGE_IN, TOP_IN + below_in)
    above, below = made.subfigures(2, 1, height_ratios=(TOP_IN, below_in))
    truth, words = above.subplots(1, 2, width_ratios=(1.08, 1.0))
    _truth(truth, story)
    _words(words, story)
    panels = below.subplots(rows, COLUMNS, squeeze=False).ravel()
    for number, (axes, plan) in enumerate(zip(panels, story.plans), 1):
        panel(axes, plan, sector_rad, body_m)
        axes.set_title(literal(f"stop {number}: {plan.kind}, {plan.rule}"), fontsize=10)
        axes.set_xlabel("")
        axes.set_ylabel("")
    for axes in panels[len(story.plans) :]:
        axes.set_axis_off()
    below.legend(handles=legend(story.plans), loc="outside lower center", ncols=5, fontsize=8)
    return made


def _truth(axes: Axes, story: Story) -> None:
    draw_ground(axes, story.ground)
    if len(story.best):
        axes.plot(*story.best[:, :2].T, color=SKY, linewidth=4.5, alpha=0.8, label="cheapest way of the truth")
    axes.plot(*story.way[:, :2].T, color=BLACK, linewidth=1.5, label="way driven")
    axes.plot(*story.stops[:, :2].T, "s", color="white", markeredgecolor=BLACK, markersize=6, label="stops", zorder=5)
    axes.plot(*story.goal_m, "o", color=RED, markersize=9, markeredgecolor="white", label="goal", zorder=6)
    if len(story.contacts):
        axes.plot(*story.contacts[:, :2].T, "x", color=RED, markersize=8, label="contact", zorder=7)
    for numbers, place in spread(story.stops):
        axes.annotate(numbers, place, xytext=(5, 5), textcoords="offset points", weight="bold", zorder=8)
    scale_bar(axes, 2.0)
    axes.set_title("the true ground")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, fontsize=8)


def _words(axes: Axes, story: Story) -> None:
    """The decisions and their reasons, as many as fit."""
    lines = [line for n, plan in enumerate(story.plans, 1) for line in _decision(n, plan)]
    if len(lines) > LINES_OF_TEXT - 3:
        lines = [*lines[: LINES_OF_TEXT - 4], "..."]
    lines += ["", *textwrap.wrap(story.outcome, WIDTH_OF_TEXT)]
    axes.set_axis_off()
    text = literal("\n".join(lines))
    axes.text(0.0, 1.0, text, va="top", ha="left", fontsize=8.0, linespacing=1.3, transform=axes.transAxes)


def _decision(number: int, plan: PlanPicture) -> list[str]:
    return textwrap.wrap(f"{number}. {plan.rule} {plan.kind}: {plan.reason}", WIDTH_OF_TEXT, subsequent_indent="    ")
