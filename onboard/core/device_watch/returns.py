"""What is wrong with the scanner's frames and returns, over a moving window of them.

    garbled   over 20 % of the frames of the last 2 s, and 4 at least, failed their checks
    dirty     in 40 scans over 40 % of the places between neighbouring beams that point at least 2 degrees below the
              horizon, and of whose neighbours one returned, are edges of nothing; or over 10 % of the beams say too
              near, error or interference

    a clean line over rocks    ____________________......................   1 edge: the sky begins
    dust on the window         ..__.._.___._..__._........................   every second place

Of beams lost at random a share p makes 2 p (1 - p) of edges: 40 % from 28 % on, so in a sweep that `core.seeing` would
end the mission for. By simulation the 40 worst lines of rough fields, seen by a scanner that loses what it meets
flatter than 5 degrees, and 1 / 8 % besides, have 24 / 26 % of edges. The sky is left out: hills and nothing alternate
there.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from onboard.config import Rover
from onboard.native.elementary import sin, total
from onboard.perception.lost_beams import plane_range_m
from onboard.records import F64, BeamStatus, Scan

WINDOW_TICKS, BAD_RATIO, LEAST_BAD = 200, 0.2, 4
SCANS, TORN_RATIO, SPOILT_RATIO = 40, 0.4, 0.1
BELOW_RAD = math.radians(2.0)
BESIDE = 4  # beams to each side: one of them returned, or the place counts for nothing
_LEAST_PLACES = 4000  # in the window: a fifth of them all


class FrameWatch:
    """`update` each tick with the frames since the start, good and bad; `garbled` then holds or not."""

    def __init__(self) -> None:
        self.garbled = False
        self.bad_ratio = 0.0
        self._counts: deque[tuple[int, int]] = deque(maxlen=WINDOW_TICKS + 1)

    def update(self, good: int, bad: int) -> None:
        """One tick."""
        self._counts.append((good, bad))
        first_good, first_bad = self._counts[0]
        wrong, all_of_them = bad - first_bad, good - first_good + bad - first_bad
        self.bad_ratio = wrong / all_of_them if all_of_them else 0.0
        self.garbled = wrong >= LEAST_BAD and self.bad_ratio > BAD_RATIO


class ReturnWatch:
    """`update` with the scans of a tick; `dirty` holds while the last SCANS of them are. sector_rad: half of it."""

    def __init__(self, rover: Rover, sector_rad: float) -> None:
        self.dirty = False
        self.torn_ratio = self.spoilt_ratio = 0.0
        self._rover, self._sector_rad = rover, sector_rad
        self._scans: deque[tuple[int, int, float]] = deque(maxlen=SCANS)

    def update(self, scans: Sequence[Scan], tilt_rad: float | None) -> None:
        """One tick. tilt_rad: of the axis now; None: not known, so that nothing is known to point at ground."""
        for scan in scans:
            self._scans.append(self._counts(scan, tilt_rad))
        if not scans or len(self._scans) < SCANS:
            return
        places, edges = (sum(row[k] for row in self._scans) for k in (0, 1))
        self.torn_ratio = edges / places if places >= _LEAST_PLACES else 0.0
        self.spoilt_ratio = total(row[2] for row in self._scans) / SCANS
        self.dirty = self.torn_ratio > TORN_RATIO or self.spoilt_ratio > SPOILT_RATIO

    def _counts(self, scan: Scan, tilt_rad: float | None) -> tuple[int, int, float]:
        """Places between two beams that point below the horizon, edges of nothing there, share with no word."""
        first = max(0, round((-self._sector_rad - scan.first_angle_rad) / scan.step_rad))
        status = scan.status[first : round((self._sector_rad - scan.first_angle_rad) / scan.step_rad) + 1]
        spoilt = int(np.count_nonzero(status > BeamStatus.NO_RETURN)) / max(1, len(status))
        if tilt_rad is None:
            return 0, 0, spoilt
        beams = np.arange(first, first + len(status), dtype=np.float64)
        azimuths_rad: F64 = scan.first_angle_rad + beams * scan.step_rad
        below = plane_range_m(azimuths_rad, tilt_rad, self._rover) <= self._rover.lidar_z_m / sin(BELOW_RAD)
        nothing = status == BeamStatus.NO_RETURN
        near = np.convolve(~nothing, np.ones(2 * BESIDE + 1, np.int64), "same") > 0  # where all is dark nothing is torn
        places = (below & near)[1:] & (below & near)[:-1]
        edges = int(np.count_nonzero((nothing[1:] != nothing[:-1]) & places))
        return int(np.count_nonzero(places)), edges, spoilt
