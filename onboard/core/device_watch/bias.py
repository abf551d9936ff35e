"""A gyro whose bias has changed: the means of two rests, half a second after the wheels have come to stand.

    moves |  settles 0.5 s |  mean of 1 s  | ...................... | moves
                           it is this rest's word; with the last rest's it is compared

Noise of 1 mrad/s leaves 0.1 mrad/s in a mean; the limit is 0.1 degrees a second, 14 of their sigmas apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

SETTLES_NS, MEAN_SAMPLES = 500_000_000, 100
LIMIT_RADPS = math.radians(0.1)


class BiasWatch:
    """`update` each tick. jumps: rests that read another bias than the one before; step_radps: by how much the last."""

    def __init__(self) -> None:
        self.jumps = 0
        self.step_radps = 0.0
        self._known: list[float] | None = None
        self._sum = [0.0, 0.0, 0.0]
        self._samples = 0
        self._since_ns: int | None = None  # of this rest

    def update(self, rates_radps: Sequence[float] | None, standing: bool, now_ns: int) -> None:
        """One tick: the gyro's newest sample, None where none came; whether the wheels stand."""
        if not standing:
            self._since_ns = None
            return
        if self._since_ns is None:
            self._since_ns, self._sum, self._samples = now_ns, [0.0, 0.0, 0.0], 0
        if rates_radps is None or now_ns - self._since_ns < SETTLES_NS or self._samples == MEAN_SAMPLES:
            return
        self._sum = [total + rate for total, rate in zip(self._sum, rates_radps)]
        self._samples += 1
        if self._samples == MEAN_SAMPLES:
            self._judge([total / MEAN_SAMPLES for total in self._sum])

    def _judge(self, means_radps: list[float]) -> None:
        steps = [mean - known for mean, known in zip(means_radps, self._known or means_radps)]
        self._known = means_radps
        largest = max(steps, key=abs)
        if abs(largest) > LIMIT_RADPS:
            self.jumps += 1
            self.step_radps = largest
