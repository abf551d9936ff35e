"""Times as people type and read them: UTC, or an age."""

from __future__ import annotations

import time
from datetime import UTC, datetime

_UNITS = {"s": 1, "m": 60, "h": 3600, "d": 86_400}
FIRST_UTC_NS = 10**15  # the first eleven days of 1970: an earlier time is of a run in lock-step
ALLOWED = "UTC like 2030-01-31T12:00, or so long ago like 90s, 10m, 2h, 3d"


def utc_ns(text: str) -> int:
    """Convert `2030-01-31T12:00`, `2030-01-31` or `10m` (ago) to UTC in ns. Raises ValueError with what is allowed."""
    try:
        if text and text[-1] in _UNITS:
            return time.time_ns() - round(float(text[:-1]) * _UNITS[text[-1]] * 1e9)
        at = datetime.fromisoformat(text)
        return round((at if at.tzinfo else at.replace(tzinfo=UTC)).timestamp() * 1e9)
    except ValueError:
        raise ValueError(f"`{text}` is no time; write {ALLOWED}") from None


def onboard(onboard_ns: int | None, zero_ns: int | None) -> str:
    """Return onboard time in s with its UTC, if the UTC of the boot's zero is known; "" for no time."""
    if onboard_ns is None:
        return ""
    return f"onboard {onboard_ns / 1e9:.2f} s" + (f", {told(zero_ns + onboard_ns)}" if zero_ns is not None else "")


def told(at_ns: int) -> str:
    """Return UTC to the tenth of a second; of a run in lock-step the seconds of the run."""
    if at_ns < FIRST_UTC_NS:
        return f"{at_ns / 1e9:.2f} s"
    return datetime.fromtimestamp(at_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M:%S.") + f"{at_ns // 100_000_000 % 10}"
