"""What a station must not forget: the next counter and request id, and the newest boot id heard.

The file always says more than was used: a block is reserved, written and synced before its first number is sealed,
so after a crash no counter is used twice. Several processes of one station reserve blocks of their own (file lock); one
whose numbers fall behind those of the others takes a new block, or the rover's replay window would pass over it.
"""

from __future__ import annotations

import fcntl
import json
import os
from pathlib import Path
from typing import NamedTuple

from onboard.config import ConfigError
from protocol.link import WINDOW

COUNTERS, REQUESTS = 640, 256
BEHIND = WINDOW - 2 * COUNTERS  # four processes at once stay nearer together than this


class Block(NamedTuple):
    """Numbers from the first to before the end belong to this process."""

    counter: int
    counter_end: int
    request_id: int
    request_end: int
    boot_id: int


class Memory:
    """One station's file in a state folder; without a folder numbers start from zero and nothing is kept (a bench)."""

    def __init__(self, folder: str, station: int) -> None:
        self._path = Path(folder) / f"station-{station}.json" if folder else None
        self._bench_next = (0, 1)
        self._read_ns, self._reserved = -1, 0  # when the file was that was read last; the end of all blocks in it

    def reserve(self, boot_id: int = 0) -> Block:
        """The next block; also notes the newest boot id. Raises OSError or ConfigError where that fails."""
        if self._path is None:
            counter, request_id = self._bench_next
            self._bench_next = (counter + COUNTERS, request_id + REQUESTS)
            return Block(counter, counter + COUNTERS, request_id, request_id + REQUESTS, boot_id)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with open(self._path.with_suffix(".lock"), "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            counter, request_id, newest = self._read()
            newest = max(newest, boot_id)
            self._write(counter + COUNTERS, request_id + REQUESTS, newest)
        return Block(counter, counter + COUNTERS, request_id, request_id + REQUESTS, newest)

    def behind(self, counter: int) -> bool:
        """Whether the blocks of other processes are so far on that this number is soon too old for the rover."""
        if self._path is None:
            return False
        changed_ns = self._path.stat().st_mtime_ns
        if changed_ns != self._read_ns:
            self._read_ns, self._reserved = changed_ns, self._read()[0]
        return self._reserved > counter + BEHIND

    def _read(self) -> tuple[int, int, int]:
        assert self._path is not None
        try:
            tree = json.loads(self._path.read_text())
            return int(tree["counter"]), int(tree["request_id"]), int(tree["boot_id"])
        except FileNotFoundError:
            return 0, 1, 0
        except (ValueError, KeyError, TypeError) as error:
            raise ConfigError(f"{self._path}: damaged ({error}); rotate the keys") from error

    def _write(self, counter: int, request_id: int, boot_id: int) -> None:
        assert self._path is not None
        fresh = self._path.with_suffix(".new")
        with open(fresh, "w") as file:
            json.dump({"counter": counter, "request_id": request_id, "boot_id": boot_id}, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(fresh, self._path)
