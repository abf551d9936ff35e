"""Append-only file, written outside the tick: the disk may be slow, full, read-only or gone, and the tick goes on.

    write, write, ... flush -> one piece -> [waiting pieces] -> thread: disk, forced -> next piece

A piece that the disk refuses stays first in the queue and is tried again with every flush, so a file that becomes
writable again has no hole. The rest of a refused write is cut off, so the file always ends with a whole piece.
"""

from __future__ import annotations

import errno
import hashlib
import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Protocol

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
STALLED_FLUSHES = 10  # flushes in a row while the last write still runs: the disk does not answer


class OpenFile(Protocol):
    """Interface of one file on a disk. All methods raise OSError on failure."""

    def put(self, data: bytes, offset: int) -> None:
        """Write all of `data` at the offset."""

    def force(self) -> None:
        """Return when all written data survives a power cut."""

    def cut(self, size: int) -> None:
        """Truncate to this size."""

    def free_bytes(self) -> int:
        """Free space on the disk."""

    def close(self) -> None:
        """Close the file; the last call."""


class DiskFile:
    """File on a real disk: newly created, with its folder if necessary. Raises OSError."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)

    def put(self, data: bytes, offset: int) -> None:
        """See OpenFile."""
        left = memoryview(data)
        while left:
            done = os.pwrite(self._fd, left, offset)
            left, offset = left[done:], offset + done

    def force(self) -> None:
        """See OpenFile."""
        os.fdatasync(self._fd)

    def cut(self, size: int) -> None:
        """See OpenFile."""
        os.ftruncate(self._fd, size)

    def free_bytes(self) -> int:
        """See OpenFile."""
        room = os.fstatvfs(self._fd)
        return room.f_bavail * room.f_frsize

    def close(self) -> None:
        """See OpenFile."""
        os.close(self._fd)


Opener = Callable[[Path], OpenFile]


class RecordFile:
    """File object for the writer of a file format: `write`, `tell`, `flush`.

    spare_bytes: space that must stay free on the disk.
    wait: lock-step, where `flush` returns when the disk has answered.
    sha256: over all data written, on the disk or not.
    """

    def __init__(self, path: Path, spare_bytes: int, wait: bool, opener: Opener = DiskFile) -> None:
        self.path, self._spare_bytes, self._wait, self._opener = path, spare_bytes, wait, opener
        self.sha256 = hashlib.sha256()
        self.error: OSError | None = None
        self.ended = False
        self._gathered = bytearray()
        self._pieces: deque[bytes] = deque()
        self._size = self._on_disk = self._stalled = 0
        self._file: OpenFile | None = None
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="record")
        self._writing: Future[None] | None = None

    # -- for the writer of the format ------------------------------------------------------------------------------

    def write(self, data: bytes) -> int:
        """Store data until the next flush."""
        self._gathered += data
        self._size += len(data)
        self.sha256.update(data)
        return len(data)

    def tell(self) -> int:
        """Offset of the next byte in the file."""
        return self._size

    def flush(self) -> None:
        """Close a piece: the data since the last flush; it will be in the file whole, or not at all."""
        self._gather()
        if self._writing is None or self._writing.done():
            self._stalled = 0
            self._writing = self._pool.submit(self._empty)
        else:
            self._stalled += 1
            if self._stalled >= STALLED_FLUSHES:
                self.error = OSError(errno.ETIMEDOUT, "the disk does not answer")
        if self._wait:
            self.settle()

    # -- for its owner ----------------------------------------------------------------------------------------------

    @property
    def waiting_bytes(self) -> int:
        """Number of bytes that are not on the disk yet."""
        return self._size - self._on_disk

    def settle(self) -> None:
        """Wait until the disk has answered the flushed pieces."""
        if self._writing is not None:
            self._writing.result()

    def end(self, finish: Callable[[], None]) -> None:
        """Let `finish` write the end outside the tick, as that takes long; nothing may be written afterwards."""
        self._pool.submit(self._end, finish)
        if self._wait:
            self.close()

    def close(self) -> None:
        """Wait until all pieces that the disk takes are written."""
        self._pool.shutdown(wait=True)
        if self._file is not None:
            self._file.close()
            self._file = None

    def _gather(self) -> None:
        if self._gathered:
            self._pieces.append(bytes(self._gathered))
            self._gathered.clear()

    def _end(self, finish: Callable[[], None]) -> None:
        finish()
        self._gather()
        self._empty()
        self.ended = True

    def _empty(self) -> None:
        """Write as many pieces as the disk takes; runs in the thread."""
        try:
            self._file = self._file or self._opener(self.path)
            while self._pieces:
                self._put(self._file, self._pieces[0])
                self._on_disk += len(self._pieces.popleft())
            self.error = None
        except OSError as error:
            self.error = error
            if self._file is not None:
                with suppress(OSError):
                    self._file.cut(self._on_disk)

    def _put(self, file: OpenFile, piece: bytes) -> None:
        free = file.free_bytes()
        if free < self._spare_bytes + len(piece):
            room = f"{free >> 20} MB are free on the disk, {self._spare_bytes >> 20} MB are to stay free"
            raise OSError(errno.ENOSPC, room)
        file.put(piece, self._on_disk)
        file.force()
