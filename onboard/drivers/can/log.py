"""Reader of binary and vendor logs of a CAN bus by python-can: Vector .asc and .blf."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import can
from can.io.asc import ASCReader
from can.io.blf import BLFParseError, BLFReader

SUFFIXES = {".asc": ASCReader, ".blf": BLFReader}


def messages_of(path: Path) -> Iterator[tuple[int, int, bytes, str]]:
    """Yield (stamp in ns, id, data, kind) of each message; kind as in onboard.bringup.can.candump.ReceivedFrame.

    Raises OSError for a file that cannot be read, ValueError for one that is damaged.
    """
    reader = SUFFIXES[path.suffix.lower()]
    try:
        with path.open("rb" if reader is BLFReader else "r") as file, reader(file) as messages:
            for message in messages:
                yield round(message.timestamp * 1e9), message.arbitration_id, bytes(message.data), _kind(message)
    except (BLFParseError, can.CanError, zlib.error, struct.error, IndexError, KeyError) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


def _kind(message: can.Message) -> str:
    kinds = (
        (message.is_error_frame, "error frame"),
        (message.is_fd, "CAN FD frame"),
        (message.is_remote_frame, "remote frame"),
        (message.is_extended_id, "extended frame"),
    )
    return next((kind for holds, kind in kinds if holds), "data")
