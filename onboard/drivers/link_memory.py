"""What the rover's end of the link must not forget: of each key's halts the newest counter and the highest request id,
and the epoch.

Both lie in the state folder, whole or not at all. A mark belongs to a key, told by its fingerprint: with a new secret
the count begins anew. A mark is written beside the tick and its command waits for that, but for HOLD_NS at most: a stop
never waits for an ill disk. One that was done unwritten could be sent again by others after a restart, and is told.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from pathlib import Path
from typing import TypeVar

from onboard.config import ConfigError
from onboard.drivers.disk import write_whole
from onboard.ports import EPOCH, Saved
from protocol.keyring import Keyring, LinkKeys

T = TypeVar("T")
MARKS = "halts.json"
HOLD_NS = 200_000_000
_ASKED = " asked"  # behind a key's name in the file: the highest request id that halted


class LinkMemory:
    """Marks and epoch of these keys. Without a folder both end with the run (a bench).

    marks, halted: counters and request ids by key id, as they were kept. epoch: in force at the start. wait: lock-step,
    where a write is always awaited. Raises ConfigError for a file that cannot be read: nothing is begun anew by itself.
    """

    def __init__(self, folder: str, keys: LinkKeys, wait: bool = True) -> None:
        self._folder, self._wait = Path(folder) if folder else None, wait
        self._names = {key_id: f"{key_id} {keys.command.fingerprint(key_id)}" for key_id in keys.command.key_ids}
        self._loaded = tuple(sorted({*keys.command.epochs} & {*keys.downlink.epochs}))
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="halts")
        self._kept = self._read_marks()
        self.marks = {key_id: self._kept[name] for key_id, name in self._names.items() if name in self._kept}
        self.halted = {key_id: self._kept[name + _ASKED] for key_id, name in self._names.items()
                       if name + _ASKED in self._kept}
        self.epoch = self._read_epoch(keys.command)

    def close(self) -> None:
        """Returns when all is written."""
        self._pool.shutdown(wait=True)

    def mark(self, key_id: int, counter: int, request_id: int) -> Future[bool]:
        """Begins to write this highest counter, of that request; the result says whether it is on the disk."""
        name = self._names[key_id]
        self._kept[name] = counter
        self._kept[name + _ASKED] = max(request_id, self._kept.get(name + _ASKED, 0))
        text = json.dumps(self._kept, sort_keys=True).encode()
        return self._submitted(lambda: self._write(MARKS, text))

    def switch(self, epoch: int) -> Future[Saved]:
        """Begins to keep an epoch, which is in force when that is done without an error; the error says why not."""
        return self._submitted(lambda: self._switch(epoch))

    def _switch(self, epoch: int) -> Saved:
        if epoch not in self._loaded:
            known = " ".join(map(str, self._loaded))
            return Saved(EPOCH, f"epoch {epoch} is not loaded in both of the rover's key files; loaded: {known}")
        if not self._write(f"{EPOCH}.json", b"%d" % epoch):
            return Saved(EPOCH, f"epoch {epoch} cannot be kept: the disk refuses")
        self.epoch = epoch
        return Saved(EPOCH)

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
            raise ConfigError(f"{path}: cannot be read ({error}); without it an old stop could be sent again: restore "
                              "it, or remove it and make new keys") from error

    def _read_epoch(self, keys: Keyring) -> int:
        path = self._folder / f"{EPOCH}.json" if self._folder else None
        try:
            epoch = int(path.read_bytes()) if path and path.is_file() else keys.epochs[0]
        except (OSError, ValueError) as error:
            raise ConfigError(f"{path}: cannot be read ({error}); it holds the key epoch in force") from error
        if epoch not in self._loaded:
            raise ConfigError(f"{path or 'key files'}: epoch {epoch} is in force and not loaded in both key files; "
                              f"loaded: {' '.join(map(str, self._loaded)) or 'none'}")
        return epoch
