"""Telemetry over time: one panel for each item, its limits shaded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from onboard.records import F64
from pictures.style import BLUE, PAGE_IN, PALE, RED, drawn, figure


class Series(NamedTuple):
    """An item's values. times_s: (k,) from a common zero, NaN breaks the line.

    limits: what is well, ±inf where open; None: anything.
    """

    name: str
    unit: str
    times_s: F64
    values: F64
    limits: tuple[float, float] | None = None


@drawn
def items(series: Sequence[Series], since: str) -> Figure:
    """All of them over one axis of time. since: what its zero is, for people."""
    made = figure(PAGE_IN, 1.0 + 1.9 * len(series))
    panels = made.subplots(len(series), 1, squeeze=False, sharex=True).ravel()
    for axes, one in zip(panels, series):
        axes.plot(one.times_s, one.values, ".-", color=BLUE, markersize=3, linewidth=1.0)
        axes.set_ylabel(f"{one.name}\n{one.unit}".strip(), fontsize=9)
        low, high = axes.get_ylim()
        for bound, edge in zip(one.limits or (), (low, high)):
            if math.isfinite(bound) and low < bound < high:
                axes.axhline(bound, color=RED, linewidth=0.8)
                axes.axhspan(min(bound, edge), max(bound, edge), color=PALE, zorder=0)
                axes.set_ylim(low, high)
    panels[-1].set_xlabel(f"time since {since}, s")
    return made
