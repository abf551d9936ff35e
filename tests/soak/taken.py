"""Resources of a process, as the system reports them, and the check for growth."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

MB = 1e6
FLAT_MB = 2.0


class Taken(NamedTuple):
    """Resources of one process at one time of its run."""

    at_s: float
    rss_bytes: int
    descriptors: int
    threads: int


def taken(pid: int, at_s: float) -> Taken:
    """Return the present resources. Raises OSError if the process has ended."""
    process = Path("/proc") / str(pid)
    pages = int((process / "statm").read_text().split()[1])
    return Taken(
        at_s,
        pages * os.sysconf("SC_PAGE_SIZE"),
        len(list((process / "fd").iterdir())),
        len(list((process / "task").iterdir())),
    )


def child(words: Sequence[str]) -> int | None:
    """Return this process's child whose command line has these words one after the other; None if there is none."""
    wanted = b"\0".join(word.encode() for word in ("", *words, ""))
    for task in Path("/proc/self/task").iterdir():
        for pid in (task / "children").read_text().split():
            if wanted in (Path("/proc") / pid / "cmdline").read_bytes():
                return int(pid)
    return None


def growth(samples: Sequence[Taken]) -> list[str]:
    """Return the growth over these samples, in words: memory by over FLAT_MB, descriptors or threads by one."""
    if len(samples) < 2:
        return ["nothing can be said of growth: fewer than two samples"]
    first, rest = samples[0], samples[1:]
    sizes = [sample.rss_bytes for sample in samples]
    found = []
    if max(sizes) - min(sizes) > FLAT_MB * MB:
        found.append(f"resident memory is not flat: {min(sizes) / MB:.1f} to {max(sizes) / MB:.1f} MB")
    for what in ("descriptors", "threads"):
        had, most = getattr(first, what), max(getattr(sample, what) for sample in rest)
        if most > had:
            found.append(f"{what} grow from {had} to {most}")
    return found
