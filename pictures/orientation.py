"""Figure 13b of the chapter: yaw, roll and pitch over the mission, estimated and true, over its phases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from pictures.style import BLACK, PAGE_IN, RED, drawn, figure, quiet
from pictures.timelines import Span, Track, phase_patches, shade

_ROWS = (("yaw", 2), ("roll", 0), ("pitch", 1))


@drawn
def orientation(estimated: Track, true: Track | None, spans: Sequence[Span]) -> Figure:
    """Three rows over one time axis, degrees; yaw runs on beyond 180 instead of jumping."""
    made = figure(PAGE_IN, 6.2)
    rows = made.subplots(3, 1, sharex=True, height_ratios=(1.4, 1, 1))
    for axes, (name, column) in zip(rows, _ROWS):
        shade(axes, spans)
        if true is not None:
            axes.plot(true.times_s, _degrees(true, column), color=BLACK, linewidth=2.2, label="true")
        axes.plot(estimated.times_s, _degrees(estimated, column), color=RED, linewidth=1.1, label="estimated")
        axes.set_ylabel(f"{name}, degrees")
        quiet(axes)
    rows[-1].set_xlabel("time, s")
    rows[0].margins(x=0)
    handles, _ = rows[0].get_legend_handles_labels()
    made.legend(handles=[*handles, *phase_patches(spans)], loc="outside upper center", ncols=6)
    return made


def _degrees(track: Track, column: int) -> np.ndarray:
    angle = track.angles_rad[:, column]
    return np.degrees(np.unwrap(angle) if column == 2 else angle)
