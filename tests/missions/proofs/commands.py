"""Commands of the map's proofs without physics: `python -m tests.missions map`, `... rocks`.

Each prints a line when a field ends, then one table, writes it as Markdown and ends with exit code 1 if a promise is
broken. `--docs` writes the table into the page that includes it, from a whole run only.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from tests.missions.parallel import fly_all, numbers
from tests.missions.proofs import dark_rock, map_proof, rocks_proof
from tests.missions.proofs.dark_rock import DarkRow, DarkRun
from tests.missions.proofs.map_proof import MapRow, MapRun
from tests.missions.proofs.rocks_proof import RockRow, RockRun
from tests.missions.tables import markdown, put, shown
from tests.missions.world.scan_errors import DEFAULT

MAPS_PAGE = Path(__file__).parents[3] / "docs" / "maps.md"
OUT, CPUS = Path("build/missions"), os.cpu_count() or 1
Seeds = Annotated[str, typer.Option(help="Only these seeds: 1-10 or 3,7.")]
Workers = Annotated[int, typer.Option(min=1, help="Processes.")]
Out = Annotated[Path, typer.Option(help="Folder for the rows (.json) and the table (.md).")]
Docs = Annotated[bool, typer.Option("--docs", help="Write the table into its page in docs/; all seeds only.")]


def map_command(
    seeds: Seeds = "",
    fields: Annotated[str | None, typer.Option(help="Only the fields of the `campaign` or of the `demo`.")] = None,
    noise_m: Annotated[float | None, typer.Option(help="1 sigma of a range; default as configured.")] = None,
    workers: Workers = CPUS,
    out: Out = OUT,
    docs: Docs = False,
) -> None:
    """Map of two scans under lost beams, outliers, mixed pixels and dark ground, on 10 campaign and 10 demo fields."""
    if fields not in (None, "campaign", "demo"):
        raise typer.BadParameter(f"{fields!r}: expected campaign or demo", param_hint="--fields")
    _whole(docs, not (seeds or fields or noise_m))
    chosen = numbers(seeds) if seeds else map_proof.SEEDS
    runs = [MapRun(kind, chosen, noise_m) for kind in ("campaign", "demo") if fields in (None, kind)]
    rows: list[MapRow] = []
    for count, found in enumerate(fly_all(map_proof.fly, runs, workers), 1):
        rows += found
        kept = ", ".join(f"{100 * row.kept_reachable / max(row.reachable, 1):.1f}" for row in found)
        typer.echo(
            f"{count} of {sum(len(run.seeds) for run in runs)}: {found[0].fields} {found[0].seed}: "
            f"{found[0].reachable} reachable poses; kept, %: {kept}",
            err=True,
        )
    rows.sort(key=lambda row: (row.fields, row.seed))
    lines = map_proof.summed(rows)
    table = [map_proof.cells(line) for line in lines]
    _tell("map", rows, map_proof.HEADS, table, out, MAPS_PAGE if docs else None)
    end(map_proof.shortfalls(lines))


LOSSES = {"default": DEFAULT, "none": None}


def rocks_command(
    seeds: Seeds = "",
    losses: Annotated[str, typer.Option(help="Errors of the sweeps: `default` or `none`.")] = "default",
    workers: Workers = CPUS,
    out: Out = OUT,
    docs: Docs = False,
) -> None:
    """Rocks of 0.07 to 0.15 m, 2 to 8 m away: do they block? Rocks seen by few beams, and dark ones in the path."""
    if losses not in LOSSES:
        raise typer.BadParameter(f"{losses!r}: expected {' or '.join(LOSSES)}", param_hint="--losses")
    _whole(docs, not seeds and losses == "default")
    chosen, errors = numbers(seeds) if seeds else rocks_proof.SEEDS, LOSSES[losses]
    runs = [RockRun(away_m, chosen, errors) for away_m in rocks_proof.AWAYS_M]
    runs += [RockRun(away_m, chosen, rocks_proof.OUTLIERS, few=True) for away_m in rocks_proof.AWAYS_M]
    rows: list[RockRow] = []
    total = sum(len(run.seeds) for run in runs)
    for count, found in enumerate(fly_all(rocks_proof.fly, runs, workers), 1):
        rows += found
        typer.echo(
            f"{count} of {total} sweeps: seed {found[0].seed}, {found[0].away_m:g} m away: "
            f"{sum(row.blocks for row in found)} of {len(found)} rocks block",
            err=True,
        )
    rows.sort(key=lambda row: (row.few, row.away_m, row.seed, row.height_m))
    dark: list[DarkRow] = []
    for dark_row in fly_all(dark_rock.fly, [DarkRun(_within(dark_rock.SEEDS, seeds), errors)], workers):
        dark.append(dark_row)
        typer.echo(f"{len(dark)} dark rocks: {dark_row}", err=True)
    dark.sort(key=lambda row: row.seed)
    table = [*rocks_proof.cells(rows), dark_rock.cells(dark)]
    _tell("rocks", [*rows, *dark], rocks_proof.HEADS, table, out, MAPS_PAGE if docs else None)
    end(rocks_proof.shortfalls(rows) + dark_rock.shortfalls(dark))


def _within(all_seeds: tuple[int, ...], asked: str) -> tuple[int, ...]:
    """Return the selected seeds."""
    return tuple(seed for seed in all_seeds if not asked or seed in numbers(asked))


def _whole(docs: bool, whole: bool) -> None:
    if docs and not whole:
        raise typer.BadParameter("the page takes a whole run: leave the other options out", param_hint="--docs")


def _tell(
    name: str, rows: Sequence[Any], heads: Sequence[str], table: Sequence[Sequence[str]], out: Path, page: Path | None
) -> None:
    """Print the table; write rows and table to files, and into the page."""
    out.mkdir(parents=True, exist_ok=True)
    (out / f"{name}.json").write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n")
    (out / f"{name}.md").write_text(markdown(heads, table))
    if page:
        put(page, name, markdown(heads, table))
    Console(width=150).print(shown(heads, table))


def end(short: Sequence[str]) -> None:
    """Print the broken promises; exit with code 1 if there are any."""
    for text in short:
        typer.echo(f"falls short: {text}", err=True)
    raise typer.Exit(1 if short else 0)
