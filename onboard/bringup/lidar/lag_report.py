"""Report of a lag: lines for people, an object for programs, and the setting that corrects it."""

from __future__ import annotations

import math
from typing import NamedTuple

from onboard.perception.scan.tilt_lag import Lag


class LagReport(NamedTuple):
    """A lag and its correction.

    lag: the estimate.
    before_ns: lidar.latency_ns while the sweeps were taken.
    """

    lag: Lag
    before_ns: int

    @property
    def latency_ns(self) -> int:
        """The value of lidar.latency_ns to set, to the microsecond. It may be out of the key's range."""
        return round((self.before_ns + self.lag.late_s * 1e9) / 1000) * 1000

    @property
    def latency_sigma_ns(self) -> int:
        """1 sigma of latency_ns."""
        return round(self.lag.sigma_s * 1e9)

    def lines(self) -> list[str]:
        """The report for people, in ms and degrees."""
        late_ms, sigma_ms = self.lag.late_s * 1e3, self.lag.sigma_s * 1e3
        play = "play      not told apart from the lag: the sweeps have one rate"
        if math.isfinite(self.lag.play_rad):
            play = (
                f"play      {math.degrees(self.lag.play_rad):+.3f} degrees between axis and scanner, 1 sigma "
                f"{math.degrees(self.lag.play_sigma_rad):.3f}"
            )
        return [
            f"lag       {late_ms:+.3f} ms, 1 sigma {sigma_ms:.3f} ms, from {self.lag.points} points of the ground",
            play,
            f"set       lidar.latency_ns = {self.latency_ns}    (was {self.before_ns})",
        ]

    def as_dict(self) -> dict[str, object]:
        """The report for programs, in SI units; null for unknown values."""
        known = {key: item if math.isfinite(item) else None for key, item in self.lag._asdict().items()}
        return {
            **known,
            "latency_before_ns": self.before_ns,
            "latency_ns": self.latency_ns,
            "latency_sigma_ns": self.latency_sigma_ns,
        }

    def toml(self) -> str:
        """The table [lidar] with the key."""
        return f"[lidar]\nlatency_ns = {self.latency_ns}  # 1 sigma {self.latency_sigma_ns}, before {self.before_ns}\n"
