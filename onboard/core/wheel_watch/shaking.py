"""How much the gyro shakes: rough ground turns a rover that goes over it, and not one that stays where it is."""

from __future__ import annotations

import math

from onboard.records import ImuSample

BLOCK_TICKS = 50


class Shaking:
    """`update` each tick. now_radps: the largest deviation of an axis from its mean, in the quieter of the last two
    half seconds: one knock is not a drive."""

    def __init__(self) -> None:
        self.now_radps = self._last_radps = math.inf
        self._begin()

    def update(self, imu: ImuSample) -> None:
        """Takes one tick."""
        self._ticks += 1
        for k, rate in enumerate(imu.gyro_radps):
            self._sums[k] += rate
            self._squares[k] += rate * rate
        if self._ticks == BLOCK_TICKS:
            n = self._ticks
            means = (total / n for total in self._sums)
            spread = max(square / n - mean * mean for mean, square in zip(means, self._squares))
            before_radps, self._last_radps = self._last_radps, math.sqrt(max(0.0, spread))
            self.now_radps = min(before_radps, self._last_radps)
            self._begin()

    def _begin(self) -> None:
        self._ticks, self._sums, self._squares = 0, [0.0] * 3, [0.0] * 3
