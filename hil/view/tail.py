"""Incremental reader of a record that may still be written: every complete message, each once."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Footer, Message
from mcap.stream_reader import MAGIC_SIZE, StreamReader
from zstandard import ZstdError

_HEAD = struct.Struct("<BQ")  # of every MCAP record: its kind, and the number of bytes that follow
_LARGEST_BYTES = 1 << 30
_AT_ONCE_BYTES = 1 << 24


class NoRunError(ValueError):
    """The folder contains no run that can be watched; the text is one line with the file and the remedy."""


class Said(NamedTuple):
    """Message of a record."""

    topic: str
    time_s: float
    data: bytes
    sequence: int


class Tail:
    """Reader of an MCAP file in its order. `finished`: True if its writer has closed it."""

    def __init__(self, path: Path) -> None:
        self.path, self.finished = path, False
        self._at = 0
        self._topics: dict[int, str] = {}

    def read(self) -> Iterator[Said]:
        """Messages since the last call; none if there is no file. Raises NoRunError."""
        while part := self._whole():
            try:
                yield from self._messages(part)
            except EndOfFile:
                pass
            except (McapError, ZstdError, ValueError, KeyError, struct.error) as error:
                raise NoRunError(f"{self.path} is damaged: {type(error).__name__}: {error}") from error

    def _messages(self, part: bytes) -> Iterator[Said]:
        """Messages of complete records; ends with EndOfFile at the end of the part."""
        for record in StreamReader(io.BytesIO(part), skip_magic=True, validate_crcs=True).records:
            if isinstance(record, Channel):
                self._topics[record.id] = record.topic
            elif isinstance(record, Message):
                yield Said(self._topics[record.channel_id], record.log_time / 1e9, record.data, record.sequence)
            elif isinstance(record, Footer):
                self.finished = True

    def _whole(self) -> bytes:
        """Bytes of the next complete records, b'' for none."""
        if self.finished or not self.path.is_file():
            return b""
        with self.path.open("rb") as file:
            size = file.seek(0, io.SEEK_END)
            if size < self._at:
                raise NoRunError(
                    f"{self.path} was replaced: another run has started in this folder; start `hil watch` again"
                )
            if self._at == 0:
                if size < MAGIC_SIZE:
                    return b""
                file.seek(0)
                if not file.read(MAGIC_SIZE).startswith(b"\x89MCAP"):
                    raise NoRunError(f"{self.path} is damaged: it does not begin as a record does")
                self._at = MAGIC_SIZE
            start = end = self._at
            while end + _HEAD.size <= size and end - start < _AT_ONCE_BYTES:
                file.seek(end)
                _, length = _HEAD.unpack(file.read(_HEAD.size))
                if length > _LARGEST_BYTES:
                    raise NoRunError(f"{self.path} is damaged: byte {end} begins a record of {length} bytes")
                if end + _HEAD.size + length > size:
                    break
                end += _HEAD.size + length
            file.seek(start)
            self._at = end
            return file.read(end - start)
