"""Position of the map frame on the globe: its origin, and conversion in both directions (pymap3d, WGS 84)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pymap3d


@dataclass(frozen=True, slots=True)
class Origin:
    """Origin of the map frame: degrees, and metres above the ellipsoid. There x is east, y north, z up."""

    latitude_deg: float
    longitude_deg: float
    height_m: float = 0.0

    def __post_init__(self) -> None:
        inside = abs(self.latitude_deg) <= 89.9 and abs(self.longitude_deg) <= 180 and abs(self.height_m) <= 20_000
        if not inside:  # also for NaN; at a pole north has no meaning
            found = f"{self.latitude_deg:g} {self.longitude_deg:g} {self.height_m:g}"
            raise ValueError(
                f"origin {found} should be a latitude "
                "from -89.9 to 89.9, a longitude from -180 to 180, a height from -20000 to 20000 m"
            )

    def globe(self, x_m: float, y_m: float, z_m: float) -> tuple[float, float, float]:
        """Return latitude and longitude in degrees and height in m of a point of the map frame."""
        lat, lon, height = pymap3d.enu2geodetic(x_m, y_m, z_m, self.latitude_deg, self.longitude_deg, self.height_m)
        return float(lat), float(lon), float(height)

    def map(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """Return x and y in m of a place at the origin's height. Raises ValueError if the numbers are no place."""
        if not (abs(latitude_deg) <= 90 and abs(longitude_deg) <= 360):
            raise ValueError(f"latitude {latitude_deg:g}, longitude {longitude_deg:g} is no place on the globe")
        x_m, y_m, _ = pymap3d.geodetic2enu(
            latitude_deg, longitude_deg, self.height_m, self.latitude_deg, self.longitude_deg, self.height_m
        )
        if not math.isfinite(x_m + y_m):
            raise ValueError(f"latitude {latitude_deg:g}, longitude {longitude_deg:g} is no place on the globe")
        return float(x_m), float(y_m)


def e7(degrees: float) -> int:
    """Convert degrees to MAVLink's integers, 1e-7 degrees."""
    return round(degrees * 1e7)
