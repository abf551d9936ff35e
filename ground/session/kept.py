"""What outlives a station: it knows the rover again after a restart, by this."""

from __future__ import annotations

from typing import NamedTuple


class Kept(NamedTuple):
    """What a station still knows of the rover from before: newest boot id, epoch (-1: the first), newest counter of it.

    heard: highest downlink counter of that boot, -1: none. rtt_ns: 0: not known.
    """

    boot_id: int = 0
    epoch: int = -1
    heard: int = -1
    rtt_ns: int = 0


NOTHING = Kept()
