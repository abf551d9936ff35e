"""Saved state of a station: its next counters and request ids, and the last known state of the rover.

The file is always ahead of the numbers in use: a block is reserved, written and synced before its first number is
sealed, so no counter is used twice after a crash. Several processes of one station reserve blocks of their own (file
lock). A process whose numbers fall behind those of the others takes a new block; otherwise the rover's replay window
would pass over it. Request ids give the order of two requests, so they come from the newest block only. The rover
accepts counters of halting commands only in rising order, so these are taken one by one (`halt_numbers`).

A process that cannot write the file may still halt the rover (`unkept`). Its request ids lie in a gap before each
block, which no other process uses: above all earlier ids, below all ids taken when the disk can be written again.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from ground.archive.schema import private
from ground.link.saved_state import SavedLinkState
from ground.station import halt_numbers
from onboard.config import ConfigError
from protocol.link.datagrams import WINDOW

COUNTERS, REQUESTS = 640, 256
GAP = 4096  # request ids before a block for processes that cannot write: one a second, repeated after an hour
BEHIND = WINDOW - 2 * COUNTERS  # four processes at once stay closer together than this
_NEW = {"counter": 0, "request_id": 1, "boot_id": 0}
_LATER = {"halt": 0, "told": -1, "epoch": -1, "heard": -1, "rtt_ns": 0}  # older files lack these


class Block(NamedTuple):
    """Numbers of this process, from the first to before the end.

    counter, counter_end: datagram counters.
    request_id, request_end: request ids.
    boot_id: newest boot id of the rover.
    kept: saved link state.
    """

    counter: int
    counter_end: int
    request_id: int
    request_end: int
    boot_id: int
    kept: SavedLinkState = SavedLinkState()


class Memory:
    """File of one station in a state folder. Without a folder (a bench) numbers start at zero and nothing is saved."""

    def __init__(self, folder: str, station: int) -> None:
        self._path = Path(folder) / f"station-{station}.json" if folder else None
        self._bench = _NEW | _LATER
        self._read_ns, self._reserved = -1, 0  # mtime of the file at the last read; end of all blocks in it

    def reserve(self, boot_id: int = 0) -> Block:
        """Reserve the next block, and store the newest boot id. Raises OSError or ConfigError on failure."""
        with self._changed() as tree:
            counter, request_id = tree["counter"], tree["request_id"] + (GAP if self._path is not None else 0)
            tree["counter"], tree["request_id"] = counter + COUNTERS, request_id + REQUESTS
            _note_boot(tree, boot_id)
            kept = _kept(tree)
            return Block(counter, counter + COUNTERS, request_id, request_id + REQUESTS, kept.boot_id, kept)

    def unkept(self, utc_s: int) -> Block:
        """Return numbers for halting the rover after `reserve` has failed, from the file if it can be read."""
        tree = self._readable()
        return Block(
            tree["counter"],
            tree["counter"],
            tree["request_id"] + utc_s % GAP,
            tree["request_id"] + GAP,
            tree["boot_id"],
            _kept(tree),
        )

    def overtaken(self, block: Block) -> bool:
        """Return whether another process of the station has reserved numbers since: its requests have higher ids."""
        return self._path is not None and self._read()["request_id"] > block.request_end

    def next_halt(self, unheard: int = 0) -> int:
        """Return the counter of one halting command, stored on the disk before use. Raises like `reserve`."""
        with self._changed() as tree:
            tree["halt"] = halt_numbers.kept(tree["halt"], _told(tree), unheard) + 1
            return tree["halt"] - 1

    def unkept_halt(self, unheard: int, utc_s: int) -> int:
        """Return such a counter after `next_halt` has failed."""
        tree = self._readable()
        return halt_numbers.unkept(tree["halt"], _told(tree), unheard, utc_s)

    def halt_told(self, counter: int) -> None:
        """Store that the rover has answered halting commands up to this counter. Raises like `reserve`."""
        with self._changed() as tree:
            tree["told"] = max(_told(tree), counter + 1)
            tree["halt"] = max(tree["halt"], tree["told"])

    def note(self, kept: SavedLinkState) -> None:
        """Store the link state; an older boot or counter than the stored one changes nothing."""
        with self._changed() as tree:
            _note_boot(tree, kept.boot_id)
            tree["epoch"] = max(tree["epoch"], kept.epoch)
            if kept.boot_id == tree["boot_id"]:
                tree["heard"] = max(tree["heard"], kept.heard)
            tree["rtt_ns"] = kept.rtt_ns or tree["rtt_ns"]

    def behind(self, counter: int) -> bool:
        """Return whether other processes' blocks are so far ahead that the rover will soon refuse this counter."""
        if self._path is None:
            return False
        changed_ns = self._path.stat().st_mtime_ns
        if changed_ns != self._read_ns:
            self._read_ns, self._reserved = changed_ns, self._read()["counter"]
        return self._reserved > counter + BEHIND

    def _readable(self) -> dict[str, int]:
        try:
            return self._bench if self._path is None else self._read()
        except (OSError, ConfigError):
            return _NEW | _LATER

    @contextmanager
    def _changed(self) -> Iterator[dict[str, int]]:
        """Yield the file's content for a change, under the lock, and write it afterwards."""
        if self._path is None:
            yield self._bench
            return
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with open(self._path.with_suffix(".lock"), "w", opener=private) as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            tree = self._read()
            yield tree
            self._write(tree)

    def _read(self) -> dict[str, int]:
        assert self._path is not None
        try:
            tree = json.loads(self._path.read_text())
            return {name: int(tree[name]) for name in _NEW} | {
                name: int(tree.get(name, least)) for name, least in _LATER.items()
            }
        except FileNotFoundError:
            return _NEW | _LATER
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ConfigError(f"{self._path}: damaged ({error}); make new keys (ground keys init)") from error

    def _write(self, tree: dict[str, int]) -> None:
        assert self._path is not None
        write_safely(self._path, tree)


def write_safely(path: Path, tree: Mapping[str, int]) -> None:
    """Write JSON atomically; it is on the disk when this returns. Raises OSError."""
    fresh = path.with_suffix(".new")
    with open(fresh, "w", opener=private) as file:
        json.dump(tree, file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(fresh, path)
    force_names(path.parent)


def force_names(folder: Path) -> None:
    """Sync the names in a folder to the disk: without it a crash may restore an older file."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _kept(tree: Mapping[str, int]) -> SavedLinkState:
    return SavedLinkState(tree["boot_id"], tree["epoch"], tree["heard"], tree["rtt_ns"])


def _told(tree: Mapping[str, int]) -> int:
    """Return `told`; an older file lacks it: then the rover accepted all."""
    return tree["told"] if tree["told"] >= 0 else tree["halt"]


def _note_boot(tree: dict[str, int], boot_id: int) -> None:
    """Store a newer boot; its datagram counter restarts."""
    if boot_id > tree["boot_id"]:
        tree["boot_id"], tree["heard"] = boot_id, -1
