"""Rover's computer in a bench: it runs every tick and reports no health data until a fault changes that."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from zlib import crc32

from onboard.records import Machine

SLOW_EVERY = 10  # a slow computer skips one tick of this many
LOOK_TICKS = 100


@dataclass(slots=True)
class Computer:
    """State of the rover's computer.

    hangs: no tick runs
    slow: every tenth tick is skipped
    machine: health data that it reports once a second, or None
    left_out: number of skipped ticks so far
    crc: CRC of all reported health data
    """

    hangs: bool = False
    slow: bool = False
    machine: Machine | None = None
    left_out: int = 0
    crc: int = 0

    def leaves_out(self, tick: int) -> bool:
        """True if the flight program skips this tick; its input waits. Call once for each tick."""
        late = self.hangs or (self.slow and tick % SLOW_EVERY == 0)
        self.left_out += late
        return late

    def says(self, tick: int) -> Machine | None:
        """Health data reported in this tick, or None. Call once for each tick that runs."""
        if self.machine is None or tick % LOOK_TICKS:
            return None
        self.crc = crc32(struct.pack(f"<{len(self.machine)}d", *self.machine), self.crc)
        return self.machine
