"""Saved state of the rover's end of the link: for each key the newest counter and highest request id of its halts, and
the key epoch.

Both are in the state folder, whole or not at all. A mark belongs to a key, identified by its fingerprint: with a new
secret the count restarts. A mark is written outside the tick and its command waits for it, HOLD_NS at most: a stop
never waits for a failed disk. A command that ran before its mark was written could be sent again by others after a
restart; this is reported.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from pathlib import Path
from typing import TypeVar

from onboard.config import ConfigError
from onboard.drivers.storage.map_tiles import write_whole
from onboard.records.status import EPOCH, SaveResult
from protocol.link.keyring import Keyring, LinkKeys

T = TypeVar("T")
MARKS = "halts.json"
HOLD_NS = 200_000_000
_ASKED = " asked"  # suffix of a key's name in the file: the highest request id that halted


class LinkMemory:
    """Marks and epoch of these keys. Without a folder both end with the run (a bench).

    marks, halted: saved counters and request ids, by key id.
    epoch: in force at the start.
    wait: lock-step, where each write is awaited.
    Raises ConfigError for a file that cannot be read: no count restarts by itself.
    """

    def __init__(self, folder: str, keys: LinkKeys, wait: bool = True) -> None:
        self._folder, self._wait = Path(folder) if folder else None, wait
        self._names = {key_id: f"{key_id} {keys.command.fingerprint(key_id)}" for key_id in keys.command.key_ids}
        self._loaded = tuple(sorted({*keys.command.epochs} & {*keys.downlink.epochs}))
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="halts")
        self._kept = self._read_marks()
        self.marks = {key_id: self._kept[name] for key_id, name in self._names.items() if name in self._kept}
        self.halted = {
            key_id: self._kept[name + _ASKED] for key_id, name in self._names.items() if name + _ASKED in self._kept
        }
        self.epoch = self._read_epoch(keys.command)

    def close(self) -> None:
        """Wait until all is written."""
        self._pool.shutdown(wait=True)

    def mark(self, key_id: int, counter: int, request_id: int) -> Future[bool]:
        """Start to write this highest counter, of that request; the result is True if it is on the disk."""
        name = self._names[key_id]
        self._kept[name] = counter
        self._kept[name + _ASKED] = max(request_id, self._kept.get(name + _ASKED, 0))
        text = json.dumps(self._kept, sort_keys=True).encode()
        return self._submitted(lambda: self._write(MARKS, text))

    def switch(self, epoch: int) -> Future[SaveResult]:
        """Start to save an epoch; it is in force when that is done without an error. The error has the reason."""
        return self._submitted(lambda: self._switch(epoch))

    def _switch(self, epoch: int) -> SaveResult:
        if epoch not in self._loaded:
            known = " ".join(map(str, self._loaded))
            return SaveResult(EPOCH, f"epoch {epoch} is not loaded in both of the rover's key files; loaded: {known}")
        if not self._write(f"{EPOCH}.json", b"%d" % epoch):
            return SaveResult(EPOCH, f"epoch {epoch} cannot be kept: the disk refuses")
        self.epoch = epoch
        return SaveResult(EPOCH)

    def _submitted(self, work: Callable[[], T]) -> Future[T]:
        future = self._pool.submit(work)
        if self._wait:
            wait_for([future])
        return future

    def _write(self, name: str, data: bytes) -> bool:
        try:
            if self._folder is not None:
                self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                write_whole(self._folder / name, data)
        except OSError:
            return False
        return True

    def _read_marks(self) -> dict[str, int]:
        try:
            path = self._folder / MARKS if self._folder else None
            tree = json.loads(path.read_bytes()) if path and path.is_file() else {}
            return {str(name): int(counter) for name, counter in tree.items()}
        except (OSError, ValueError, AttributeError, TypeError) as error:
            raise ConfigError(
                f"{path}: cannot be read ({error}); without it an old stop could be sent again: restore "
                "it, or remove it and make new keys"
            ) from error

    def _read_epoch(self, keys: Keyring) -> int:
        path = self._folder / f"{EPOCH}.json" if self._folder else None
        try:
            epoch = int(path.read_bytes()) if path and path.is_file() else keys.epochs[0]
        except (OSError, ValueError) as error:
            raise ConfigError(f"{path}: cannot be read ({error}); it holds the key epoch in force") from error
        if epoch not in self._loaded:
            raise ConfigError(
                f"{path or 'key files'}: epoch {epoch} is in force and not loaded in both key files; "
                f"loaded: {' '.join(map(str, self._loaded)) or 'none'}"
            )
        return epoch
