"""Why a record is not on the disk as it should be, for commands whose purpose is the record."""

from __future__ import annotations

from onboard.record.writer import Recorder
from onboard.records import RecordTrouble


def unwritten(recorder: Recorder) -> str:
    """What the disk says, and what that cost; "" where it has taken all, which is certain after `close` only."""
    status = recorder.status
    if status.trouble is RecordTrouble.NONE and not status.lost_ticks:
        return ""
    lost = f"{status.lost_ticks} ticks were not kept" if status.lost_ticks else ""
    return ", ".join(text for text in (status.error, lost) if text)
