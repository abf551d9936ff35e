"""The rover's disk in a bench of one process: it can refuse, and unless it is told to, it keeps nothing."""

from __future__ import annotations

from pathlib import Path

from onboard.drivers.record_file import DiskFile, OpenFile

ROOM_BYTES = 1 << 40


class Disk:
    """refuses: the errno of every request, 0: it does what it is asked. refused_ticks: how long that was so.

    keeps: its files are files of this machine.
    """

    def __init__(self) -> None:
        self.refuses = self.refused_ticks = 0
        self.keeps = False

    def note(self) -> None:
        """Each tick."""
        self.refused_ticks += self.refuses != 0

    def open(self, path: Path) -> OpenFile:
        """Raises OSError while it refuses."""
        self.ask()
        return File(self, DiskFile(path) if self.keeps else None)

    def ask(self) -> None:
        """Raises OSError while it refuses."""
        if self.refuses:
            raise OSError(self.refuses, "the emulated disk refuses")


class File:
    """An onboard.drivers.record_file.OpenFile of this disk. kept: where its bytes go, if anywhere."""

    def __init__(self, disk: Disk, kept: DiskFile | None) -> None:
        self._disk, self._kept = disk, kept

    def put(self, data: bytes, offset: int) -> None:
        """See OpenFile."""
        self._disk.ask()
        if self._kept:
            self._kept.put(data, offset)

    def force(self) -> None:
        """See OpenFile. What is kept outlives this process, which is all that a test asks."""
        self._disk.ask()

    def cut(self, size: int) -> None:
        """See OpenFile."""
        self._disk.ask()
        if self._kept:
            self._kept.cut(size)

    def free_bytes(self) -> int:
        """See OpenFile."""
        return ROOM_BYTES

    def close(self) -> None:
        """See OpenFile."""
        if self._kept:
            self._kept.close()
