"""Poses over time, and mission phases as background of a time series."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from onboard.records import F64
from pictures.style import PHASE_COLOURS


@dataclass(frozen=True, slots=True)
class Track:
    """Poses over time.

    times_s: (k,) rising.
    position_m: (k, 3).
    angles_rad: (k, 3) roll, pitch, yaw.
    """

    times_s: F64
    position_m: F64
    angles_rad: F64

    def at(self, times_s: F64) -> Track:
        """The poses at other times, linearly interpolated; angles are unwrapped at pi."""

        def between(values: F64) -> F64:
            return np.column_stack([np.interp(times_s, self.times_s, column) for column in values.T])

        return Track(times_s, between(self.position_m), between(np.unwrap(self.angles_rad, axis=0)))


class Span(NamedTuple):
    """A phase of the mission from `start_s` to `end_s`."""

    start_s: float
    end_s: float
    phase: str


def shade(axes: Axes, spans: Sequence[Span]) -> None:
    """Phases as pale bands behind a time series."""
    for span in spans:
        if span.phase in PHASE_COLOURS:
            axes.axvspan(span.start_s, span.end_s, color=PHASE_COLOURS[span.phase], alpha=0.22, linewidth=0, zorder=0)


def phase_patches(spans: Sequence[Span]) -> list[Patch]:
    """Entries of a legend for the phases that occur; mapping and planning share one."""
    names = {"SCANNING": "scanning", "DRIVING": "driving", "TURNING": "turning", "MAPPING": "mapping, planning"}
    seen = {"MAPPING" if span.phase == "PLANNING" else span.phase for span in spans}
    return [Patch(color=PHASE_COLOURS[p], alpha=0.35, linewidth=0, label=names[p]) for p in names if p in seen]
