"""Folder of saved state, without the map: parameters, fences, pose and the count of starts.

A file each, written whole or not at all (`disk.write_whole`).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from onboard.drivers.storage.map_tiles import write_whole
from onboard.records.status import EPOCH, Save, SaveResult

NAMES = ("parameters", "fences", "pose", EPOCH)  # the last is written by the link's port
BOOTS, MOST_BOOTS = "boots.json", 2**32 - 1  # the link has four bytes for it


def read_kept(folder: str) -> dict[str, bytes]:
    """Read the saved data of a folder, by name; empty if no folder is named or it does not exist. Raises OSError."""
    paths = {name: Path(folder) / f"{name}.json" for name in NAMES} if folder else {}
    return {name: path.read_bytes() for name, path in paths.items() if path.is_file()}


def count_boot(folder: str, least: int) -> tuple[int, str]:
    """Number of this start: one more than the last, at least `least`; and the error of its save, or ''.

    It is on the disk before it is used: the link distinguishes starts by it, and refuses messages to another start.
    """
    if not folder:
        return least, ""
    path = Path(folder) / BOOTS
    number, trouble = least, ""
    try:
        if path.is_file():
            last = int(path.read_text())
            if not 0 <= last < MOST_BOOTS:
                raise ValueError(f"{last} is no number of a start")
            number = max(least, last + 1)
    except (OSError, ValueError) as error:
        trouble = f"the count of starts in {path} cannot be read: {error}"
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_whole(path, b"%d" % number)
    except OSError as error:
        trouble = f"the count of starts in {path} is not kept: {error.strerror}"
    return number, trouble


class StateFolder:
    """Writer of the core's saves, one at a time, in a thread: a disk may take seconds.

    wait: lock-step, where a result belongs to the tick after its request.
    """

    def __init__(self, folder: str, wait: bool) -> None:
        self._folder, self._wait = Path(folder), wait
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="state")
        self._running: list[Future[SaveResult]] = []

    def start(self, saves: Sequence[Save]) -> None:
        """Start to write these; a later `collect` returns each result."""
        self._running += [self._pool.submit(self._write, save) for save in saves]

    def collect(self) -> tuple[SaveResult, ...]:
        """Return the results that are ready, in the order of the requests."""
        done = []
        while self._running and (self._wait or self._running[0].done()):
            done.append(self._running.pop(0).result())
        return tuple(done)

    def _write(self, save: Save) -> SaveResult:
        try:
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(self._folder / f"{save.name}.json", save.data)
        except OSError as error:
            return SaveResult(save.name, f"not kept: {error.strerror or error}")
        return SaveResult(save.name)

    def close(self) -> None:
        """Wait until all is written."""
        self._pool.shutdown(wait=True)
