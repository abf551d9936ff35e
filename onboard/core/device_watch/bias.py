"""A gyro whose bias has changed: the means of two rests, half a second after the wheels have come to stand.

    moves |  settles 0.5 s |  mean of 1 s  |  mean of 1 s  | ... until two in a row agree | ... | moves
                                                             the mean of both is this rest's word; with the last
                                                             rest's it is compared

A rover that came to stand on powder creeps on: 0.2 degrees a second, half of it 1.5 s later. Its means do not agree. On
dust it creeps for longer: a rest after a way on which the wheels slipped has no word.
Noise of 1 mrad/s leaves 0.006 degrees a second in a mean; to agree is 3.7 sigmas of their difference, to have changed
17 of the words'.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

SETTLES_NS, MEAN_SAMPLES = 500_000_000, 100
LIMIT_RADPS, AGREE_RADPS = math.radians(0.1), math.radians(0.03)


class BiasWatch:
    """`update` each tick. jumps: rests that read another bias than the one before; step_radps: by how much the last."""

    def __init__(self) -> None:
        self.jumps = 0
        self.step_radps = 0.0
        self._known: list[float] | None = None  # the last rest's word
        self._last: list[float] | None = None  # the last second's mean, of this rest
        self._told = self._slipped = False  # this rest has said its word; the way to it slipped
        self._sum = [0.0, 0.0, 0.0]
        self._samples = 0
        self._since_ns: int | None = None  # of this rest

    def update(self, rates_radps: Sequence[float] | None, standing: bool, now_ns: int, slips: bool = False) -> None:
        """One tick: the gyro's newest sample, None where none came; whether the wheels stand, whether they slip."""
        if not standing:
            self._slipped = slips or (self._slipped and self._since_ns is None)
            self._since_ns = None
            return
        if self._since_ns is None:
            self._since_ns, self._sum, self._samples = now_ns, [0.0, 0.0, 0.0], 0
            self._last, self._told = None, False
        if rates_radps is None or self._told or self._slipped or now_ns - self._since_ns < SETTLES_NS:
            return
        self._sum = [total + rate for total, rate in zip(self._sum, rates_radps)]
        self._samples += 1
        if self._samples == MEAN_SAMPLES:
            means = [total / MEAN_SAMPLES for total in self._sum]
            if self._last and _apart_radps(means, self._last) < AGREE_RADPS:
                self._judge([(mean + last) / 2 for mean, last in zip(means, self._last)])
            self._last, self._sum, self._samples = means, [0.0, 0.0, 0.0], 0

    def _judge(self, means_radps: list[float]) -> None:
        steps = [mean - known for mean, known in zip(means_radps, self._known or means_radps)]
        self._known, self._told = means_radps, True
        largest = max(steps, key=abs)
        if abs(largest) > LIMIT_RADPS:
            self.jumps += 1
            self.step_radps = largest


def _apart_radps(means: Sequence[float], others: Sequence[float]) -> float:
    return max(abs(mean - other) for mean, other in zip(means, others))
