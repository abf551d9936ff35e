"""`python -m tests.missions`: the campaign in the kinematic world (`make missions`), and single missions drawn.

    python -m tests.missions fly --run optimistic --seeds 1-10
    python -m tests.missions guard
    python -m tests.missions draw --run trap --seed 3 --out build/missions/trap-3.png
"""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Optional

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from tests.missions import guard_runs, open_loop
from tests.missions.campaign import POSE_ERROR, UNGUARDED_STOPS, Row, Run, Summary, fly_all, summary

FIXED = tuple(range(1, 61))
ORBIT_CELL_M = 2.0
app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=__doc__)


def runs(fresh: int | None) -> tuple[Run, ...]:
    """The whole campaign; `fresh` is the first of 60 more seeds."""
    made = [Run("optimistic", "main", FIXED)]
    if fresh is not None:
        made.append(Run("optimistic, fresh seeds", "main", tuple(range(fresh, fresh + 60))))
    made += [
        Run("pose error 5 cm + 1 deg", "main", FIXED, errors=POSE_ERROR),
        Run("legs of 4 m, as flown", "main", FIXED, {"mission.leg_m": 4.0}),
        Run("U-traps", "trap", tuple(range(1, 9))),
        Run("ringed goals", "ring", tuple(range(1, 13))),
        Run("36 to 42 m", "far", tuple(range(1, 5))),
        Run("36 to 42 m, map from orbit", "far", tuple(range(1, 5)), orbit_cell_m=ORBIT_CELL_M),
    ]
    for strategy in ("explore", "visibility", "hill-climb"):
        made.append(Run(f"{strategy}, guarded", "main", FIXED, {"mission.strategy": strategy}))
    for strategy in ("visibility", "hill-climb"):
        loose = {"mission.strategy": strategy, "mission.guard": False, "mission.stop_limit": UNGUARDED_STOPS}
        made.append(Run(f"{strategy}, unguarded", "main", FIXED, loose))
    return tuple(made)


@app.callback()
def main() -> None:
    """Missions without physics."""


@app.command()
def fly(
    name: Annotated[Optional[str], typer.Option("--run", help="Only runs whose name begins so.")] = None,
    seeds: Annotated[str, typer.Option(help="Only these seeds: 1-10 or 3,7.")] = "",
    fresh: Annotated[Optional[int], typer.Option(help="First of 60 more seeds for the default rule.")] = None,
    workers: Annotated[int, typer.Option(help="Processes.")] = os.cpu_count() or 1,
    out: Annotated[Path, typer.Option(help="Folder for missions.json.")] = Path("build/missions"),
) -> None:
    """Fly, write one row a mission, show the table. Exit 1 where the default rule falls short of its promise."""
    chosen = [run for run in runs(fresh) if not name or run.name.startswith(name)]
    if seeds:
        wanted = _seeds(seeds)
        chosen = [replace(run, seeds=wanted) for run in chosen]
    rows: list[Row] = []
    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("missions", total=sum(len(run.seeds) for run in chosen))
        for row in fly_all(chosen, workers):
            rows.append(row)
            progress.update(task, advance=1, description=f"{row.run} {row.seed}")
    rows.sort(key=lambda row: ([run.name for run in chosen].index(row.run), row.seed))
    out.mkdir(parents=True, exist_ok=True)
    (out / "missions.json").write_text(json.dumps([row.as_json() for row in rows], indent=1) + "\n")
    show([summary(run.name, [row for row in rows if row.run == run.name]) for run in chosen])


@app.command()
def guard(
    seeds: Annotated[str, typer.Option(help="Only these seeds: 1-10 or 3,7.")] = "",
    workers: Annotated[int, typer.Option(help="Processes.")] = os.cpu_count() or 1,
    objects: Annotated[int, typer.Option(help="Fields on which objects are put on the tracks.")] = 50,
) -> None:
    """The drive guard: objects put on the tracks, then pitted and smooth fields with and without it."""
    wanted = set(_seeds(seeds)) if seeds else None
    met = open_loop.table(open_loop.all_outcomes(range(1, objects + 1), workers))
    Console(width=150).print(met)
    rows = list(guard_runs.fly_all([run.only(wanted) for run in guard_runs.RUNS], workers))
    Console(width=190).print(guard_runs.table(rows))


def show(lines: list[Summary]) -> None:
    """The table."""
    table = Table("rule and fields", "reached / reachable", "beyond", "reported", "endless", "stops med/p90/max",
                  "way / optimum", "hard", "soft")  # fmt: skip
    for s in lines:
        stops = " / ".join(f"{v:.0f}" for v in s.stops)
        ratio = " / ".join(f"{v:.2f}" for v in s.ratio)
        table.add_row(s.name, f"{s.reached} / {s.reachable}", str(s.beyond), str(s.reported), str(s.endless), stops,
                      ratio, str(s.hard), str(s.soft))  # fmt: skip
    Console(width=150).print(table)


def _seeds(text: str) -> tuple[int, ...]:
    found: list[int] = []
    for part in text.split(","):
        low, _, high = part.partition("-")
        try:
            found += range(int(low), int(high or low) + 1)
        except ValueError:
            raise typer.BadParameter(f"{part!r}: expected a number or low-high", param_hint="--seeds") from None
    return tuple(found)


if __name__ == "__main__":
    app()
