"""One time line of a run: battery, currents, link and events, one row each over the same seconds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from onboard.records import F64
from pictures.figures import WHEEL_LINES
from pictures.style import BLACK, BLUE, GREY, ORANGE, PAGE_IN, PURPLE, RED, SKY, drawn, figure, literal, quiet
from pictures.timelines import Span, phase_patches, shade

BIN_S = 5.0  # of the link's rates
_COLOURS = {"critical": PURPLE, "error": RED, "warning": ORANGE, "info": GREY, "debug": GREY}
_NAMED = ("MODE", "ARRIVED", "FAILED")  # of the events that are no warnings
_APART = 0.05  # least distance of two names in a row, as a share of the time line
_LEAST_V = 1.0  # height of the row of the voltage
_EMPTY = np.empty((0, 2))


class Mark(NamedTuple):
    """An event: time in s, severity, name."""

    time_s: float
    severity: str
    name: str


@dataclass(frozen=True, slots=True)
class Lines:
    """Rows (k, 2) of time in s and value; no rows: not recorded.

    voltage_v, charge_ratio, current_a: of the battery.
    wheel_currents_a: of the drive motors of wheels 1 to 4.
    sent_bits, received_bits: one row for each payload of the rover, and for each message that it received.
    """

    voltage_v: F64 = field(default_factory=lambda: _EMPTY)
    charge_ratio: F64 = field(default_factory=lambda: _EMPTY)
    current_a: F64 = field(default_factory=lambda: _EMPTY)
    wheel_currents_a: Sequence[F64] = ()
    sent_bits: F64 = field(default_factory=lambda: _EMPTY)
    received_bits: F64 = field(default_factory=lambda: _EMPTY)


@drawn
def run_time_line(lines: Lines, marks: Sequence[Mark], spans: Sequence[Span], end_s: float) -> Figure:
    """Draw the four rows. end_s: end of the time axis."""
    made = figure(PAGE_IN, 8.4)
    battery, currents, link, events = made.subplots(4, 1, sharex=True, height_ratios=(1, 1.2, 1, 1.5))
    for axes in (battery, currents, link, events):
        shade(axes, spans)
        quiet(axes)
    _battery(battery, lines)
    _currents(currents, lines)
    _link(link, lines, end_s)
    _events(events, marks, max(end_s, 1.0))
    events.set_xlim(0.0, max(end_s, 1.0))
    events.set_xlabel("time, s")
    made.legend(handles=phase_patches(spans), loc="outside upper center", ncols=5)
    return made


def _battery(axes: Axes, lines: Lines) -> None:
    axes.set_ylabel("battery, V")
    axes.plot(*lines.voltage_v.T, color=BLACK, linewidth=1.3)
    if len(lines.voltage_v):
        low, high = lines.voltage_v[:, 1].min(), lines.voltage_v[:, 1].max()
        half = max(_LEAST_V, 1.1 * (high - low)) / 2
        axes.set_ylim((low + high) / 2 - half, (low + high) / 2 + half)
    if len(lines.charge_ratio):
        charge = axes.twinx()
        charge.plot(lines.charge_ratio[:, 0], 100 * lines.charge_ratio[:, 1], color=BLUE, linewidth=1.3)
        charge.set_ylabel("charge, %", color=BLUE)
        charge.set_ylim(0, 105)
        charge.spines[["top"]].set_visible(False)


def _currents(axes: Axes, lines: Lines) -> None:
    axes.set_ylabel("current, A")
    for number, (rows, look) in enumerate(zip(lines.wheel_currents_a, WHEEL_LINES), 1):
        axes.plot(*rows.T, label=f"wheel {number}", **{**look, "linewidth": look["linewidth"] * 0.6})
    axes.plot(*lines.current_a.T, color=BLUE, linewidth=1.3, label="battery")
    _legend_above(axes, 5)


def _link(axes: Axes, lines: Lines, end_s: float) -> None:
    axes.set_ylabel("link, kbit/s")
    edges = np.arange(0.0, max(end_s, BIN_S) + BIN_S, BIN_S)
    for rows, colour, name in ((lines.sent_bits, BLACK, "rover to ground"), (lines.received_bits, SKY, "received")):
        bits, _ = np.histogram(rows[:, 0], edges, weights=rows[:, 1])
        axes.stairs(bits / BIN_S / 1e3, edges, color=colour, linewidth=1.4, label=name)
    axes.set_ylim(bottom=0)
    _legend_above(axes, 2)


def _legend_above(axes: Axes, columns: int) -> None:
    """Legend in a band above the lines, which it does not cover."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.3 * (high - low))
    axes.legend(loc="upper right", ncols=columns, fontsize=8)


def _events(axes: Axes, marks: Sequence[Mark], end_s: float) -> None:
    """One row a severity; names of warnings, and of the events that begin or end a mission, as far as there is room."""
    rows = [severity for severity in _COLOURS if any(mark.severity == severity for mark in marks)]
    axes.set_yticks(range(len(rows)), rows)
    axes.set_ylim(-0.6, max(len(rows), 1) - 0.4)
    axes.invert_yaxis()
    axes.set_ylabel("events")
    for mark in marks:
        if mark.severity in rows:
            axes.plot(
                mark.time_s,
                rows.index(mark.severity),
                "|",
                color=_COLOURS[mark.severity],
                markersize=16,
                markeredgewidth=2,
            )
    last_s: dict[str, float] = {}
    for mark in sorted(marks):
        unnamed = mark.severity not in rows or (mark.severity in ("info", "debug") and mark.name not in _NAMED)
        near = mark.time_s - last_s.get(mark.severity, -end_s) < _APART * end_s
        if unnamed or near:
            continue
        last_s[mark.severity] = mark.time_s
        late = mark.time_s > 0.85 * end_s
        axes.annotate(
            literal(mark.name),
            (mark.time_s, rows.index(mark.severity)),
            xytext=(-3 if late else 3, 1),
            textcoords="offset points",
            fontsize=7.5,
            va="bottom",
            ha="right" if late else "left",
        )
