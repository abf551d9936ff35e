"""Store of map tiles: the only part of the flight program that saves a map on disk.

A tile is written to a temporary file, forced to the disk and renamed; the folder is forced too. After a crash there is
the old tile or the new one, whole. A file that cannot be read is dropped alone and reported; the others load.
"""

from __future__ import annotations

import os
import shutil
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from onboard.perception.map.tiles import Tile, TileError, cut, decode, encode
from onboard.records import Ldem
from onboard.records.status import SaveResult

if TYPE_CHECKING:
    from onboard.perception.map.stop_map import StopMap

FREE_BYTES = 64 << 20  # stay free: a full disk would end the record of the run too
SUFFIX, TEMPORARY = ".tile", ".new"


@dataclass(frozen=True, slots=True)
class TileFile:
    """A tile, with the file it came from and its bytes."""

    path: Path
    data: bytes
    tile: Tile


@dataclass(frozen=True, slots=True)
class FolderContent:
    """Content of a folder: tiles in the order of their names, and a line for each file that was dropped."""

    files: tuple[TileFile, ...] = ()
    dropped: tuple[str, ...] = ()

    @property
    def tiles(self) -> tuple[Tile, ...]:
        """The tiles alone."""
        return tuple(file.tile for file in self.files)


def name_of(tile: Tile) -> str:
    """File name of a tile: its numbers along x and along y."""
    return f"x{tile.i:+05d}_y{tile.j:+05d}{SUFFIX}"


def load(folder: Path, cell_m: float = 0.0) -> FolderContent:
    """Load the tiles of a folder with cells of `cell_m`; 0: the cell size that most tiles have.

    Raises OSError if the folder cannot be listed; an unusable file is dropped with a message.
    """
    files: list[TileFile] = []
    dropped: list[str] = []
    for path in sorted(path for path in folder.iterdir() if path.suffix != TEMPORARY):
        try:
            files.append(_read(path))
        except TileError as error:
            dropped.append(f"{path} {error}")
        except OSError as error:
            dropped.append(f"{path} cannot be read: {error.strerror}")
    wanted_m = cell_m or _most_common(files)
    others = [file for file in files if file.tile.cells.grid.cell_m != wanted_m]
    dropped += [f"{f.path} has cells of {f.tile.cells.grid.cell_m:g} m; this map's are {wanted_m:g} m" for f in others]
    return FolderContent(tuple(file for file in files if file not in others), tuple(sorted(dropped)))


def _read(path: Path) -> TileFile:
    if path.suffix != SUFFIX:
        raise TileError("is no map tile")
    data = path.read_bytes()
    tile = decode(data)
    if path.name != name_of(tile):
        raise TileError(f"holds the tile of {name_of(tile)}: it was renamed or copied")
    return TileFile(path, data, tile)


def _most_common(files: list[TileFile]) -> float:
    counted = Counter(file.tile.cells.grid.cell_m for file in files)
    return counted.most_common(1)[0][0] if counted else 0.0


def save(folder: Path, tile: Tile) -> None:
    """Save the tile in place of the old one. Raises OSError, also if the disk is nearly full."""
    data, path = encode(tile), folder / name_of(tile)
    free = shutil.disk_usage(folder).free
    if free < FREE_BYTES + len(data):
        raise OSError(f"{free >> 20} MB are free on the disk, and {FREE_BYTES >> 20} MB are to stay free")
    write_whole(path, data)


def write_whole(path: Path, data: bytes) -> None:
    """Replace a file: after a crash at any time it has its old content or `data`, whole. Raises OSError."""
    temporary = path.with_suffix(TEMPORARY)
    try:
        with open(temporary, "wb", opener=_private) as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
    _force(path.parent)


def _private(path: str, flags: int) -> int:
    """Open for the owner only: saved state shows commands and places."""
    return os.open(path, flags, 0o600)


def _force(folder: Path) -> None:
    """Force the names in a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


class Keeper:
    """Saver of changed map tiles, in a thread of its own: a disk may take seconds.

    memory: the map as the folder has it.
    tell: called with one line about a failed save; the next map repeats the save.
    wait: lock-step, where a result belongs to the tick after its request.
    folder: if empty, nothing is saved.
    """

    def __init__(self, folder: str, memory: StopMap | None, tell: Callable[[str], None], wait: bool = False) -> None:
        self._wait = wait
        self._running: list[Future[SaveResult]] = []
        self._folder = Path(folder) if folder else None
        self._given, self._tell = memory, tell
        self._saved: Ldem | None = memory.cells if memory else None
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="disk")
        try:
            self._sweep()
        except OSError as error:
            self._tell(f"the map cannot be stored in {folder}: {error.strerror}")

    def keep(self, memory: StopMap | None) -> None:
        """Start to save the map if it has changed; None: clear it. Called each tick, returns at once."""
        if self._folder is None or memory is self._given:
            return
        self._given = memory
        if memory is None:
            self._running.append(self._pool.submit(self._clear, self._folder))
            return
        self._running.append(self._pool.submit(self._save, self._folder, memory))

    def collect(self) -> tuple[SaveResult, ...]:
        """Return the results that are ready, in the order of the requests."""
        done = []
        while self._running and (self._wait or self._running[0].done()):
            done.append(self._running.pop(0).result())
        return tuple(done)

    def _sweep(self) -> None:
        """Make the folder and remove half-written files of a crash; their tiles are the old ones."""
        if self._folder:
            self._folder.mkdir(parents=True, exist_ok=True)
            for stray in self._folder.glob(f"*{TEMPORARY}"):
                stray.unlink()

    def _save(self, folder: Path, memory: StopMap) -> SaveResult:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for tile in cut(memory.cells, memory.target_points, self._saved):
                save(folder, tile)
        except OSError as error:
            self._tell(f"the map is not saved in {folder}: {error.strerror or error}")
            return SaveResult("map", f"not kept: {error.strerror or error}")
        self._saved = memory.cells
        return SaveResult("map")

    def _clear(self, folder: Path) -> SaveResult:
        """Delete the tiles by order of the operator: the map must not come back at the next start."""
        try:
            for path in folder.glob(f"*{SUFFIX}"):
                path.unlink()
            _force(folder)
        except OSError as error:
            self._tell(f"the map in {folder} is not cleared: {error.strerror or error}")
            return SaveResult("map", f"not cleared: {error.strerror or error}")
        self._saved = None
        return SaveResult("map")

    def close(self) -> None:
        """Wait until all is saved."""
        self._pool.shutdown(wait=True)
        for each in self._running:
            each.result()  # raises an exception of our own code
