"""Counter of a halting command, also if the station's disk cannot be written now or could not be before.

The rover accepts a counter that is above its mark and at most MAX_JUMP above it; its mark is then that counter. The
station's file has `halt`, the next counter, and `told`, the one after the newest that the rover is known to have
accepted. `unheard` counts halting datagrams without an answer.

    told      halt            told + 2^18             told + 2^19             told + 2^20
    |---------|---------------|-----------------------|-----------------------|
              ^ kept          ^ unkept, unheard       ^ kept, unheard         no jump goes further

Rule 1: While the file can be written, each command takes `halt` and stores halt + 1.
Rule 2: While it cannot, the seconds of UTC are added, modulo 2^16. Two processes that both cannot write then differ,
        and the later is above the earlier. No file has such a counter, so the mark may be ahead of the file after that.
Rule 3: After every four halting datagrams without an answer the counter goes a step further, since the mark may be
        ahead. Steps count from `told`, not from each other, so no number of unanswered stops exceeds the rover's jump.
"""

from __future__ import annotations

UNHEARD, STEPS = 4, 4
_CLOCK, _UNKEPT, _UNKEPT_STEP, _KEPT, _KEPT_STEP = 1 << 16, 1 << 18, 1 << 16, 1 << 19, 1 << 17


def kept(halt: int, told: int, unheard: int) -> int:
    """Return the counter if the file can be written.

    unheard: halting datagrams of this process since the rover answered one.
    """
    step = min(unheard // UNHEARD, STEPS)
    return max(halt, told + _KEPT + (step - 1) * _KEPT_STEP) if step else halt


def unkept(halt: int, told: int, unheard: int, utc_s: int) -> int:
    """Return the counter if the file cannot be written."""
    step, clock = min(unheard // UNHEARD, STEPS), utc_s % _CLOCK
    return max(halt, told + _UNKEPT + (step - 1) * _UNKEPT_STEP if step else 0) + clock
