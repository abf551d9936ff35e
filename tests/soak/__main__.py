"""`python -m tests.soak`: the flight program over an hour (`make soak`).

python -m tests.soak                             ten missions, idle to an hour in lock-step; a minute of wall clock
python -m tests.soak --missions 4 --minutes 8
python -m tests.soak --missions 0 --wall-s 3600  an hour on the wall clock
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from onboard.drivers.status_port import StatusError
from tests.soak import lockstep, wall
from tests.soak.taken import FLAT_MB, MB, Taken

OUT = Path("build/soak")
EX_BROKEN, EX_UNAVAILABLE = 1, 69
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
HEAD = f"{'bench time':>12}{'resident':>12}{'descriptors':>13}{'threads':>9}"


@app.command()
def main(
    missions: Annotated[int, typer.Option(min=0, help="Missions in a row in one process; 0: none, no lock-step.")] = 10,
    minutes: Annotated[float, typer.Option(min=0, help="Bench time in lock-step, missions and idle.")] = 60.0,
    wall_s: Annotated[float, typer.Option(min=0, help="Seconds on the wall clock; 0: none.")] = 60.0,
    out: Annotated[Path, typer.Option(help="Folder for records and logs.")] = OUT,
) -> None:
    """Check for flat memory within 2 MB, no more descriptors or threads, no missed tick, over missions and idle time.

    In lock-step all of this applies. On the wall clock the rover is idle, and missed ticks are counted and printed
    only. Figures are printed.

    Exit codes: 0 all hold, 1 one does not (printed), 69 the daemon did not start on the wall clock.
    """
    broken: list[str] = []
    if missions:
        typer.echo(f"lock-step: {missions} missions, {lockstep.SLOT_S:.0f} s each, idle to {minutes:g} min\n{HEAD}")
        soaked = lockstep.soak(missions, 60.0 * minutes, out / "lockstep", lambda sample: typer.echo(_row(sample)))
        broken += soaked.faults(missions, 60.0 * minutes)
        typer.echo(
            f"{soaked.arrived} of {missions} arrived; {soaked.ticks} ticks, {soaked.left_out} left out; "
            f"{soaked.bench_s:.0f} s of the rover's time in {soaked.wall_s:.0f} s"
        )
    if wall_s:
        typer.echo(f"\nwall clock: {wall_s:g} s alone\n{HEAD}")
        try:
            sat = wall.sit(wall_s, out / "wall")
        except StatusError as error:
            typer.echo(f"soak: {error}; see {out / 'wall' / 'wall.log'}", err=True)
            raise typer.Exit(EX_UNAVAILABLE) from None
        for sample in sat.samples:
            typer.echo(_row(sample))
        typer.echo(f"{sat.ticks} ticks, {sat.left_out} left out; 99 % began under {sat.late_us} us late")
        broken += sat.faults()
    for text in broken:
        typer.echo(f"BROKEN: {text}")
    if broken:
        raise typer.Exit(EX_BROKEN)
    typer.echo(f"\nall hold: resident memory flat within {FLAT_MB:g} MB, no more descriptors or threads")


def _row(sample: Taken) -> str:
    return f"{sample.at_s:>10.0f} s{sample.rss_bytes / MB:>9.1f} MB{sample.descriptors:>13}{sample.threads:>9}"


if __name__ == "__main__":
    app()
