"""Monitor of the gyro's bias: compares the means of two rests, from half a second after the wheels have stopped.

    moves |  settles 0.5 s |  mean of 1 s  |  mean of 1 s  | ... until two in a row agree | ... | moves
                                                             the mean of both is this rest's estimate; it is
                                                             compared with that of the last rest

On powder a rover that has stopped creeps on: 0.2 degrees a second, half of it 1.5 s later. Its means do not agree. On
dust it creeps for longer: a rest after driving with wheel slip gives no estimate.
Noise of 1 mrad/s leaves 0.006 degrees a second in a mean. The limit of agreement is 3.7 sigmas of the difference of two
means, the limit of a change 17 sigmas of the difference of two estimates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

SETTLES_NS, MEAN_SAMPLES = 500_000_000, 100
LIMIT_RADPS, AGREE_RADPS = math.radians(0.1), math.radians(0.03)


class BiasWatch:
    """Bias monitor; call `update` each tick.

    jumps: rests whose bias differs from that of the rest before.
    step_radps: size of the last such change, on the axis that changed most.
    """

    def __init__(self) -> None:
        self.jumps = 0
        self.step_radps = 0.0
        self._known: list[float] | None = None  # estimate of the last rest
        self._last: list[float] | None = None  # mean of the last second of this rest
        self._told = self._slipped = False  # this rest has its estimate; the wheels slipped on the way to it
        self._sum = [0.0, 0.0, 0.0]
        self._samples = 0
        self._since_ns: int | None = None  # of this rest

    def update(self, rates_radps: Sequence[float] | None, standing: bool, now_ns: int, slips: bool = False) -> None:
        """Process one tick. rates_radps: newest gyro sample, None if none came; standing, slips: of the wheels."""
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
