"""Mode and phase of a run's flight program, read from its record while the record is written."""

from __future__ import annotations

import json
from pathlib import Path

from hil.view.tail import NoRunError, Tail
from protocol.tables.modes import Mode, Phase


class Doing:
    """Reader of mode and phase of the run in a folder. The record reaches the disk twice a second."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "onboard.mcap"
        self._begin()

    def _begin(self) -> None:
        self._tail, self._boot = Tail(self._path), self._file()
        self._mode, self._phase = Mode.STANDBY.name, ""  # in which a flight program begins, without an event

    def words(self) -> str:
        """Return mode and phase, as `AUTONOMOUS driving`; "" before the record exists, or if it cannot be read."""
        if self._file() != self._boot:  # after a reboot another file has the name
            self._begin()
        try:
            for said in self._tail.read():
                if said.topic == "/out/event":
                    for name, text in events_of(said.data):
                        self._mode, self._phase = after(self._mode, self._phase, name, text)
        except NoRunError:
            return ""
        return " ".join([self._mode, self._phase]).strip() if self._boot else ""

    def _file(self) -> int:
        """Return the file's number in its file system; 0: there is none."""
        try:
            return self._path.stat().st_ino
        except OSError:
            return 0


def events_of(data: bytes) -> list[tuple[str, str]]:
    """Return name and text of each event of a message of /out/event. Raises NoRunError if it is none."""
    try:
        return [(str(row["name"]), str(row["text"])) for row in json.loads(data)]
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise NoRunError(f"no events: {error}") from error


def after(mode: str, phase: str, name: str, text: str) -> tuple[str, str]:
    """Return mode and phase after an event, MODE `STANDBY -> AUTONOMOUS: ...` or PHASE `DRIVING at stop 1`."""
    if name == "MODE":
        word = text.partition("->")[2].strip().partition(":")[0]
        return (word, "") if word in Mode.__members__ else (mode, phase)
    if name == "PHASE":
        word = text.partition(" ")[0]
        return mode, word.lower().replace("_", " ") if word in Phase.__members__ and word != "NONE" else ""
    return mode, phase
