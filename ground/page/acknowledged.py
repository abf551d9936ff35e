"""Events that an operator has acknowledged, in a file beside the archive; without a folder in memory only."""

from __future__ import annotations

import json
import threading
from pathlib import Path

from ground.archive.schema import private

_MOST = 5000


class Acknowledged:
    """Keys of acknowledged events. Raises OSError from `add` if the file cannot be written."""

    def __init__(self, path: Path | None) -> None:
        self._path, self._lock = path, threading.Lock()
        self.keys: frozenset[str] = frozenset()
        if path is not None and path.is_file():
            try:
                self.keys = frozenset(str(key) for key in json.loads(path.read_text()))
            except (ValueError, TypeError, OSError):
                self.keys = frozenset()  # a damaged file: events are to be acknowledged again

    def add(self, keys: list[str]) -> None:
        """Acknowledge events."""
        with self._lock:
            self.keys = frozenset(sorted(self.keys | set(keys))[-_MOST:])
            if self._path is None:
                return
            fresh = self._path.with_suffix(".new")
            with open(fresh, "w", opener=private) as file:
                json.dump(sorted(self.keys), file)
            fresh.replace(self._path)
