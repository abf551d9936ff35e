"""`python -m tests.missions`: the campaign in the kinematic world (`make missions`), and drawings of single missions.

python -m tests.missions fly --run optimistic --seeds 1-10
python -m tests.missions guard
python -m tests.missions map --docs
python -m tests.missions rocks --docs
python -m tests.missions draw --run U-traps --seed 3 --out build/missions/trap-3.png
python -m tests.missions table
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Optional

import typer
from rich.console import Console
from rich.table import Table

from tests.missions import campaign
from tests.missions import draw as drawing
from tests.missions.campaign import POSE_ERROR, REGISTERED, UNGUARDED_STOPS, Row, Run, Summary, mission, summary
from tests.missions.guard import guard_runs, open_loop
from tests.missions.parallel import fly_all, numbers
from tests.missions.promise import HEADS, cells, markdown, shortfalls
from tests.missions.proofs import commands as proofs
from tests.missions.world.drift import FLOWN_DRIFT

FIXED = tuple(range(1, 61))
ORBIT_CELL_M = 2.0
OUT = Path("build/missions")
SHOWN = (("optimistic", 3), ("U-traps", 1), ("ringed goals", 1))
app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=__doc__)


def runs(fresh: int | None = None) -> tuple[Run, ...]:
    """Return the whole campaign; `fresh` is the first of 60 more seeds."""
    made = [Run("optimistic", "main", FIXED)]
    if fresh is not None:
        made.append(Run("optimistic, fresh seeds", "main", tuple(range(fresh, fresh + 60))))
    made += [
        Run("pose error 5 cm + 1 deg", "main", FIXED, errors=POSE_ERROR),
        Run("legs of 4 m, as flown", "main", FIXED, {"mission.leg_m": 4.0}, REGISTERED, drift=FLOWN_DRIFT),
        Run(
            "demo fields 101 to 130, as flown",
            "demo",
            tuple(range(101, 131)),
            {"mission.leg_m": 4.0},
            REGISTERED,
            ORBIT_CELL_M,
            FLOWN_DRIFT,
        ),
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
    fresh_from: Annotated[Optional[str], typer.Option(help="60 more seeds, from this commit's id.")] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = os.cpu_count() or 1,
    out: Annotated[Path, typer.Option(help="Folder for missions.json, table.md and pictures.")] = OUT,
) -> None:
    """Fly, write one row a mission, show the table. Exit 1 if the default rule falls short of its promise.

    Files are rewritten after each mission, so finished missions are stored at a Ctrl-C (exit 130). Ctrl-C waits for the
    missions in progress, a second one ends at once.
    """
    chosen = _chosen(name, seeds, fresh_from)
    total = sum(len(run.seeds) for run in chosen)
    out.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    try:
        for row in fly_all(campaign.fly, chosen, workers):
            rows.append(row)
            told = f"{row.run}, seed {row.seed}: {row.outcome} after {row.stops} stops, {row.way_m:.1f} m"
            typer.echo(f"{len(rows)} of {total}: {told}", err=True)
            _write(rows, chosen, out)
    except KeyboardInterrupt:
        _write(rows, chosen, out)
        typer.echo(f"stopped after {len(rows)} of {total} missions, written to {out}", err=True)
        raise typer.Exit(130) from None
    lines = _summed(rows)
    _show(lines)
    if not name:
        for of, seed in SHOWN:
            _draw(of, seed, out / f"{of.replace(' ', '-')}-{seed}.png")
    proofs.end(shortfalls(lines))


@app.command()
def table(
    missions: Annotated[Path, typer.Option(help="What `fly` wrote.")] = OUT / "missions.json",
) -> None:
    """Print the table of the last campaign in Markdown, as in docs/missions.md."""
    try:
        rows = [Row.of_json(row) for row in json.loads(missions.read_text())]
    except (OSError, ValueError, TypeError) as error:
        raise typer.BadParameter(f"{missions}: {error}; run `make missions` first", param_hint="--missions") from None
    typer.echo(markdown(_summed(rows)), nl=False)


@app.command()
def guard(
    seeds: Annotated[str, typer.Option(help="Only these seeds: 1-10 or 3,7.")] = "",
    workers: Annotated[int, typer.Option(help="Processes.")] = os.cpu_count() or 1,
    objects: Annotated[int, typer.Option(help="Holes, and as many rocks, that a wheel is to meet.")] = 100,
) -> None:
    """Test the drive guard: objects placed on the tracks, then pitted and smooth fields with and without it.

    Exit 1 if it falls short of its promise.
    """
    wanted = set(numbers(seeds)) if seeds else None
    legs: Sequence[open_loop.Outcome] = ()
    for legs in open_loop.until_met(objects, workers):
        typer.echo(
            "met by a wheel: {} of {objects} holes, {} of {objects} rocks".format(
                *open_loop.met(legs), objects=objects
            ),
            err=True,
        )
    Console(width=150).print(open_loop.table(legs))
    chosen = [run.only(wanted) for run in guard_runs.RUNS]
    total, rows = sum(len(run.seeds) for run in chosen), []
    try:
        for row in fly_all(guard_runs.fly, chosen, workers):
            rows.append(row)
            typer.echo(f"{len(rows)} of {total}: {row}", err=True)
    finally:
        Console(width=190).print(guard_runs.table(rows))
    proofs.end(open_loop.shortfalls(legs) + guard_runs.shortfalls(rows))


@app.command()
def draw(
    name: Annotated[str, typer.Option("--run", help="A run of the table.")],
    seed: Annotated[int, typer.Option(min=1, help="Its field.")],
    out: Annotated[Path, typer.Option(help="The picture, a .png.")],
) -> None:
    """Fly one mission again and draw it stop by stop."""
    if name not in [run.name for run in runs()]:
        names = ", ".join(run.name for run in runs())
        raise typer.BadParameter(f"{name!r}: expected one of {names}", param_hint="--run")
    _draw(name, seed, out)


app.command("map")(proofs.map_command)
app.command("rocks")(proofs.rocks_command)


def _chosen(name: str | None, seeds: str, fresh_from: str | None) -> Sequence[Run]:
    """Return the selected runs."""
    chosen = [run for run in runs(_first_seed(fresh_from)) if not name or run.name.startswith(name)]
    if not chosen:
        raise typer.BadParameter(f"{name!r}: no run begins so", param_hint="--run")
    return [replace(run, seeds=numbers(seeds)) for run in chosen] if seeds else chosen


def _first_seed(commit: str | None) -> int | None:
    """Return the first fresh seed: a commit's id as a number, above the fixed seeds."""
    if commit is None:
        return None
    try:
        return 1000 + int(commit[:7], 16)
    except ValueError:
        raise typer.BadParameter(f"{commit!r}: expected a commit's id", param_hint="--fresh-from") from None


def _write(rows: list[Row], order: Sequence[Run], out: Path) -> None:
    """Write rows, in the order of the runs, and their table to files."""
    names = [run.name for run in order]
    rows.sort(key=lambda row: (names.index(row.run), row.seed))
    (out / "missions.json").write_text(json.dumps([row.as_json() for row in rows], indent=1) + "\n")
    (out / "table.md").write_text(markdown(_summed(rows)))


def _summed(rows: Sequence[Row]) -> list[Summary]:
    """Return one line for each run, in the order of the rows."""
    return [summary(name, [row for row in rows if row.run == name]) for name in dict.fromkeys(row.run for row in rows)]


def _show(lines: Sequence[Summary]) -> None:
    shown = Table(*HEADS, caption="stops and way / optimum: median / p90 / most of the reachable goals reached")
    for line in lines:
        shown.add_row(*cells(line))
    Console(width=150).print(shown)


def _draw(name: str, seed: int, out: Path) -> None:
    run = next(run for run in runs() if run.name == name)
    world, perfect, flight = mission(run, seed)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(drawing.picture(world, perfect, flight))
    typer.echo(f"{out}: {flight.kind} after {len(flight.stops)} stops, {flight.reason}")


if __name__ == "__main__":
    app()
