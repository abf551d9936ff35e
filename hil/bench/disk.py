"""The rover's disk in a bench of one process: it keeps nothing, and it can refuse."""

from __future__ import annotations

from pathlib import Path

ROOM_BYTES = 1 << 40


class Disk:
    """refuses: the errno of every request, 0: it does what it is asked. refused_ticks: how long that was so."""

    def __init__(self) -> None:
        self.refuses = self.refused_ticks = 0

    def note(self) -> None:
        """Each tick."""
        self.refused_ticks += self.refuses != 0

    def open(self, path: Path) -> File:
        """An onboard.drivers.record_file.OpenFile."""
        self.ask()
        return File(self)

    def ask(self) -> None:
        """Raises OSError while it refuses."""
        if self.refuses:
            raise OSError(self.refuses, "the emulated disk refuses")


class File:
    """A file of which nothing is kept."""

    def __init__(self, disk: Disk) -> None:
        self._disk = disk

    def put(self, data: bytes, offset: int) -> None:
        """See OpenFile."""
        self._disk.ask()

    def force(self) -> None:
        """See OpenFile."""
        self._disk.ask()

    def cut(self, size: int) -> None:
        """See OpenFile."""
        self._disk.ask()

    def free_bytes(self) -> int:
        """See OpenFile."""
        return ROOM_BYTES

    def close(self) -> None:
        """See OpenFile."""
