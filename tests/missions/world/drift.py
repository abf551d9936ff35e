"""Error of the estimate during a drive, drawn from a seeded generator."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.records import F64


@dataclass(frozen=True)
class Drift:
    """1 sigma of the estimate inside a drive: half of the power is a bias until the next scan, half is noise."""

    way_ratio: float = 0.015
    height_ratio: float = 0.005
    heading_rad: float = math.radians(0.7)
    attitude_rad: float = math.radians(0.35)
    correlation_s: float = 0.5

    def draw(self, way_m: F64, cruise_mps: float, rng: np.random.Generator) -> F64:
        """Return (k, 6) errors of x, y, z, roll, pitch, yaw at each way (k,) driven since the scan."""
        noise = rng.normal(size=(len(way_m), 6))
        keep = np.exp(-np.diff(way_m, prepend=way_m[0]) / cruise_mps / self.correlation_s)
        for k in range(1, len(noise)):
            noise[k] = keep[k] * noise[k - 1] + math.sqrt(1.0 - keep[k] ** 2) * noise[k]
        unit = math.sqrt(0.5) * (rng.normal(size=6) + noise)
        still = np.ones_like(way_m)
        sigma = np.stack(
            [
                self.way_ratio * way_m / math.sqrt(2.0),
                self.way_ratio * way_m / math.sqrt(2.0),
                self.height_ratio * way_m,
                self.attitude_rad * still,
                self.attitude_rad * still,
                self.heading_rad * still,
            ],
            axis=1,
        )
        return sigma * unit


FLOWN_DRIFT, NO_DRIFT = Drift(), Drift(0.0, 0.0, 0.0, 0.0)
