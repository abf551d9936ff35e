"""When the mirror is where, and what the sensor's own counter says then.

A turn is 1440 steps, of which 1081 are beams and the rest is blind:

    turn k   |beam 0 ............ beam 1080|  blind  |beam 0 ...          17.36 us from beam to beam
             ^ start_ns(k)                 ^ + sweep_ns
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hil.devices.lidar_profile import Profile
from protocol import scip

BEAMS, STEPS_A_TURN, FRONT_STEP = 1081, 1440, 540


class Turns:
    """The motor: turn k as a function of k and the seed, so that nobody has to ask for the turns in between."""

    def __init__(self, seed: int, profile: Profile) -> None:
        self._seed, self._jitter_ns = seed, profile.motor_jitter_ns
        self._standard_ns = profile.turn_ns / (1.0 + profile.rate_error)  # of bench time
        self._first, self._first_ns = 0, 0.0
        self.turn_ns = self._standard_ns
        self._measure()

    def _measure(self) -> None:
        self.beam_offsets_ns: NDArray[np.floating] = np.arange(BEAMS) * (self.turn_ns / STEPS_A_TURN)
        self.sweep_ns = float(self.beam_offsets_ns[-1])

    def start_ns(self, turn: int) -> float:
        """When beam 0 of a turn is fired."""
        even_ns = self._first_ns + (turn - self._first) * self.turn_ns
        if not self._jitter_ns:
            return even_ns
        rng = np.random.default_rng((self._seed, turn % (1 << 32)))  # at time 0 the turn before the first is asked for
        return even_ns + float(rng.standard_normal()) * self._jitter_ns

    def ended(self, now_ns: int) -> int:
        """The last turn whose sweep is over; may be one less with motor jitter."""
        turn = self._first + int((now_ns - self._first_ns - self.sweep_ns) // self.turn_ns)
        return turn if self.start_ns(turn) + self.sweep_ns <= now_ns else turn - 1

    def end_ns(self, turn: int) -> float:
        """When the last beam of a turn is fired."""
        return self.start_ns(turn) + self.sweep_ns

    def slow_down(self, percent: int, now_ns: int) -> None:
        """From the turn under way on, turn so much slower than at first."""
        turn = self.ended(now_ns) + 1
        self._first, self._first_ns = turn, self._first_ns + (turn - self._first) * self.turn_ns
        self.turn_ns = self._standard_ns * (1.0 + percent / 100.0)
        self._measure()


class Counter:
    """The sensor's 24-bit counter of milliseconds, with an error of rate and a start of its own."""

    def __init__(self, profile: Profile) -> None:
        self._rate = 1.0 + profile.rate_error
        self._zero_ms = -profile.start_ms

    def ms(self, at_ns: float) -> int:
        """The count at a bench time."""
        return int(at_ns * self._rate * 1e-6 - self._zero_ms) % scip.STAMP_MODULUS

    def reset(self, now_ns: int) -> None:
        """Count from zero."""
        self._zero_ms = now_ns * self._rate * 1e-6

    def jump(self, by_ms: float) -> None:
        """Count on from elsewhere."""
        self._zero_ms -= by_ms
