"""A door under libFuzzer, by atheris: inputs that reach new code are stored and damaged further.

`run` starts `python -m tests.fuzz.guided DOOR FLAGS` as a process of its own: the program is instrumented as it is
imported, and libFuzzer ends the process if a limit of time or memory is exceeded.
"""

from __future__ import annotations

import importlib
import io
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.fuzz.blind import example, feed
from tests.fuzz.damage import damaged
from tests.fuzz.door import Door

INSTRUMENTED = ("ground", "hil", "onboard", "protocol", "transport")
KEPT = Path(__file__).parent / "corpus"
MOST_BYTES, MOST_MB, MOST_S = 1 << 16, 1024, 20  # of an input; of the process; of a try
SEEDS, MOST_KEPT, LONGEST_KEPT = 64, 40, 3000
_DAMAGE, _MAKE = 0.5, 0.6  # shares of the mutations: ours, and up to here a new one; the rest is libFuzzer's


class Ended(NamedTuple):
    """Result of a run. found: the input that broke the door; said: the end of the process output."""

    tries: int
    kept: int
    peak_mb: int
    found: Path | None
    said: str


def available() -> bool:
    """Return whether atheris is installed."""
    return find_spec("atheris") is not None


def run(name: str, seconds: int, seed: int, folder: Path) -> Ended:
    """Fuzz a door for a time. The corpus is in folder/corpus/NAME, inputs that break the door in folder/found."""
    corpus, found = folder / "corpus" / name, folder / "found"
    for made in (corpus, found):
        made.mkdir(parents=True, exist_ok=True)
    for number, data in enumerate([*kept(name), *_seeds(name)]):
        (corpus / f"seed-{number}").write_bytes(data)
    before = set(found.iterdir())
    flags = (
        f"-max_total_time={seconds}",
        f"-seed={seed}",
        f"-max_len={MOST_BYTES}",
        f"-rss_limit_mb={MOST_MB}",
        f"-timeout={MOST_S}",
        f"-artifact_prefix={found}/{name}-",
        "-print_final_stats=1",
        "-verbosity=1",
    )
    code, said = _child(name, *flags, str(corpus))
    (folder / f"{name}.log").write_text(said)
    broken = next(iter(sorted(set(found.iterdir()) - before)), None)
    if code and broken is None:
        raise RuntimeError(f"{name}: the fuzz process ended with {code}; see {folder / f'{name}.log'}\n{said[-2000:]}")
    return Ended(
        _stat(said, "number_of_executed_units"), len(list(corpus.iterdir())), _stat(said, "peak_rss_mb"), broken, said
    )


def keep(name: str, folder: Path) -> int:
    """Store in KEPT the shortest inputs of the corpus in folder that reached new code; returns their number."""
    chosen = {path.read_bytes() for path in (folder / "corpus" / name).iterdir()} - {*kept(name), *_seeds(name)}
    short = [data for data in (*chosen, *kept(name)) if len(data) <= LONGEST_KEPT]
    shortest = sorted(short, key=lambda data: (len(data), data))[:MOST_KEPT]
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for number, data in enumerate(shortest):
            file.writestr(zipfile.ZipInfo(f"{number:02}"), data, zipfile.ZIP_DEFLATED)
    KEPT.mkdir(exist_ok=True)
    (KEPT / f"{name}.zip").write_bytes(buffer.getvalue())
    return len(shortest)


def _seeds(name: str) -> list[bytes]:
    door = importlib.import_module("tests.fuzz.doors").DOORS[name]
    return [example(door, 0, number) for number in range(SEEDS)]


def kept(name: str) -> list[bytes]:
    """Return the stored inputs of a door."""
    path = KEPT / f"{name}.zip"
    if not path.exists():
        return []
    with zipfile.ZipFile(path) as file:
        return [file.read(one) for one in file.namelist()]


def _child(name: str, *flags: str) -> tuple[int, str]:
    command = [sys.executable, "-m", "tests.fuzz.guided", name, *flags]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    return done.returncode, done.stdout.decode(errors="replace")


def _stat(said: str, name: str) -> int:
    found = re.search(rf"stat::{name}:\s+(\d+)", said)
    return int(found[1]) if found else 0


def _mutated(door: Door, mutate: Callable[[bytes, int], bytes], data: bytes, most: int, seed: int) -> bytes:
    """Return the next input from one of the corpus."""
    rng = np.random.default_rng(seed)
    dice = rng.random()
    if dice < _DAMAGE:
        return damaged(data, rng)[:most]
    if dice < _MAKE:
        return door.make(rng)[:most]
    return mutate(data, most)


def main(name: str, flags: list[str]) -> None:
    """Run the process that `run` starts."""
    import atheris

    # an editable installation has a loader of its own, which atheris cannot instrument: the sources come first
    sys.meta_path.sort(key=lambda finder: "Redirecting" in type(finder).__name__)
    with atheris.instrument_imports(include=list(INSTRUMENTED)):
        door = importlib.import_module("tests.fuzz.doors").DOORS[name]
    mutator = partial(_mutated, door, lambda data, most: bytes(atheris.Mutate(data, most)))
    atheris.Setup([name, *flags], partial(feed, door), custom_mutator=mutator)
    atheris.Fuzz()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
