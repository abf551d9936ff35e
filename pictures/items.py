"""Telemetry over time: one panel for each item, its limits shaded."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.dates import ConciseDateFormatter, date2num
from matplotlib.figure import Figure

from onboard.records import F64
from pictures.style import BLUE, PAGE_IN, PALE, RED, drawn, figure, literal

_DAY_S = 86_400.0
_TICKS = ["%Y", "%b", "%m-%d", "%H:%M", "%H:%M", "%H:%M:%S.%f"]  # years, months, days, hours, minutes, seconds


class Series(NamedTuple):
    """Values of one item.

    times_s: (k,) from a common zero; NaN breaks the line.
    limits: normal range, ±inf where open; None: any value.
    names: of an enumeration's values, the ticks of its panel.
    """

    name: str
    unit: str
    times_s: F64
    values: F64
    limits: tuple[float, float] | None = None
    names: Mapping[int, str] | None = None


@drawn
def items(series: Sequence[Series], zero_utc_ns: int = 0) -> Figure:
    """All items over one time axis: UTC if `zero_utc_ns` is known (0: unknown), else seconds of the run."""
    zero = date2num(datetime.fromtimestamp(zero_utc_ns / 1e9, UTC)) if zero_utc_ns else None
    made = figure(PAGE_IN, 1.0 + 1.9 * len(series))
    panels = made.subplots(len(series), 1, squeeze=False, sharex=True).ravel()
    for axes, one in zip(panels, series):
        times = one.times_s if zero is None else zero + one.times_s / _DAY_S
        steps = "default" if one.names is None else "steps-post"
        axes.plot(times, one.values, ".-", color=BLUE, markersize=3, linewidth=1.0, drawstyle=steps)
        axes.set_ylabel(_label(one), fontsize=9)
        if one.names is not None:
            _name(axes, one.values, one.names)
        low, high = axes.get_ylim()
        for bound, edge in zip(one.limits or (), (low, high)):
            if math.isfinite(bound) and low < bound < high:
                axes.axhline(bound, color=RED, linewidth=0.8)
                axes.axhspan(min(bound, edge), max(bound, edge), color=PALE, zorder=0)
                axes.set_ylim(low, high)
    if zero is None:
        panels[-1].set_xlabel("time of the run, s")
    else:
        panels[-1].xaxis_date(UTC)
        locator = panels[-1].xaxis.get_major_locator()
        panels[-1].xaxis.set_major_formatter(
            ConciseDateFormatter(
                locator, UTC, formats=_TICKS, zero_formats=_TICKS, offset_formats=["", "%Y", "%Y-%m", *["%Y-%m-%d"] * 3]
            )
        )
        panels[-1].set_xlabel("UTC")
    return made


def _label(one: Series) -> str:
    """The name, and the unit if the name does not end with it."""
    said = one.unit in ("", "1") or one.name.endswith("_" + one.unit.lower().replace("/", "p").replace("°", ""))
    return literal(one.name if said else f"{one.name}\n{one.unit}")


def _name(axes: Axes, values: F64, names: Mapping[int, str]) -> None:
    """Ticks at the values that occur, with their names; a number if a value has no name."""
    seen = sorted({int(value) for value in values if math.isfinite(value)})
    axes.set_yticks(seen, [literal(names.get(value, str(value))) for value in seen])
    axes.set_ylim(min(seen, default=0) - 0.5, max(seen, default=0) + 0.5)
