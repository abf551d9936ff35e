"""Load figures of the computer, read from the system once a second: processor, memory, temperature, disk.

Linux: /proc and /sys. A missing file (no thermal sensor, another system) gives NaN and affects no other row.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from onboard.records import Machine

LOOK_NS = 1_000_000_000
_ROOT = Path("/")
_MILLIDEGREE_C = 1e-3
_IDLE = (3, 4)  # columns of /proc/stat: idle, and idle while waiting for a disk


class Probe:
    """Probe; call `look` in the time left after a tick, `take` once for the inputs of the next.

    folders: those written to.
    root: of /proc and /sys; another one in tests.
    """

    def __init__(self, folders: Sequence[Path], root: Path = _ROOT) -> None:
        self._folders, self._proc = tuple(folders), root / "proc"
        self._sensors = tuple(sorted((root / "sys/class/thermal").glob("thermal_zone*/temp")))
        self._due_ns = 0
        self._fresh: Machine | None = None
        self._before = (math.nan, math.nan, math.nan)

    def take(self) -> Machine | None:
        """Return the figures read since the last call, or None."""
        fresh, self._fresh = self._fresh, None
        return fresh

    def look(self, now_ns: int) -> None:
        """Read the figures if a second has passed since the last time."""
        if now_ns >= self._due_ns:
            self._due_ns = now_ns + LOOK_NS
            self._fresh = self._read()

    def _read(self) -> Machine:
        before, self._before = self._before, (*self._core_ticks(), self._own_ticks())
        whole, idle, own = (now - then for now, then in zip(self._before, before))
        cores = os.cpu_count() or 1
        return Machine(
            cpu_ratio=1.0 - idle / whole if whole else math.nan,
            process_ratio=own / whole * cores if whole else math.nan,
            rss_bytes=self._pages("self/statm", 1) * os.sysconf("SC_PAGE_SIZE"),
            free_memory_bytes=self._free_memory_bytes(),
            temperature_c=max(filter(math.isfinite, map(_temperature_c, self._sensors)), default=math.nan),
            free_disk_bytes=min(filter(math.isfinite, map(_free_bytes, self._folders)), default=math.nan),
        )

    def _core_ticks(self) -> tuple[float, float]:
        """Time of all cores since the machine started, and its idle part, in ticks of the kernel."""
        words = _text(self._proc / "stat").partition("\n")[0].split()[1:9]  # guests count in `user` already
        times = [float(word) for word in words]
        return (sum(times), sum(times[k] for k in _IDLE)) if len(times) == 8 else (math.nan, math.nan)

    def _own_ticks(self) -> float:
        """Processor time of this process; its name in the file may contain anything but ends with the last bracket."""
        words = _text(self._proc / "self/stat").rpartition(")")[2].split()
        return float(words[11]) + float(words[12]) if len(words) > 12 else math.nan

    def _pages(self, name: str, column: int) -> float:
        words = _text(self._proc / name).split()
        return float(words[column]) if len(words) > column else math.nan

    def _free_memory_bytes(self) -> float:
        row = next((row for row in _text(self._proc / "meminfo").splitlines() if row.startswith("MemAvailable:")), "")
        return float(row.split()[1]) * 1024 if row else math.nan


def _text(path: Path) -> str:
    with suppress(OSError):
        return path.read_text()
    return ""


def _temperature_c(path: Path) -> float:
    with suppress(OSError, ValueError):  # a sensor that is asleep gives an error
        return float(path.read_text()) * _MILLIDEGREE_C
    return math.nan


def _free_bytes(folder: Path) -> float:
    with suppress(OSError):
        stat = os.statvfs(folder)
        return float(stat.f_bavail * stat.f_frsize)
    return math.nan


def folders_written(paths: Sequence[str]) -> tuple[Path, ...]:
    """Return the folders of configured files, or the nearest existing parents; '' names nothing."""
    return tuple(dict.fromkeys(_existing(Path(path).absolute()) for path in paths if path))


def _existing(path: Path) -> Path:
    return next(folder for folder in (path, *path.parents) if folder.is_dir())
