"""Angle of the mirror over time, and the sensor's own counter.

A turn is 1440 steps, of which 1081 are beams and the rest is blind:

    turn k   |beam 0 ............ beam 1080|  blind  |beam 0 ...          17.36 us from beam to beam
             ^ start_ns(k)                 ^ + sweep_ns
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hil.devices.lidar.profile import Profile
from hil.own_functions import generator
from protocol import scip

BEAMS, STEPS_A_TURN, FRONT_STEP = 1081, 1440, 540
BLOCK_TURNS, JITTER_STREAM = 1024, 2  # the seed's stream 1 is that of the faults, 3 that of the light


class Turns:
    """Motor: turn k is a function of k and the seed, independent of calls for other turns."""

    def __init__(self, seed: int, profile: Profile) -> None:
        self._seed, self._jitter_ns = seed, profile.motor_jitter_ns
        self._standard_ns = profile.turn_ns / (1.0 + profile.rate_error)  # in bench time
        self._first, self._first_ns = 0, 0.0
        self._block, self._jitters_ns = -1, np.empty(0)  # jitter of the turns of one block, drawn together
        self.turn_ns = self._standard_ns
        self._measure()

    def _measure(self) -> None:
        self.beam_offsets_ns: NDArray[np.floating] = np.arange(BEAMS) * (self.turn_ns / STEPS_A_TURN)
        self.sweep_ns = float(self.beam_offsets_ns[-1])

    def start_ns(self, turn: int) -> float:
        """Time at which beam 0 of a turn is fired. Turns before turn 0 have no jitter."""
        even_ns = self._first_ns + (turn - self._first) * self.turn_ns
        return even_ns + self._jitter_of(turn) if self._jitter_ns and turn >= 0 else even_ns

    def _jitter_of(self, turn: int) -> float:
        block, place = divmod(turn, BLOCK_TURNS)
        if block != self._block:
            drawn = generator((self._seed, JITTER_STREAM, block)).standard_normal(BLOCK_TURNS)
            self._block, self._jitters_ns = block, drawn * self._jitter_ns
        return float(self._jitters_ns[place])

    def ended(self, now_ns: int) -> int:
        """Number of the last turn whose sweep is over; may be one less with motor jitter."""
        turn = self._first + int((now_ns - self._first_ns - self.sweep_ns) // self.turn_ns)
        return turn if self.start_ns(turn) + self.sweep_ns <= now_ns else turn - 1

    def end_ns(self, turn: int) -> float:
        """Time at which the last beam of a turn is fired."""
        return self.start_ns(turn) + self.sweep_ns

    def slow_down(self, percent: int, now_ns: int) -> None:
        """Slow the motor by `percent` of its standard period, from the first turn whose sweep is not over."""
        turn = self.ended(now_ns) + 1
        self._first, self._first_ns = turn, self._first_ns + (turn - self._first) * self.turn_ns
        self.turn_ns = self._standard_ns * (1.0 + percent / 100.0)
        self._measure()


class Counter:
    """Sensor's 24-bit counter of milliseconds, with a rate error and a start value."""

    def __init__(self, profile: Profile) -> None:
        self._rate = 1.0 + profile.rate_error
        self._zero_ms = -profile.start_ms

    def ms(self, at_ns: float) -> int:
        """Count at a bench time."""
        return int(at_ns * self._rate * 1e-6 - self._zero_ms) % scip.STAMP_MODULUS

    def reset(self, now_ns: int) -> None:
        """Restart the count at zero."""
        self._zero_ms = now_ns * self._rate * 1e-6

    def jump(self, by_ms: float) -> None:
        """Add a jump to the count."""
        self._zero_ms -= by_ms
