"""Events that an operator has acknowledged, in a file beside the archive; without a folder in memory only."""

from __future__ import annotations

import json
import threading
from pathlib import Path

from ground.archive.schema import private

_MOST = 5000


class Acknowledged:
    """Keys of acknowledged events, the last 5000. Raises OSError from `add` if the file cannot be written."""

    def __init__(self, path: Path | None) -> None:
        self._path, self._lock = path, threading.Lock()
        self._order: list[str] = []  # the last acknowledged at the end
        if path is not None and path.is_file():
            try:
                self._order = [str(key) for key in json.loads(path.read_text())]
            except (ValueError, TypeError, OSError):
                self._order = []  # a damaged file: events are to be acknowledged again
        self.keys = frozenset(self._order)

    def add(self, keys: list[str]) -> None:
        """Acknowledge events, the newest at the end. It writes a file: call it in a thread of its own."""
        with self._lock:
            fresh_keys = dict.fromkeys(keys)
            self._order = [*(key for key in self._order if key not in fresh_keys), *fresh_keys][-_MOST:]
            self.keys = frozenset(self._order)
            if self._path is None:
                return
            fresh = self._path.with_suffix(".new")
            with open(fresh, "w", opener=private) as file:
                json.dump(self._order, file)
            fresh.replace(self._path)
