"""What a rover's record says that it sent down: for the archive, where the link lost it."""

from __future__ import annotations

import struct
import tomllib
from collections.abc import Iterator
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import make_reader
from zstandard import ZstdError

from ground.session.telemetry import Event, TelemetryReceiver, Value
from protocol import WireError
from protocol.link import Kind

_PAYLOAD = struct.Struct("<BH")  # of channel /out/link: kind, length, then the bytes (onboard/record/schema.py)
_DAMAGE = (McapError, ZstdError, EOFError, ValueError, KeyError, struct.error)


class NoTalkError(ValueError):
    """The file is no record of a rover, or damaged; one line that names it."""


def told_down(path: Path) -> tuple[int, list[Value | Event]]:
    """Boot id, and every value and event that was put on the link, in order. Raises NoTalkError."""
    try:
        with path.open("rb") as file:
            reader = make_reader(file)
            attached = {a.name: a.data for a in reader.iter_attachments()}
            config = tomllib.loads(attached["config.toml"].decode())
            boot_id = int(config.get("link", {}).get("boot_count", 1))
            receiver, heard = TelemetryReceiver(), list[Value | Event]()
            for _, _, message in reader.iter_messages(topics=["/out/link"]):
                for kind, payload in _payloads(message.data):
                    if kind == Kind.MAVLINK:
                        heard += _read(receiver, payload, message.log_time)
    except OSError as error:
        raise NoTalkError(f"{path}: {error.strerror}") from error
    except _DAMAGE as error:
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
