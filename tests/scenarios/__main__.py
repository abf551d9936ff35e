"""`python -m tests.scenarios`: campaigns with physics, each flight in one process (`make test-scenarios`).

    python -m tests.scenarios                     all campaigns, whole
    python -m tests.scenarios --short             all, as CI flies them
    python -m tests.scenarios library --rest 2    a third of the seeds that CI does not always fly
    python -m tests.scenarios nominal --seeds 1-3 --workers 1
    python -m tests.scenarios losses --seeds 801-830
    python -m tests.scenarios fresh --docs          whole, its summary into docs/campaigns.md

To add one: tests/scenarios/registry.py.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Annotated, Any, Optional

import typer
from rich.console import Console
from rich.table import Table

from tests.missions.parallel import fly_all, numbers
from tests.missions.tables import markdown, put, shown
from tests.scenarios.goals.flown import HEADS
from tests.scenarios.registry import CAMPAIGNS, RENEWED, Asked, Campaign, fly_one

OUT, PAGE = Path("build/scenarios"), Path(__file__).parents[2] / "docs" / "campaigns.md"
EX_SHORT, EX_INTERRUPTED = 1, 130
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    name: Annotated[Optional[str], typer.Argument(help=f"One of {', '.join(CAMPAIGNS)}; all without.")] = None,
    seeds: Annotated[str, typer.Option(help="Only these seeds: 1-10 or 3,7.")] = "",
    short: Annotated[bool, typer.Option("--short", help="The seeds that CI flies.")] = False,
    rest: Annotated[int, typer.Option(min=-1, max=2, help="This third, 0 to 2, of those that CI does not fly.")] = -1,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = os.cpu_count() or 1,
    out: Annotated[Path, typer.Option(help="Folder for NAME.json, rewritten after each flight.")] = OUT,
    docs: Annotated[bool, typer.Option("--docs", help="Write the summaries into docs/, of whole campaigns.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Rows as JSON in place of the tables.")] = False,
) -> None:
    """Fly campaigns, write one row a flight, show the tables.

    Exit codes: 0 all promises hold, 1 one is broken (printed with its seed), 130 Ctrl-C: flights in progress are
    finished and written, a second Ctrl-C ends at once.
    """
    chosen = _chosen(name, seeds, short, rest)
    rows: dict[str, list[Any]] = {asked.name: [] for asked in chosen}
    total = sum(len(asked.seeds) for asked in chosen)
    out.mkdir(parents=True, exist_ok=True)
    try:
        for count, (of, row) in enumerate(fly_all(fly_one, chosen, workers, RENEWED), 1):
            rows[of] = sorted([*rows[of], row], key=lambda r: r.seed)
            (out / f"{of}.json").write_text(json.dumps([asdict(r) for r in rows[of]], indent=1) + "\n")
            typer.echo(f"{count} of {total}: {of}: {row}", err=True)
    except KeyboardInterrupt:
        typer.echo(f"stopped after {sum(map(len, rows.values()))} of {total} flights, written to {out}", err=True)
        raise typer.Exit(EX_INTERRUPTED) from None
    _show(rows, as_json)
    if docs:
        _put(rows)
    broken = [f"{of}: {text}" for of in rows for text in CAMPAIGNS[of].judge(rows[of])]
    for text in broken:
        typer.echo(f"falls short: {text}", err=True)
    raise typer.Exit(EX_SHORT if broken else 0)


def _chosen(name: str | None, seeds: str, short: bool, rest: int) -> list[Asked]:
    if name is not None and name not in CAMPAIGNS:
        raise typer.BadParameter(f"{name!r}: expected one of {', '.join(CAMPAIGNS)}", param_hint="NAME")
    wanted = {of: row for of, row in CAMPAIGNS.items() if name in (None, of)}
    if seeds:
        return [Asked(of, numbers(seeds)) for of in wanted]
    if rest >= 0:
        return [Asked(of, _rest(row)[rest::3]) for of, row in wanted.items()]
    return [Asked(of, row.SHORT if short else row.SEEDS) for of, row in wanted.items()]


def _rest(row: Campaign) -> tuple[int, ...]:
    return tuple(seed for seed in row.SEEDS if seed not in row.SHORT)


def _show(rows: Mapping[str, Sequence[Any]], as_json: bool) -> None:
    if as_json:
        print(json.dumps({name: [asdict(row) for row in found] for name, found in rows.items()}, indent=1))
        return
    console = Console(width=None if sys.stdout.isatty() else 170)
    for name, found in rows.items():
        console.print(f"{name}: {(CAMPAIGNS[name].__doc__ or '').splitlines()[0]}", highlight=False)
        console.print(table(found))
        if lines := _summary(name, found):
            console.print(shown(_heads(name), lines))


def _summary(name: str, rows: Sequence[Any]) -> list[tuple[str, ...]]:
    """Return the lines that the page includes; none if it includes nothing of this campaign."""
    made: list[tuple[str, ...]] = getattr(CAMPAIGNS[name], "summary", lambda _: [])(rows) if rows else []
    return made


def _heads(name: str) -> tuple[str, ...]:
    """Return a summary's columns: the campaign's own, or those of missions."""
    own: tuple[str, ...] = getattr(CAMPAIGNS[name], "HEADS", HEADS)
    return own


def _put(rows: Mapping[str, Sequence[Any]]) -> None:
    """Write the summaries of campaigns that were flown whole into the page."""
    for name, found in rows.items():
        lines = _summary(name, found)
        if lines and {row.seed for row in found} == set(CAMPAIGNS[name].SEEDS):
            put(PAGE, name, markdown(_heads(name), lines))


def table(rows: Sequence[Any]) -> Table:
    """Return a table with a column for each field of the rows."""
    heads = [field.name for field in fields(rows[0])] if rows else []
    shown = Table(*heads)
    for row in rows:
        shown.add_row(*(_cell(getattr(row, head)) for head in heads))
    return shown


def _cell(value: Any) -> str:
    if isinstance(value, tuple | list):
        return ", ".join(map(_cell, value)) or "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    app()
