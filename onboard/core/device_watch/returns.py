"""What is wrong with the scanner's frames and returns, over a moving window of them.

    garbled   over 20 % of the frames of the last 2 s, and 4 at least, failed their checks
    dirty     in 40 scans over 10 % of the places between neighbouring beams are edges of nothing, or over 10 % of the
              beams say too near, error or interference

    a clean line over rocks    ____________________......................   1 edge: the sky begins
    dust on the window         ..__.._.___._..__._........................   every second place

By simulation the 40 worst lines of a field of boulders have 3 % of edges; half of the beams lost make 39 %.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from onboard.records import BeamStatus, Scan

WINDOW_TICKS, BAD_RATIO, LEAST_BAD = 200, 0.2, 4
SCANS, TORN_RATIO = 40, 0.1


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

    def __init__(self, sector_rad: float) -> None:
        self.dirty = False
        self.torn_ratio = self.spoilt_ratio = 0.0
        self._sector_rad = sector_rad
        self._scans: deque[tuple[float, float]] = deque(maxlen=SCANS)

    def update(self, scans: Sequence[Scan]) -> None:
        """One tick."""
        for scan in scans:
            self._scans.append(_ratios(scan, self._sector_rad))
        if not scans or len(self._scans) < SCANS:
            return
        self.torn_ratio, self.spoilt_ratio = (sum(row[k] for row in self._scans) / SCANS for k in (0, 1))
        self.dirty = max(self.torn_ratio, self.spoilt_ratio) > TORN_RATIO


def _ratios(scan: Scan, sector_rad: float) -> tuple[float, float]:
    """Edges of nothing per place between two beams, and the share of beams with no word, within the sector."""
    first = max(0, round((-sector_rad - scan.first_angle_rad) / scan.step_rad))
    status = scan.status[first : round((sector_rad - scan.first_angle_rad) / scan.step_rad) + 1]
    nothing = status == BeamStatus.NO_RETURN
    edges = int(np.count_nonzero(nothing[1:] != nothing[:-1]))
    spoilt = int(np.count_nonzero(status > BeamStatus.NO_RETURN))
    return edges / max(1, len(status) - 1), spoilt / max(1, len(status))
