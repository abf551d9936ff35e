"""Scan: one turn of the scanner, the input of all perception."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Scan:
    """One turn of the scanner that has passed all checks.

    Beam k was fired at start_ns + k*beam_ns in direction first_angle_rad + k*step_rad (counter-clockwise, 0 ahead).
    ranges_m: (n,) float32, NaN where `status` is not OK.
    status: (n,) uint8 of BeamStatus.
    intensity: (n,) int32; None if it was not requested from the sensor.
    further_m: (n, 2) float32, the second and third echo, NaN without one; None if only one echo was requested.
    The arrays are places of a ring: they are valid while the scan is referenced.
    """

    start_ns: int
    beam_ns: float
    first_angle_rad: float
    step_rad: float
    ranges_m: F32
    status: U8
    intensity: NDArray[np.int32] | None = None
    further_m: F32 | None = None

    @property
    def geometry(self) -> tuple[int, float, float]:
        """Number of beams, first angle, step: scans that share it can be one image."""
        return len(self.ranges_m), self.first_angle_rad, self.step_rad


class BeamStatus(IntEnum):
    """Status of a beam (protocol.scip.value_codes)."""

    OK = 0
    NO_RETURN = 1
    TOO_NEAR = 2
    ERROR = 3
    INTERFERENCE = 4


def of_one_geometry(scans: Sequence[Scan]) -> list[Scan]:
    """Return the scans of the most frequent geometry, in their order; needs at least one scan."""
    geometry = Counter(scan.geometry for scan in scans).most_common(1)[0][0]
    return [scan for scan in scans if scan.geometry == geometry]
