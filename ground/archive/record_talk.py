"""Downlink content of a rover's record: values and events for the archive where the link lost them."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

from ground.link.telemetry import Event, TelemetryReceiver, Value
from onboard.record.reader import UNREADABLE, open_record
from onboard.record.schema import TICK
from onboard.toml_text import parse_toml
from protocol import WireError
from protocol.link.datagrams import DatagramKind

_PAYLOAD = struct.Struct("<BH")  # of channel /out/link: kind, length, then the bytes (onboard/record/schema.py)


class NoTalkError(ValueError):
    """The file is not a rover record, or is damaged. One line that names the file."""


class NoRecordError(NoTalkError):
    """The file does not exist or cannot be opened. One line that names it."""


def told_down(path: Path) -> tuple[int, list[Value | Event]]:
    """Return the boot id and every value and event sent on the link, in order. Of a growing record: those so far.

    Raises NoTalkError, NoRecordError.
    """
    try:
        record = open_record(path)
        config = parse_toml(record.attachments["config.toml"].decode())
        boot_id = int(config.get("link", {}).get("boot_count", 1))
        receiver, heard = TelemetryReceiver(), list[Value | Event]()
        for _, messages in record.ticks():
            now_ns = TICK.unpack_from(messages["/in/tick"])[1]
            for kind, payload in _payloads(messages.get("/out/link", b"")):
                if kind == DatagramKind.MAVLINK:
                    heard += _read(receiver, payload, now_ns)
    except OSError as error:
        raise NoRecordError(f"{path}: {error.strerror}") from error
    except UNREADABLE as error:
        raise NoTalkError(f"{path}: no record of a rover, or damaged: {error}") from error
    return boot_id, heard


def _read(receiver: TelemetryReceiver, payload: bytes, now_ns: int) -> list[Value | Event]:
    try:
        return receiver.receive(payload, now_ns)
    except WireError:
        return []


def _payloads(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(data):
        kind, length = _PAYLOAD.unpack_from(data, at)
        at += _PAYLOAD.size
        yield kind, data[at : at + length]
        at += length
