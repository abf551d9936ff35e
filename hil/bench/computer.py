"""The rover's computer as a bench has it: it runs every tick and says nothing of itself until a fault changes that."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from zlib import crc32

from onboard.records import Machine

SLOW_EVERY = 10  # ticks, of which a slow computer leaves out one
LOOK_TICKS = 100


@dataclass(slots=True)
class Computer:
    """hangs: no tick runs. slow: every tenth is left out. machine: what it tells of itself once a second, if anything.

    left_out: ticks so far. crc: of all that it told.
    """

    hangs: bool = False
    slow: bool = False
    machine: Machine | None = None
    left_out: int = 0
    crc: int = 0

    def leaves_out(self, tick: int) -> bool:
        """Whether the flight program does not get to this tick; what comes meanwhile waits. Once for each tick."""
        late = self.hangs or (self.slow and tick % SLOW_EVERY == 0)
        self.left_out += late
        return late

    def says(self, tick: int) -> Machine | None:
        """What it tells of itself in this tick. Once for each tick that runs."""
        if self.machine is None or tick % LOOK_TICKS:
            return None
        self.crc = crc32(struct.pack(f"<{len(self.machine)}d", *self.machine), self.crc)
        return self.machine
