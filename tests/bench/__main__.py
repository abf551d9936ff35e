"""`python -m tests.bench [--quick] [NAME ...]`: measures the rows of the performance table, writes build/bench.json.

A row that is short of its goal or fails is shown and never changes the exit code.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.table import Table

from tests.bench import (
    flight,
    global_field,
    in_memory,
    jitter,
    mapping,
    next_position,
    planning,
    search,
    start,
    visibility,
    wire,
)
from tests.bench.goals import GOALS, MISSING, Measured

OUT = Path("build/bench.json")
CORE_MODULES = (global_field, in_memory, mapping, next_position, planning, search, visibility, wire)
CORE_ROWS = {name: row for module in CORE_MODULES for name, row in module.ROWS.items()}


def pinned(work: Callable[[], Measured]) -> Measured:
    """Run `work` on one core; child processes of other rows keep all cores."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        return work()
    finally:
        os.sched_setaffinity(0, cores)


def measure(name: str, repeats: int, mission: flight.Mission) -> Measured:
    """Measure one row."""
    if name in CORE_ROWS:
        return pinned(lambda: CORE_ROWS[name](repeats))
    if name in jitter.ROWS:  # on all cores: the planner works on another core
        return jitter.ROWS[name](repeats)
    if name == "start":
        return start.start(repeats)
    if name in ("tick-cost", "replay-rtf"):
        assert mission.result  # flown on all cores before
        return pinned(lambda: flight.ROWS[name](mission, repeats))
    return flight.ROWS[name](mission, repeats) if name in flight.ROWS else MISSING


def main(words: list[str]) -> None:
    """Measure, write, show."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description="Measures; writes build/bench.json.")
    parser.add_argument("--quick", action="store_true", help="two repeats instead of five")
    parser.add_argument("name", nargs="*", metavar="NAME", help=f"rows to measure, all without: {', '.join(GOALS)}")
    asked = parser.parse_args(words)
    if unknown := [name for name in asked.name if name not in GOALS]:
        parser.error(f"no row {unknown[0]!r}; the rows: {', '.join(GOALS)}")
    repeats, wanted = 2 if asked.quick else 5, asked.name or list(GOALS)
    rows = []
    with TemporaryDirectory() as folder:
        mission = flight.Mission(Path(folder))
        for name in wanted:
            print(f"{name} ...", file=sys.stderr, flush=True)
            try:
                found = measure(name, repeats, mission)
            except Exception as error:  # noqa: BLE001  one broken row must not hide the others
                found = Measured(0.0, 0.0, 0.0, "", f"failed: {type(error).__name__}: {error}"[:300], False)
            rows.append(found.row(name))
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps(rows, indent=2) + "\n")
    show(
        [row for row in rows if row["note"] != MISSING.note],
        [row["name"] for row in rows if row["note"] == MISSING.note],
    )


def show(rows: list[dict], missing: list[str]) -> None:
    """Show the measured rows as a table, the others by name."""
    table = Table("row", "ratio", "goal", "", "ours", "reference", "against", "note")
    for r in rows:
        held = "[green]holds[/]" if r["holds"] else "[yellow]short[/]"
        table.add_row(
            r["name"],
            f"{r['ratio']:.2f}",
            r["goal"],
            held,
            _time(r["ours_s"]),
            _time(r["reference_s"]),
            r["reference"],
            r["note"],
        )
    console = Console(width=None if sys.stdout.isatty() else 190)
    console.print(table)
    console.print(f"{sum(r['holds'] for r in rows)} of {len(rows)} measured rows hold; {OUT} has them all")
    if missing:
        console.print(f"not measured, part not built: {', '.join(missing)}")


def _time(value_s: float) -> str:
    if not value_s:
        return "-"
    for unit, scale in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if value_s >= scale:
            return f"{value_s / scale:.3g} {unit}"
    return f"{value_s / 1e-9:.3g} ns"


if __name__ == "__main__":
    main(sys.argv[1:])
