"""STATUSTEXT: lines for people, in pieces of 50 bytes.

MAVLink 2 gives the pieces of a line one number (id, chunk_seq). The client joins them; a piece that is not full ends
the line. MAVLink 1 has no such number: its clients show every piece as a line, so pieces end between words.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ground.gateway.frames import mavlink as m

_PIECE, _MOST = 50, 200  # bytes
_SEVERITIES = {
    "debug": m.MAV_SEVERITY_DEBUG,
    "info": m.MAV_SEVERITY_INFO,
    "warning": m.MAV_SEVERITY_WARNING,
    "error": m.MAV_SEVERITY_ERROR,
    "critical": m.MAV_SEVERITY_CRITICAL,
}


class Text(NamedTuple):
    """Line for clients, encoded as each of them needs it.

    level: MAV_SEVERITY.
    raw: the text in UTF-8.
    number: of the line, 1 to 65535.
    """

    level: int
    raw: bytes
    number: int

    def messages(self, *, joins: bool) -> list[Any]:
        """Make its STATUSTEXTs. joins: True if the client speaks MAVLink 2 and joins pieces."""
        if not joins or len(self.raw) <= _PIECE:
            return [m.MAVLink_statustext_message(self.level, piece) for piece in between_words(self.raw)]
        pieces = [self.raw[i : i + _PIECE] for i in range(0, len(self.raw), _PIECE)]
        if len(pieces[-1]) == _PIECE:
            pieces.append(b"")  # a full last piece means that more follows
        return [m.MAVLink_statustext_message(self.level, piece, self.number, n) for n, piece in enumerate(pieces)]


class Texts:
    """Makes and numbers lines."""

    def __init__(self) -> None:
        self._number = 0

    def say(self, severity: str, text: str) -> Text:
        """Make a line of at most 200 bytes; a longer text ends after the last whole word that fits."""
        self._number = self._number % 65_535 + 1
        return Text(_SEVERITIES[severity], _first(text.encode(), _MOST)[0], self._number)


def between_words(raw: bytes) -> list[bytes]:
    """Split UTF-8 into pieces of at most 50 bytes, none of which ends within a word that fits a piece."""
    pieces = []
    while True:
        piece, raw = _first(raw, _PIECE)
        pieces.append(piece)
        if not raw:
            return pieces


def _first(raw: bytes, most: int) -> tuple[bytes, bytes]:
    """Return the part of a line that fits, and the rest: split between words if possible, else between characters."""
    if len(raw) <= most:
        return raw, b""
    end = raw.rfind(b" ", 0, most + 1)
    if end > 0:
        return raw[:end].rstrip(), raw[end:].lstrip()
    end = len(raw[:most].decode(errors="ignore").encode())
    return raw[:end], raw[end:]
