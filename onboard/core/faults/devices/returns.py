"""Monitors of the scanner's frames and returns over a moving window.

    garbled   over 20 % of the frames of the last 2 s, and 4 at least, failed their checks
    dirty     in 40 scans over 40 % of the places between neighbouring beams are edges between a return and none. Only
              places count whose beams point at least 2 degrees below the horizon and have a return near them. Or over
              10 % of the beams report too near, error or interference

    a clean line over rocks    ____________________......................   1 edge: the sky begins
    dust on the window         ..__.._.___._..__._........................   every second place

A share p of beams lost at random makes 2 p (1 - p) of edges: 40 % from p = 28 % on, the loss in a sweep for which
`core.seeing` would end the mission. By simulation the 40 worst lines of rough fields have 24 / 26 % of edges, for a
scanner that loses beams flatter than 5 degrees to the ground and 1 / 8 % of the others. The sky is left out: there
hills and sky alternate.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from onboard.config import Rover
from onboard.native.elementary import sin, total
from onboard.perception.scan.lost_beams import plane_range_m
from onboard.records import F64, BeamStatus, Scan

WINDOW_TICKS, BAD_RATIO, LEAST_BAD = 200, 0.2, 4
SCANS, TORN_RATIO, SPOILT_RATIO = 40, 0.4, 0.1
BELOW_RAD = math.radians(2.0)
BESIDE = 4  # beams to each side: one of them must have a return, or the place does not count
_LEAST_PLACES = 4000  # in the window: one fifth of all


class FrameWatch:
    """Monitor of the frame checks; call `update` each tick.

    garbled: the fault is active.
    bad_ratio: share of bad frames in the window.
    """

    def __init__(self) -> None:
        self.garbled = False
        self.bad_ratio = 0.0
        self._counts: deque[tuple[int, int]] = deque(maxlen=WINDOW_TICKS + 1)

    def update(self, good: int, bad: int) -> None:
        """Process one tick. good, bad: frames since the start."""
        self._counts.append((good, bad))
        first_good, first_bad = self._counts[0]
        wrong, all_of_them = bad - first_bad, good - first_good + bad - first_bad
        self.bad_ratio = wrong / all_of_them if all_of_them else 0.0
        self.garbled = wrong >= LEAST_BAD and self.bad_ratio > BAD_RATIO


class ReturnWatch:
    """Monitor of the returns; call `update` with the scans of each tick.

    dirty: the fault is active; judged when SCANS scans are in the window.
    torn_ratio: share of places that are edges.
    spoilt_ratio: share of beams with a status of too near, error or interference.
    sector_rad: half of the judged sector.
    """

    def __init__(self, rover: Rover, sector_rad: float) -> None:
        self.dirty = False
        self.torn_ratio = self.spoilt_ratio = 0.0
        self._rover, self._sector_rad = rover, sector_rad
        self._scans: deque[tuple[int, int, float]] = deque(maxlen=SCANS)

    def update(self, scans: Sequence[Scan], tilt_rad: float | None) -> None:
        """Process one tick. tilt_rad: present angle of the axis; None: not known, then no beam counts as below."""
        for scan in scans:
            self._scans.append(self._counts(scan, tilt_rad))
        if not scans or len(self._scans) < SCANS:
            return
        places, edges = (sum(row[k] for row in self._scans) for k in (0, 1))
        self.torn_ratio = edges / places if places >= _LEAST_PLACES else 0.0
        self.spoilt_ratio = total(row[2] for row in self._scans) / SCANS
        self.dirty = self.torn_ratio > TORN_RATIO or self.spoilt_ratio > SPOILT_RATIO

    def _counts(self, scan: Scan, tilt_rad: float | None) -> tuple[int, int, float]:
        """Return places between two beams below the horizon, edges among them, and share of beams without a range."""
        first = max(0, round((-self._sector_rad - scan.first_angle_rad) / scan.step_rad))
        status = scan.status[first : round((self._sector_rad - scan.first_angle_rad) / scan.step_rad) + 1]
        spoilt = int(np.count_nonzero(status > BeamStatus.NO_RETURN)) / max(1, len(status))
        if tilt_rad is None:
            return 0, 0, spoilt
        beams = np.arange(first, first + len(status), dtype=np.float64)
        azimuths_rad: F64 = scan.first_angle_rad + beams * scan.step_rad
        below = plane_range_m(azimuths_rad, tilt_rad, self._rover) <= self._rover.lidar_z_m / sin(BELOW_RAD)
        nothing = status == BeamStatus.NO_RETURN
        near = np.convolve(~nothing, np.ones(2 * BESIDE + 1, np.int64), "same") > 0  # a dark area has no edges inside
        places = (below & near)[1:] & (below & near)[:-1]
        edges = int(np.count_nonzero((nothing[1:] != nothing[:-1]) & places))
        return int(np.count_nonzero(places)), edges, spoilt
