"""Messages of the daemon on standard error: lines for people, or lines with levels if the journal reads them.

systemd sets JOURNAL_STREAM to device and inode of the stream that it gave to a service. If that is our standard error,
each line begins with `<3>` or similar, which the journal takes as its level (sd-daemon(3)); the journal adds the name
of the program itself.
"""

from __future__ import annotations

import os
import sys
import traceback
from contextlib import suppress
from enum import IntEnum
from types import TracebackType
from typing import Protocol

from protocol.visible import visible_lines


class Level(IntEnum):
    """Levels of syslog(3) in use; they are also the severities of events."""

    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


class Announce(Protocol):
    """Interface of a function that takes lines for the operator of the machine."""

    def __call__(self, text: str, level: Level = Level.INFO) -> None:
        """Report one message."""


def to_journal() -> bool:
    """Return whether the journal reads standard error."""
    wanted = os.environ.get("JOURNAL_STREAM", "")
    try:
        at = os.fstat(sys.stderr.fileno())
    except (OSError, ValueError, AttributeError):  # closed, or not a stream of the system
        return False
    return wanted == f"{at.st_dev}:{at.st_ino}"


def say(text: str, level: Level = Level.INFO) -> None:
    """Write a message to standard error, each line with its level if the journal reads it. A dead reader is ignored.

    Control characters are made visible: a message may quote a file, a device, or a program at the other end.
    """
    text = visible_lines(text)
    head = f"<{level:d}>" if to_journal() else "onboard: "
    lines = text.splitlines() if to_journal() else [text]
    with suppress(OSError):  # the reader has gone; the rover drives on
        sys.stderr.write("".join(f"{head}{line}\n" for line in lines))
        sys.stderr.flush()


def say_error(kind: type[BaseException], error: BaseException, at: TracebackType | None) -> None:
    """Report an uncaught error with its traceback; for sys.excepthook."""
    say("".join(traceback.format_exception(kind, error, at)).rstrip(), Level.ERROR)
