"""What the daemon says on standard error: lines for people, or with the levels of the journal where it listens.

systemd sets JOURNAL_STREAM to device and inode of the stream that it gave to a service. Where that is our standard
error, each line begins with `<3>` and the like, which the journal takes as its level (sd-daemon(3)); the name of the
program is the journal's to say.
"""

from __future__ import annotations

import os
import sys
import traceback
from contextlib import suppress
from enum import IntEnum
from types import TracebackType
from typing import Protocol


class Level(IntEnum):
    """Levels of syslog(3) that are used, and the severities of events."""

    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


class Announce(Protocol):
    """Whoever is told lines for the operator of the machine."""

    def __call__(self, text: str, level: Level = Level.INFO) -> None:
        """One message."""


def to_journal() -> bool:
    """Whether the journal reads what goes to standard error."""
    wanted = os.environ.get("JOURNAL_STREAM", "")
    try:
        at = os.fstat(sys.stderr.fileno())
    except (OSError, ValueError, AttributeError):  # closed, or none of the system's
        return False
    return wanted == f"{at.st_dev}:{at.st_ino}"


def say(text: str, level: Level = Level.INFO) -> None:
    """A message to standard error, each line with its level where the journal reads it. Nobody there: it is lost."""
    head = f"<{level:d}>" if to_journal() else "onboard: "
    lines = text.splitlines() if to_journal() else [text]
    with suppress(OSError):  # whoever read it has gone; the rover drives on
        sys.stderr.write("".join(f"{head}{line}\n" for line in lines))
        sys.stderr.flush()


def say_error(kind: type[BaseException], error: BaseException, at: TracebackType | None) -> None:
    """For sys.excepthook: an error of our own with its way through the program."""
    say("".join(traceback.format_exception(kind, error, at)).rstrip(), Level.ERROR)
