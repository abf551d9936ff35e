"""Pictures of a campaign: success against a knob, spread of a figure, errors against their sigma."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from onboard.records import F64
from pictures.style import BLUE, GREEN, GREY, ORANGE, PALE, RED, SKY, drawn, figure, literal, quiet


class ShareBar(NamedTuple):
    """Share of a class with its interval, 0 to 1. cases: number of its cases."""

    name: str
    ratio: float
    low: float
    high: float
    cases: int


@drawn
def shares(bars: Sequence[ShareBar], title: str, along: str) -> Figure:
    """Draw the share of each class of a knob. along: name of the knob."""
    made = figure(4.4, 3.2)
    axes = made.subplots()
    at = np.arange(len(bars))
    ratios = np.array([bar.ratio for bar in bars])
    below, above = ratios - [bar.low for bar in bars], np.array([bar.high for bar in bars]) - ratios
    axes.bar(at, ratios, color=PALE, width=0.7)
    axes.errorbar(at, ratios, np.clip([below, above], 0, None), fmt="o", color=BLUE, capsize=4, markersize=5)
    for x, bar in zip(at, bars):
        axes.text(x, 0.02, f"{bar.cases}", ha="center", va="bottom", color=GREY, fontsize=8)
    axes.set_ylim(0.0, 1.05)
    axes.set_xticks(at, [literal(bar.name) for bar in bars], rotation=0 if len(bars) < 4 else 20, fontsize=8)
    axes.set_xlabel(literal(along))
    axes.set_ylabel("share at the goal")
    axes.set_title(literal(title), fontsize=10)
    quiet(axes)
    return made


@drawn
def spread(values: F64, title: str, along: str, mark: float | None = None) -> Figure:
    """Draw how a figure is spread, as the share of the cases up to each value.

    values: (n,). mark: value to mark with a line.
    """
    made = figure(4.4, 3.2)
    axes = made.subplots()
    rising = np.sort(values)
    axes.step(rising, (np.arange(len(rising)) + 1) / len(rising), where="post", color=BLUE)
    nine_of_ten = float(rising[math.ceil(0.9 * len(rising)) - 1])
    marks = ((0.5, float(np.median(rising)), "median", GREEN), (0.9, nine_of_ten, "nine of ten", ORANGE))
    for ratio, at, name, colour in marks:
        axes.plot([at, at], [0.0, ratio], color=colour, linestyle=(0, (4, 3)), label=f"{name} {at:.3g}")
    if mark is not None:
        axes.axvline(mark, color=GREY, linewidth=0.8)
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel(literal(along))
    axes.set_ylabel("share of the cases up to it")
    axes.set_title(literal(title), fontsize=10)
    axes.legend(loc="upper left")
    axes.locator_params(axis="x", nbins=6)
    quiet(axes)
    return made


@drawn
def errors(sigma_m: F64, error_m: F64, title: str) -> Figure:
    """Draw the error of the reported place against the filter's own sigma at the end of each case, both (n,), m."""
    made = figure(4.4, 3.2)
    axes = made.subplots()
    most = 1.1 * float(max(sigma_m.max(), 1e-3))
    far = error_m > 3 * sigma_m
    line = np.array([0.0, most])
    for times, colour in ((1, SKY), (3, GREY)):
        axes.plot(line, times * line, color=colour, linewidth=1.2, label=f"{times} sigma")
    axes.plot(sigma_m[~far], error_m[~far], "o", color=BLUE, markersize=4, label="case")
    if far.any():
        axes.plot(sigma_m[far], error_m[far], "o", color=RED, markersize=5, label="over 3 sigma")
    axes.set_xlim(0.0, most)
    axes.set_ylim(0.0, None)
    axes.set_xlabel("sigma of the filter, m")
    axes.set_ylabel("error of the reported place, m")
    axes.set_title(literal(title), fontsize=10)
    axes.legend(loc="upper left")
    axes.locator_params(axis="x", nbins=6)
    quiet(axes)
    return made
