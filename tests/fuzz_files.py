"""`python -m tests.fuzz_files [--seconds S] [--seed N] [--door NAME]`: damage of any kind to files that are read.

Doors: gdem (the orbiter's map), config (the flight program's configuration), scenario. Each gets the time. Sound files
are damaged (bits, cuts, doubled and swapped pieces, words put in), and every answer is the file's content or the one
documented error, of one line; memory is bounded.
"""

from __future__ import annotations

import argparse
import io
import random
import tempfile
import time
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hil.scenario.scenario import load_scenario
from onboard.config import ConfigError, load
from onboard.config_text import to_toml
from onboard.maps.gdem_file import GdemError, from_npz, to_npz
from onboard.records import Gdem, Grid

MOST_LINE, MOST_MB = 2000, 256
SCENARIOS = sorted((Path(__file__).parents[1] / "hil" / "scenarios").glob("*.toml"))
WORDS = (
    b"[" * 3000, b"{a=" * 2000, b"nan", b"inf", b"-1", b"9" * 5000, b"0x" + b"f" * 9000, b"1e999", b"../../x", b"/etc",
    b"{goal_x}", b"{x}", b"{", b"''", b'"""', b"\x00", b"\xff", b"\x1b[2J", b"a." * 2000, b"true", b"1979-05-27",
    b"[[faults]]", b"[set]", b"=", b"\n", b"\x93NUMPY\x01\x00", b"(999999, 999999)",
    b"'|O'", b"'<f8'", b"PK\x01\x02", b"PK\x05\x06",
)  # fmt: skip


def damaged(data: bytes, dice: random.Random) -> bytes:
    """One to six changes."""
    for _ in range(dice.randint(1, 6)):
        a, b = sorted(dice.randint(0, len(data)) for _ in range(2))
        kind = dice.randrange(6)
        if kind == 0 and data:
            at = dice.randrange(len(data))
            data = data[:at] + bytes([data[at] ^ 1 << dice.randrange(8)]) + data[at + 1 :]
        elif kind == 1:
            data = data[:a] + data[min(b, a + 40) :]
        elif kind == 2:
            data = data[:a] + data[a : a + 60] * dice.randint(2, 5) + data[a:]
        elif kind == 3:
            data = data[:a] + dice.choice(WORDS) + data[a:]
        elif kind == 4:
            data = data[:a] + dice.choice(WORDS) + data[min(b, a + 10) :]
        else:
            data = data[: max(a, 1)]
    return data


def _sound_map(dice: random.Random) -> Gdem:
    rows, columns = dice.randint(2, 12), dice.randint(2, 12)
    heights = np.array([dice.uniform(-9, 9) for _ in range(rows * columns)], np.float32).reshape(rows, columns)
    return Gdem(Grid(-5.0, -5.0, dice.choice((0.5, 10.0)), rows, columns), heights, "made")


def gdem(dice: random.Random, _folder: Path) -> bool:
    """A map: its zip damaged, or one of its arrays within a sound zip."""
    data = to_npz(_sound_map(dice))
    if dice.random() < 0.7:
        buffer = io.BytesIO()
        with zipfile.ZipFile(io.BytesIO(data)) as sound, zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as made:
            hit = dice.choice(sound.namelist())
            for name in sound.namelist():
                made.writestr(name, damaged(sound.read(name), dice) if name == hit else sound.read(name))
        data = buffer.getvalue()
    else:
        data = damaged(data, dice)
    try:
        found = from_npz(data)
    except GdemError as error:
        return _one_line(error)
    known = found.heights_m[np.isfinite(found.heights_m)]
    assert found.heights_m.dtype == np.float32 and known.size and np.abs(known).max() <= 1e7
    assert np.isfinite([found.grid.x0_m, found.grid.y0_m, found.grid.cell_m]).all()
    return True


def config(dice: random.Random, folder: Path) -> bool:
    """A configuration, whole or some of its lines."""
    lines = to_toml(load()).splitlines(keepends=True)
    first = dice.randrange(len(lines))
    path = folder / "rover.toml"
    path.write_bytes(damaged("".join(lines[first : first + dice.randint(1, 60)]).encode(), dice))
    try:
        load(path)
    except ConfigError as error:
        return _one_line(error)
    return True


def scenario(dice: random.Random, folder: Path) -> bool:
    """One of the bench's own."""
    path = folder / "s.toml"
    path.write_bytes(damaged(dice.choice(SCENARIOS).read_bytes(), dice))
    try:
        found = load_scenario(path)
    except ConfigError as error:
        return _one_line(error)
    assert "/" not in found.name and ".." not in str(found.set.get("record.path", ""))
    return True


def _one_line(error: Exception) -> bool:
    text = str(error)
    assert text and "\n" not in text and len(text) < MOST_LINE, text
    return False


DOORS: dict[str, Callable[[random.Random, Path], bool]] = {"gdem": gdem, "config": config, "scenario": scenario}


def hunt(door: str, number: int, examples: int) -> int:
    """So many examples from a seed; how many were taken as sound. Says which example failed."""
    taken = 0
    with tempfile.TemporaryDirectory() as folder:
        for k in range(examples):
            try:
                taken += DOORS[door](random.Random(f"{door} {number} {k}"), Path(folder))
            except Exception as error:
                error.add_note(f"door {door}, round {number}, example {k}")
                raise
    return taken


def main() -> None:
    """Rounds of 100 examples for each door until its time is over."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=120)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--door", choices=sorted(DOORS), action="append")
    asked = parser.parse_args()
    for door in asked.door or DOORS:
        began, rounds, taken = time.monotonic(), 0, 0
        tracemalloc.start()
        while not rounds or time.monotonic() - began < asked.seconds:
            taken += hunt(door, 100_000 * asked.seed + rounds, 100)
            rounds += 1
        peak_mb = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
        assert peak_mb < MOST_MB, f"{door}: {peak_mb:.0f} MB at once"
        print(f"{door}: {100 * rounds} damaged files, {taken} taken as sound, {peak_mb:.1f} MB at most")


if __name__ == "__main__":
    main()
