"""Vibration measured by the gyro: rough ground shakes a rover that drives over it, and not one that stays in place."""

from __future__ import annotations

import math

from onboard.records import ImuSample

BLOCK_TICKS = 50


class Shaking:
    """Vibration; call `update` each tick.

    now_radps: largest standard deviation of an axis, in the quieter of the last two half seconds, so that a single
        knock does not count as driving.
    """

    def __init__(self) -> None:
        self.now_radps = self._last_radps = math.inf
        self._begin()

    def update(self, imu: ImuSample) -> None:
        """Process one tick."""
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
