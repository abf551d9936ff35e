"""`python -m tests.gate`: may this version land? A fixed campaign, its promises, and the committed baseline.

python -m tests.gate                        some minutes on two cores; exit code 1 if red
python -m tests.gate --plant guard_off      the same with a planted regression; it must be red
python -m tests.gate --prove                each planted regression in turn
python -m tests.gate --write                make this version's table the baseline
"""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from hil.campaign.cluster import cluster, fly_all
from hil.campaign.compare import compare, junit
from hil.campaign.flight_process import FLIES
from hil.campaign.plan import load_plan
from hil.campaign.statistics import arrived
from hil.campaign.table import Row, read_table, write_parquet
from hil.run.status import status
from tests.gate.judge import broken, equal, known, worse
from tests.gate.plants import PLANTS

HERE = Path(__file__).parent
PLAN, BASELINE, OUT = HERE / "gate.toml", HERE / "baseline.parquet", Path("build/gate")
EX_RED, EX_LOST, EX_INTERRUPTED = 1, 70, 130
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    plant: Annotated[str, typer.Option(metavar="NAME", help=f"Planted regression: {', '.join(PLANTS)}.")] = "",
    prove: Annotated[bool, typer.Option("--prove", help="Fly with each planted regression: each must be red.")] = False,
    workers: Annotated[int, typer.Option(min=1, help="Flights at a time.")] = os.cpu_count() or 1,
    write: Annotated[bool, typer.Option("--write", help="Write this table as the baseline.")] = False,
    out: Annotated[Path, typer.Option(help="Folder of results.parquet and gate.xml (JUnit).")] = OUT,
) -> None:
    """Fly the gate's campaign and judge it; with a planted regression up to the first broken promise.

    Exit codes: 0 green (--prove: every plant is red), 1 not so, and why, 2 no such plant, 70 a flight was lost, 130
    Ctrl-C.
    """
    if plant and plant not in PLANTS:
        raise typer.BadParameter(f"no plant `{plant}`; there are {', '.join(PLANTS)}", param_hint="--plant")
    try:
        if prove:
            found = {name: _judged(out / name, name, workers) for name in PLANTS}
            green = [name for name, reasons in found.items() if not reasons]
            typer.echo(f"not noticed: {', '.join(green)}" if green else f"{len(found)} of {len(found)} are red")
            raise typer.Exit(EX_RED if green else 0)
        reasons = _judged(out, plant, workers, write)
    except KeyboardInterrupt:
        typer.echo("ended by Ctrl-C; nothing is judged", err=True)
        raise typer.Exit(EX_INTERRUPTED) from None
    raise typer.Exit(EX_RED if reasons else 0)


def _judged(out: Path, plant: str, workers: int, write: bool = False) -> list[str]:
    """Fly, write the table, print and return the reasons to be red."""
    begun_s = time.monotonic()
    rows = _flown(f"{PLANTS[plant].__module__}:{plant}" if plant else FLIES, workers, until_red=bool(plant))
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    write_parquet(out / "results.parquet", rows)
    reasons = list(broken(rows))
    if write:
        write_parquet(BASELINE, rows)
    elif not (plant and reasons):
        baseline = read_table(BASELINE)
        compared = compare(baseline, rows)
        (out / "gate.xml").write_text(junit(compared, "gate"), encoding="utf-8")
        reasons += worse(compared)
        typer.echo(f"{equal(baseline, rows)} of {len(rows)} flights are those of the baseline to the byte")
    about = f"{plant}: " if plant else ""
    typer.echo(f"{about}{sum(map(arrived, rows))} of {len(rows)} arrived; {time.monotonic() - begun_s:.0f} s")
    typer.echo("\n".join((*known(rows), *reasons, "RED" if reasons else "GREEN")))
    return reasons


def _flown(flies: str, workers: int, until_red: bool) -> list[Row]:
    """Fly all cases, or up to the first broken promise; rows sorted by case."""
    plan = load_plan(PLAN)
    rows: list[Row] = []
    begun_s = time.monotonic()
    with status(Console(stderr=True), Text(f"gate: {plan.cases} flights ...")) as tell, cluster(workers) as client:
        for ended in fly_all(client, plan, range(1, plan.cases + 1), flies):
            if ended.row is None:
                typer.echo(ended.problem, err=True)
                raise typer.Exit(EX_LOST)
            rows.append(ended.row)
            tell(Text(f"gate: {len(rows)} of {plan.cases} flown"), time.monotonic() - begun_s)
            if until_red and any(broken(rows)):
                break
    return sorted(rows, key=lambda row: row["case_number"])


if __name__ == "__main__":
    app()
