"""Rover's disk in a one-process bench: it can refuse requests; by default it stores nothing."""

from __future__ import annotations

from pathlib import Path

from onboard.drivers.storage.record_file import DiskFile, OpenFile

ROOM_BYTES = 1 << 40


class Disk:
    """Emulated disk.

    refuses: errno of every request, 0 for success
    refused_ticks: number of ticks during which it refused
    keeps: True if its files are real files of this machine
    """

    def __init__(self) -> None:
        self.refuses = self.refused_ticks = 0
        self.keeps = False

    def note(self) -> None:
        """Count the tick; call each tick."""
        self.refused_ticks += self.refuses != 0

    def open(self, path: Path) -> OpenFile:
        """Open a file. Raises OSError while the disk refuses."""
        self.ask()
        return File(self, DiskFile(path) if self.keeps else None)

    def ask(self) -> None:
        """Raise OSError while the disk refuses."""
        if self.refuses:
            raise OSError(self.refuses, "the emulated disk refuses")


class File:
    """An onboard.drivers.storage.record_file.OpenFile on this disk. kept: real file for its bytes, or None."""

    def __init__(self, disk: Disk, kept: DiskFile | None) -> None:
        self._disk, self._kept = disk, kept

    def put(self, data: bytes, offset: int) -> None:
        """See OpenFile."""
        self._disk.ask()
        if self._kept:
            self._kept.put(data, offset)

    def force(self) -> None:
        """See OpenFile. Does not sync: the file survives this process, which is enough for a test."""
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
