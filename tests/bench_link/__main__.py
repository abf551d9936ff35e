"""`python -m tests.bench_link [--quick] [NAME ...]`: the link's promises in virtual time (`make bench-link`).

Exit codes: 0 all promises hold, 1 one is broken or a row failed.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tests.bench_link import asked, dark, day, emulated, hostile, moved, resumed, sockets, told
from tests.bench_link.figures import Figure, Told

OUT = Path("build/bench-link.json")
ROWS: dict[str, Callable[[bool, Told], list[Figure]]] = {
    "commands": asked.row, "telemetry": told.idle, "telemetry-bulk": told.busy, "bulk": moved.bulk,
    "profiles": moved.profiles, "map": emulated.maps, "blackout": dark.row, "hostile": hostile.row,
    "hostile-udp": sockets.row,
    "emulator": emulated.emulator, "memory": day.row, "resume": resumed.row,
}  # fmt: skip


def main(words: Sequence[str]) -> int:
    """Measure, write, show. Returns 1 if a promise is broken."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.bench_link",
        description="Holds the link to its figures; writes build/bench-link.json.",
        epilog="Example: python -m tests.bench_link --quick bulk blackout",
    )
    parser.add_argument("--quick", action="store_true", help="few seeds: two minutes instead of half an hour")
    parser.add_argument("--out", type=Path, default=OUT, help="the JSON file")
    parser.add_argument("name", nargs="*", metavar="NAME", help=f"rows, all without: {', '.join(ROWS)}")
    given = parser.parse_args(words)
    if unknown := [name for name in given.name if name not in ROWS]:
        parser.error(f"no row {unknown[0]!r}; the rows: {', '.join(ROWS)}")
    figures, failed = list[Figure](), list[str]()
    for name in given.name or ROWS:
        began_s = time.monotonic()
        try:
            figures += ROWS[name](given.quick, lambda text, name=name: _tell(f"{name}: {text}"))
        except Exception as error:  # noqa: BLE001  one broken row must not hide the others
            failed.append(f"{name} failed: {type(error).__name__}: {error}"[:300])
        _tell(f"{name} took {time.monotonic() - began_s:.0f} s", last=True)
    given.out.parent.mkdir(parents=True, exist_ok=True)
    report = {"quick": given.quick, "figures": [figure.report() for figure in figures], "failed": failed}
    given.out.write_text(json.dumps(report, indent=2) + "\n")
    show(figures, failed, given.out)
    return int(bool(failed) or not all(figure.holds for figure in figures))


def _tell(text: str, last: bool = False) -> None:
    """Print progress: one line that is overwritten on a terminal, a line each elsewhere."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\x1b[K{text}" + ("\n" if last else ""))
    else:
        sys.stderr.write(text + "\n")
    sys.stderr.flush()


def show(figures: Sequence[Figure], failed: Sequence[str], out: Path) -> None:
    """Print the table, and the failures below it."""
    table = Table("row", "link", "figure", "value", "95 % interval", "worst", "limit", "n", "")
    for f in figures:
        limit = f"{'>=' if f.at_least else '<='} {f.limit:.4g}"
        held = "[green]holds[/]" if f.holds else "[red]BROKEN[/]"
        table.add_row(
            f.row,
            f.link,
            f.what,
            f"{f.value:.4g} {f.unit}",
            f"{f.low:.4g} .. {f.high:.4g}",
            f"{f.worst:.4g}",
            limit,
            str(f.count),
            held,
        )
    console = Console(width=None if sys.stdout.isatty() else 190)
    console.print(table)
    for text in failed:
        console.print(text, style="red", markup=False)
    held = sum(f.holds for f in figures)
    console.print(f"{held} of {len(figures)} figures hold; {out} has them all")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
