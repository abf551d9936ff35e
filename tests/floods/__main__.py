"""`python -m tests.floods [KIND ...]`: time to a confirmed STOP while something floods the rover, on the wall clock.

The figures are of this machine and its load; `quiet` measures without a flood. Exit code 1 if an order to stop was not
confirmed.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from ground.station.station import StationError
from tests.floods.besieged import KINDS, Besieged, Siege

OUT = Path("build/floods.json")
HEAD = ("flood", "tries", "STOP answered: median, worst", "wheels stand: worst", "new station's: median, worst",
        "worst tick", "left out", "memory", "refused", "faults told")  # fmt: skip


def main(words: Sequence[str]) -> int:
    """Measure, write, show."""
    parser = argparse.ArgumentParser(prog="python -m tests.floods", description=__doc__)
    parser.add_argument("--tries", type=int, default=20)
    parser.add_argument("--out", type=Path, default=OUT, help="the JSON file")
    parser.add_argument("kind", nargs="*", metavar="KIND", help=f"of {', '.join(KINDS)}; all")
    given = parser.parse_args(words)
    rows, failed = list[Besieged](), list[str]()
    print("| " + " | ".join(HEAD) + " |")
    for kind in given.kind or KINDS:
        with tempfile.TemporaryDirectory() as folder:
            try:
                with Siege(Path(folder), kind) as siege:
                    rows.append(siege.besiege(given.tries))
                print(line(rows[-1]), flush=True)
            except (RuntimeError, PermissionError, StationError) as error:
                failed.append(f"{kind}: {error}")
                print(failed[-1], flush=True)
    given.out.parent.mkdir(parents=True, exist_ok=True)
    figures = [{**row._asdict(), "tries": [each._asdict() for each in row.tries]} for row in rows]
    given.out.write_text(json.dumps({"figures": figures, "failed": failed}, indent=2) + "\n")
    return int(bool(failed))


def line(row: Besieged) -> str:
    """Return a row of the table."""
    answered, newcomers = [each.answered_s for each in row.tries], [each.newcomer_s for each in row.tries]
    cells = (
        row.kind,
        len(row.tries),
        f"{median(answered):.2f}, {max(answered):.2f} s",
        f"{max(each.stood_s for each in row.tries):.2f} s",
        f"{median(newcomers):.2f}, {max(newcomers):.2f} s",
        f"{row.worst_tick_before_ms:.0f} -> {row.worst_tick_ms:.0f} ms",
        f"{row.left_out_before} -> {row.left_out}",
        f"{row.rss_before_mb:.0f} -> {row.rss_after_mb:.0f} MB",
        row.refused,
        " ".join(row.faults) or "none",
    )
    return "| " + " | ".join(map(str, cells)) + " |"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
