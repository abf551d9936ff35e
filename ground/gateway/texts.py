"""STATUSTEXT: lines for people, in pieces of 50 bytes.

MAVLink 2 puts pieces under one number (id, chunk_seq): the program joins them, and a piece that is not full ends the
line. MAVLink 1 knows none of that: its programs show every piece as a line of its own, so those end between words.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ground.gateway.frames import mavlink as m

_PIECE, _MOST = 50, 200  # bytes
_SEVERITIES = {"debug": m.MAV_SEVERITY_DEBUG, "info": m.MAV_SEVERITY_INFO, "warning": m.MAV_SEVERITY_WARNING,
               "error": m.MAV_SEVERITY_ERROR, "critical": m.MAV_SEVERITY_CRITICAL}


class Text(NamedTuple):
    """A line that is to be said to a client in its own way. number: of the line, 1 to 65535."""

    level: int
    raw: bytes
    number: int

    def messages(self, *, joins: bool) -> list[Any]:
        """Its STATUSTEXTs. joins: whether the program knows MAVLink 2 and joins pieces."""
        if not joins or len(self.raw) <= _PIECE:
            return [m.MAVLink_statustext_message(self.level, piece) for piece in between_words(self.raw)]
        pieces = [self.raw[i : i + _PIECE] for i in range(0, len(self.raw), _PIECE)]
        if len(pieces[-1]) == _PIECE:
            pieces.append(b"")  # a whole last piece says that more follows
        return [m.MAVLink_statustext_message(self.level, piece, self.number, n) for n, piece in enumerate(pieces)]


class Texts:
    """Makes and numbers lines."""

    def __init__(self) -> None:
        self._number = 0

    def say(self, severity: str, text: str) -> Text:
        """A line, of 200 bytes at most: a longer one ends with its last whole word before that."""
        self._number = self._number % 65_535 + 1
        return Text(_SEVERITIES[severity], _first(text.encode(), _MOST)[0], self._number)


def between_words(raw: bytes) -> list[bytes]:
    """UTF-8 in pieces of at most 50 bytes, none of which ends within a word that fits a piece."""
    pieces = []
    while True:
        piece, raw = _first(raw, _PIECE)
        pieces.append(piece)
        if not raw:
            return pieces


def _first(raw: bytes, most: int) -> tuple[bytes, bytes]:
    """What of a line fits, and the rest; between words where one ends in it, else between characters."""
    if len(raw) <= most:
        return raw, b""
    end = raw.rfind(b" ", 0, most + 1)
    if end > 0:
        return raw[:end].rstrip(), raw[end:].lstrip()
    end = len(raw[:most].decode(errors="ignore").encode())
    return raw[:end], raw[end:]
