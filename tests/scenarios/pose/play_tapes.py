"""`python -m tests.scenarios.pose.play_tapes`: records flights as tapes, and estimates over them with other figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy.stats import chi2

from onboard.config import Localisation as Figures
from tests.missions.parallel import numbers
from tests.scenarios.pose.localisation import BAND, Stop, flown
from tests.scenarios.pose.tapes import Player, Recorder, Tape, load

OUT = Path("build/tapes")
AXES = ("x", "y", "z", "yaw")
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def record(seeds: str, out: Annotated[Path, typer.Option(help="Folder for SEED.npz.")] = OUT) -> None:
    """Fly each seed of the campaign `localisation` and store its sensor data."""
    out.mkdir(parents=True, exist_ok=True)
    for seed in numbers(seeds):
        recorder = Recorder()
        row, _ = flown(seed, recorder)
        recorder.tape().save(out / f"{seed}.npz")
        typer.echo(row)


@app.command()
def run(
    seeds: str,
    settings: Annotated[list[str] | None, typer.Option("--set", help="name=value of [localisation].")] = None,
    tapes: Annotated[Path, typer.Option(help="Folder of the tapes.")] = OUT,
) -> None:
    """Estimate over tapes with today's figures and these: errors at the end, and the NEES of each covariance."""
    changes = {name: float(value) for name, _, value in (setting.partition("=") for setting in settings or ())}
    before: list[Stop] = []
    after: list[Stop] = []
    for seed in numbers(seeds):
        tape = load(tapes / f"{seed}.npz")
        played = Player(tape, replace(_todays(tape), **changes)).run()
        before += played.before
        after += played.after
        off = (played.said[-1] - tape.true[-1])[:4]
        place = ", ".join(f"{1e3 * value:.0f}" for value in off[:3])
        typer.echo(f"{seed}: ends {place} mm and {np.degrees(off[3]):.2f} deg off")
        for row, why in played.refused:
            typer.echo(f"    refused at {tape.now_ns[row] / 1e9:.0f} s: {why}")
    for when, stops in (("before", before), ("after", after)):
        typer.echo(worth(when, stops))


def worth(when: str, stops: Sequence[Stop]) -> str:
    """Return the root mean square of error / sigma of each axis, and the mean NEES with its band."""
    if not stops:
        return f"{when}: no registration was believed"
    ratios = np.array([stop.error / np.sqrt(stop.covariance.diagonal()) for stop in stops])
    rms = ", ".join(f"{axis} {v:.2f}" for axis, v in zip(AXES, np.sqrt((ratios**2).mean(axis=0))))
    n, mean = len(stops), sum(stop.nees for stop in stops) / len(stops)
    low, high = (v / n for v in chi2.interval(BAND, 4 * n))
    return f"{when} {n} registrations: errors in sigmas {rms}; NEES {mean:.2f}, band {low:.2f} to {high:.2f}"


def _todays(tape: Tape) -> Figures:
    """Return today's defaults, with the flight's start."""
    was = tape.figures
    return replace(Figures(), start_x_m=was.start_x_m, start_y_m=was.start_y_m, start_yaw_rad=was.start_yaw_rad)


if __name__ == "__main__":
    app()
