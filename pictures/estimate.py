"""Estimate against truth along a mission: error, the filter's own 95 % band, and odometry alone."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from onboard.records import F64
from pictures.style import BLUE, GREY, RED, SKY, drawn, figure

BAND = 1.96  # sigmas of a band that contains 95 %
NAMES = ("x error, mm", "y error, mm", "height error, mm", "heading error, deg")
SCALES = (1e3, 1e3, 1e3, 57.29578)


@dataclass(frozen=True, slots=True)
class Trace:
    """Samples of a mission.

    way_m: (k,) driven distance.
    error, sigma, odometry: (k, 4) x, y, z (m), yaw (rad).
    stops_m: (s,) driven distance at each stop.
    """

    way_m: F64
    error: F64
    sigma: F64
    odometry: F64
    stops_m: F64


@drawn
def estimate_figure(trace: Trace) -> Figure:
    """One panel each for x, y, height and heading over the driven distance; odometry may leave the axes."""
    made = figure(9.0, 7.0)
    panels = made.subplots(4, 1, sharex=True)
    for k, axes in enumerate(panels):
        _panel(axes, trace, k)
    panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.02), ncols=4, borderaxespad=0.0)
    panels[-1].set_xlabel("way driven, m")
    made.align_ylabels(panels)
    return made


def _panel(axes: Axes, trace: Trace, k: int) -> None:
    band = BAND * SCALES[k] * trace.sigma[:, k]
    axes.fill_between(trace.way_m, -band, band, color=SKY, alpha=0.45, linewidth=0, label="the filter's 95 % band")
    axes.plot(trace.way_m, SCALES[k] * trace.odometry[:, k], color=RED, linewidth=1.2, label="odometry and gyro alone")
    axes.plot(trace.way_m, SCALES[k] * trace.error[:, k], color=BLUE, label="estimate")
    for n, stop_m in enumerate(trace.stops_m):
        axes.axvline(stop_m, color=GREY, linewidth=0.8, linestyle=":", label="" if n else "registered")
    limit = 1.3 * float(band.max())
    axes.set_ylim(-limit, limit)
    axes.set_xlim(0.0, float(trace.way_m[-1]))
    axes.set_ylabel(NAMES[k])
    axes.grid(True)
