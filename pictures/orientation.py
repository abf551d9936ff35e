"""Figure 13b of the chapter: yaw, roll and pitch over the mission, estimated and true, over its phases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from onboard.records import F64
from pictures.style import BLACK, PAGE_IN, RED, drawn, figure, quiet
from pictures.timelines import Span, Track, phase_patches, shade

_ROWS = (("yaw", 2), ("roll", 0), ("pitch", 1))
_WIDE_DEG = 180.0


@drawn
def orientation(estimated: Track, true: Track | None, spans: Sequence[Span]) -> Figure:
    """Three rows over one time axis, degrees; yaw within (-180, 180], broken where it passes 180."""
    made = figure(PAGE_IN, 6.2)
    rows = made.subplots(3, 1, sharex=True, height_ratios=(1.4, 1, 1))
    for axes, (name, column) in zip(rows, _ROWS):
        shade(axes, spans)
        if true is not None:
            axes.plot(*_degrees(true, column), color=BLACK, linewidth=2.2, label="true")
        axes.plot(*_degrees(estimated, column), color=RED, linewidth=1.1, label="estimated")
        axes.set_ylabel(f"{name}, degrees")
        quiet(axes)
    low, high = rows[0].get_ylim()
    if high - low > _WIDE_DEG:
        rows[0].set_yticks(range(-180, 181, 90))
    rows[-1].set_xlabel("time, s")
    rows[0].margins(x=0)
    handles, _ = rows[0].get_legend_handles_labels()
    made.legend(handles=[*handles, *phase_patches(spans)], loc="outside upper center", ncols=6)
    return made


def _degrees(track: Track, column: int) -> tuple[F64, F64]:
    """Times and angles in (-180, 180], with a NaN between two samples where the angle wraps."""
    angles = 180 - np.mod(180 - np.degrees(track.angles_rad[:, column]), 360)
    cuts = np.flatnonzero(np.abs(np.diff(angles)) > 180) + 1
    return np.insert(track.times_s, cuts, track.times_s[cuts]), np.insert(angles, cuts, np.nan)
