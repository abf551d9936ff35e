"""Lock of the state folder: one flight program at a time.

A second program would take the next start number, and stations would then refuse the first for good. The lock is the
kernel's (flock), so a killed program or a power cut leaves none behind; the process id in the file is for people.
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from types import TracebackType
from typing import Self

NAME = "lock"


class FolderTakenError(OSError):
    """Another program has the folder; the text is one line that names it and what to do."""


class FolderLock:
    """Lock from construction to the end of `with`. Without a folder there is nothing to lock.

    trouble: one line if a named folder could not be locked: a full or read-only disk does not ground the rover.
    Raises FolderTakenError.
    """

    def __init__(self, folder: str) -> None:
        self.trouble = ""
        self._fd = -1
        if not folder:
            return
        path = Path(folder) / NAME
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            os.fchmod(self._fd, 0o600)  # who may read the file may lock it
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.ftruncate(self._fd, 0)
            os.pwrite(self._fd, b"%d" % os.getpid(), 0)
        except BlockingIOError:
            who = os.pread(self._fd, 20, 0).decode("ascii", "replace").strip()
            self.close()
            whose = f"process {who}" if who.isdigit() else "another program"
            raise FolderTakenError(
                f"state.folder = {folder!r} is in use by {whose}: one flight program at a time. End "
                "it (systemctl stop el-dorado), or name another folder"
            ) from None
        except OSError as error:
            self.trouble = f"state.folder = {folder!r} is not locked against a second flight program: {error.strerror}"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Release the lock; may be called again."""
        if self._fd >= 0:
            os.close(self._fd)
        self._fd = -1
