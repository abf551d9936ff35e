"""Description of a record that is not complete on the disk, for commands whose purpose is the record."""

from __future__ import annotations

from onboard.record.writer import Recorder
from onboard.records import RecordTrouble


def unwritten(recorder: Recorder) -> str:
    """Text with the disk's error and the lost ticks; "" if all was stored, which is certain after `close` only."""
    status = recorder.status
    if status.trouble is RecordTrouble.NONE and not status.lost_ticks:
        return ""
    lost = f"{status.lost_ticks} ticks were not kept" if status.lost_ticks else ""
    return ", ".join(text for text in (status.error, lost) if text)
