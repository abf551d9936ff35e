"""Figures of a run's time series: datagrams lost, tick times, pose error, motion of the wheels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import StrMethodFormatter

from onboard.records import F64
from pictures.style import BLACK, BLUE, ORANGE, PAGE_IN, PURPLE, RED, SKY, YELLOW, drawn, figure, quiet
from pictures.timelines import Span, Track, phase_patches, shade

LOSS_COLOURS = (RED, ORANGE, PURPLE, BLACK)
WHEEL_LINES: tuple[dict[str, Any], ...] = (  # each remains visible under the next
    {"color": SKY, "linewidth": 5.0},
    {"color": YELLOW, "linewidth": 3.0},
    {"color": RED, "linewidth": 1.5},
    {"color": BLACK, "linewidth": 0.9, "linestyle": (0, (4, 3))},
)
_SMOOTH_S = 1.0


@drawn
def link(sent: Mapping[str, int], lost: Mapping[str, Mapping[str, int]]) -> Figure:
    """Bars, one for each direction: datagrams lost by cause and all others, with their numbers."""
    made = figure(PAGE_IN, 1.3 + 0.65 * len(sent))
    axes = made.subplots()
    causes = list(dict.fromkeys(cause for rows in lost.values() for cause, count in rows.items() if count))
    for row, (name, count) in enumerate(sent.items()):
        gone = [lost.get(name, {}).get(cause, 0) for cause in causes]
        parts = [("delivered or on the way", count - sum(gone), SKY)]
        parts += [(f"lost: {c}", part, LOSS_COLOURS[k % 4]) for k, (c, part) in enumerate(zip(causes, gone))]
        at = 0
        for label, part, colour in parts:
            axes.barh(row, part, left=at, color=colour, height=0.6, label=label if row == 0 else None)
            at += part
        share = 100 * sum(gone) / count if count else 0.0
        axes.annotate(
            f"{sum(gone)} of {count} lost, {share:.1f} %",
            (at, row),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
        )
    axes.set_yticks(range(len(sent)), list(sent))
    axes.invert_yaxis()
    axes.set_xlabel("datagrams")
    axes.margins(x=0.22)
    quiet(axes)
    axes.grid(False, axis="y")
    made.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=5)
    return made


class Sigma(NamedTuple):
    """The rover's own 1 sigma over time, rows (k, 2) of time in s and value."""

    position_m: F64
    yaw_rad: F64


SIGMAS = 2.0  # of the band beside an error
_NO_SIGMA = Sigma(np.empty((0, 2)), np.empty((0, 2)))


@drawn
def pose_error(estimated: Track, true: Track, spans: Sequence[Span], sigma: Sigma = _NO_SIGMA) -> Figure:
    """Distance between estimated and true place, and difference of the yaws, over time, with the band of 2 sigma."""
    made = figure(PAGE_IN, 4.2)
    place, yaw = made.subplots(2, 1, sharex=True)
    told = estimated.at(true.times_s)
    away = np.linalg.norm(told.position_m[:, :2] - true.position_m[:, :2], axis=1)
    turned = np.degrees(np.angle(np.exp(1j * (told.angles_rad[:, 2] - true.angles_rad[:, 2]))))
    for axes, values, name in ((place, away * 100, "place, cm"), (yaw, turned, "yaw, degrees")):
        shade(axes, spans)
        axes.plot(true.times_s, values, color=BLACK, linewidth=1.3)
        axes.set_ylabel(f"error of {name}")
        quiet(axes)
    place_top = _band(place, sigma.position_m, 100.0, low=0.0)
    yaw_top = _band(yaw, sigma.yaw_rad, float(np.degrees(1.0)))
    place.set_ylim(0, max(5.0, 110 * float(away.max(initial=0)), 1.1 * place_top))
    widest = max(1.0, 1.1 * float(np.abs(turned).max(initial=0)), 1.1 * yaw_top)
    yaw.set_ylim(-widest, widest)
    place.margins(x=0)
    yaw.set_xlabel("time, s")
    told = [Patch(color=BLUE, alpha=0.3, linewidth=0, label=f"the rover's own {SIGMAS:g} sigma")]
    bands = told if len(sigma.position_m) else []
    made.legend(handles=[*phase_patches(spans), *bands], loc="outside upper center", ncols=5)
    return made


def _band(axes: Axes, sigma: F64, scale: float, low: float | None = None) -> float:
    """Draw SIGMAS times sigma round zero, or from `low` on; returns its largest value."""
    if not len(sigma):
        return 0.0
    top = SIGMAS * scale * sigma[:, 1]
    axes.fill_between(sigma[:, 0], -top if low is None else low, top, color=BLUE, alpha=0.3, linewidth=0, step="post")
    return float(top.max())


@drawn
def ticks(edges_ms: Sequence[float], counts: Mapping[str, Sequence[int]], period_ms: float) -> Figure:
    """Histograms of a tick's wall time, one step line per name. edges_ms: one more than counts, spaced by ratio."""
    made = figure(PAGE_IN, 3.2)
    axes = made.subplots()
    for (name, values), (colour, width) in zip(counts.items(), ((SKY, 3.6), (BLACK, 1.3))):
        axes.stairs(values, edges_ms, color=colour, linewidth=width, label=name)
    axes.axvline(period_ms, color=RED, linewidth=1.2, linestyle=(0, (5, 3)), label=f"{period_ms:g} ms: real time")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(edges_ms[0], edges_ms[-1])
    axes.set_ylim(0.7, 2 * max((max(values, default=0) for values in counts.values()), default=1) + 1)
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.set_xlabel("wall time of a tick, ms")
    axes.set_ylabel("ticks")
    quiet(axes)
    made.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return made


@drawn
def motion(track: Track, wheel_times_s: F64, rates_radps: F64, steer_rad: F64, spans: Sequence[Span]) -> Figure:
    """Speed of the rover, rates and steering of wheels 1 to 4. rates_radps, steer_rad: (k, 4), or no rows."""
    wheels = len(wheel_times_s) > 0
    made = figure(PAGE_IN, 6.2 if wheels else 2.6)
    rows = made.subplots(3 if wheels else 1, 1, sharex=True, squeeze=False)[:, 0]
    rows[0].plot(*_speed(track), color=BLACK, linewidth=1.3)
    rows[0].set_ylabel("speed, m/s")
    if wheels:
        for wheel, look in enumerate(WHEEL_LINES):
            rows[1].plot(wheel_times_s, rates_radps[:, wheel], label=f"wheel {wheel + 1}", **look)
            rows[2].plot(wheel_times_s, np.degrees(steer_rad[:, wheel]), **look)
        rows[1].set_ylabel("wheel rate, rad/s")
        rows[2].set_ylabel("steering, degrees")
    for axes in rows:
        shade(axes, spans)
        quiet(axes)
    rows[0].margins(x=0)
    rows[-1].set_xlabel("time, s")
    handles = rows[1].get_legend_handles_labels()[0] if wheels else []
    made.legend(handles=[*handles, *phase_patches(spans)], loc="outside upper center", ncols=4)
    return made


def _speed(track: Track) -> tuple[F64, F64]:
    """Times and speeds over the ground over about a second each, so that steps of a record do not look like noise."""
    if len(track.times_s) < 3:
        return track.times_s, np.zeros(len(track.times_s))
    times = np.arange(track.times_s[0], track.times_s[-1], _SMOOTH_S / 4)
    after = track.at(np.minimum(times + _SMOOTH_S / 2, track.times_s[-1]))
    before = track.at(np.maximum(times - _SMOOTH_S / 2, track.times_s[0]))
    way = np.linalg.norm(after.position_m[:, :2] - before.position_m[:, :2], axis=1)
    return times, way / np.maximum(after.times_s - before.times_s, 1e-6)
