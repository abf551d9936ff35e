"""Link state that a station saves across restarts, to recognise the rover."""

from __future__ import annotations

from typing import NamedTuple


class SavedLinkState(NamedTuple):
    """Saved link state.

    boot_id: newest boot id of the rover; 0: none.
    epoch: newest key epoch; -1: the first.
    heard: highest downlink counter of that boot; -1: none.
    rtt_ns: round-trip time; 0: not known.
    """

    boot_id: int = 0
    epoch: int = -1
    heard: int = -1
    rtt_ns: int = 0


NOTHING = SavedLinkState()
