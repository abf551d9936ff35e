"""`onboard jitter`: delay and duration of the tick on this machine, compared with a bare loop."""

from __future__ import annotations

import json
import signal
import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from click.exceptions import Exit
from numpy.typing import NDArray

from onboard.bringup.jitter import reference
from onboard.bringup.jitter.measure import WARM_TICKS, Bed, JitterFigures
from onboard.command_line import EX_INTERRUPTED, EX_UNAVAILABLE, fail, read_config
from onboard.config import Config, Realtime
from onboard.drivers.platform.clock import WallClock
from onboard.drivers.platform.realtime import Grant, words
from protocol.conventions import TICK_NS

SHARES = {"p50": 50, "p99": 99, "p999": 99.9, "max": 100}
ALL = Realtime(fifo_priority=50, lock_memory=True, absolute_sleep=True, collect_in_slack=True)
HINT = "try `onboard jitter --real-time`, and [realtime] in the configuration"


@click.command()
@click.option("--config", "-c", "path", type=Path, metavar="FILE", help="TOML file; without it the defaults.")
@click.option("--set", "-s", "settings", multiple=True, help="section.key=value, over the file; repeatable.")
@click.option("--seconds", type=click.FloatRange(1, 86400), default=30.0, show_default=True, help="How long.")
@click.option("--real-time", "everything", is_flag=True, help="Ask for every real-time option.")
@click.option("--no-job", is_flag=True, help="Without the planner beside: what its job costs is the difference.")
@click.option("--json", "as_json", is_flag=True, help="The figures as JSON.")
def jitter(
    path: Path | None, settings: tuple[str, ...], seconds: float, everything: bool, no_job: bool, as_json: bool
) -> None:
    """Measure this machine: the daemon's own tick loop with nothing connected, and a planner job in parallel.

    cyclictest (Debian package rt-tests) runs at the same time if it is installed, else a bare loop in C++.
    Stop a running daemon first: both would measure each other.

    Exit codes: 0 measured, 69 no reference can be run, 130 ended by Ctrl-C, with the figures so far.

    \b
    Examples:
      onboard jitter
      onboard jitter --real-time --seconds 300
      onboard jitter --config rover.toml --json > jitter.json
    """
    config = read_config(path, settings)
    config = replace(config, realtime=replace(ALL, cpu=config.realtime.cpu)) if everything else config
    clock = WallClock()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: setattr(clock, "stopping", True))
    try:
        ours, theirs, kind = run(config, clock, round(seconds * 1e9 / TICK_NS), not no_job)
    except reference.ReferenceError as error:
        raise fail(EX_UNAVAILABLE, str(error)) from None
    told = figures(ours, theirs, kind)
    click.echo(json.dumps(told) if as_json else "\n".join(lines(told)))
    if clock.stopping:
        raise fail(EX_INTERRUPTED, f"ended by Ctrl-C after {len(ours.late_us) * TICK_NS / 1e9:.0f} s")
    raise Exit(0)


def run(
    config: Config, clock: WallClock, ticks: int, job: bool
) -> tuple[JitterFigures, NDArray[np.float64] | None, str]:
    """Run our loop and the reference at the same time.

    Returns our figures, the reference's (None if it was not allowed to finish), and the reference's kind.
    """
    with closing(Bed(config, clock, _progress, job)) as bed:
        fifo = any(grant.option == "fifo_priority" and grant.granted for grant in bed.grants)
        beside = reference.start(TICK_NS, ticks, config.realtime.fifo_priority if fifo else 0)
        try:
            ours = bed.measure(ticks)
            _progress(None)
            theirs = None if clock.stopping else beside.late_us(WARM_TICKS * TICK_NS / 1e9 + 60)
        finally:
            beside.stop()
    return ours, theirs, beside.kind


def figures(ours: JitterFigures, theirs: NDArray[np.float64] | None, kind: str) -> dict[str, Any]:
    """Object that --json writes; microseconds where the name ends in _us."""
    edges = _edges(ours.late_us, theirs)
    return {
        "ticks": len(ours.late_us),
        "slipped_ticks": ours.slipped_ticks,
        "late_us": shares(ours.late_us),
        "tick_us": shares(ours.tick_us),
        "done_us": shares(ours.late_us + ours.tick_us),
        "jobs": ours.jobs,
        "job_worst_ms": ours.job_worst_ms,
        "real_time": [grant._asdict() for grant in ours.grants],
        "reference": None if theirs is None else {"kind": kind, "wakes": len(theirs), "late_us": shares(theirs)},
        "histogram": {
            "edges_us": edges.tolist(),
            "ours": np.histogram(ours.late_us, edges)[0].tolist(),
            "reference": None if theirs is None else np.histogram(theirs, edges)[0].tolist(),
        },
    }


def shares(values_us: NDArray[np.float64]) -> dict[str, float]:
    """p50, p99, p99.9, max."""
    if not len(values_us):
        return {}
    return {name: round(float(np.percentile(values_us, share)), 2) for name, share in SHARES.items()}


def lines(told: dict[str, Any]) -> list[str]:
    """The figures for people."""
    if not told["ticks"]:
        return ["nothing was measured yet"]
    beside = told["reference"]
    grants = words([Grant(**row) for row in told["real_time"]])
    rows = [
        ("wake-up of the tick", told["late_us"]),
        ("work of the tick", told["tick_us"]),
        ("both: tick is done", told["done_us"]),
    ]
    rows += [(beside["kind"], beside["late_us"])] if beside else []
    return [
        *(grants or [f"real time: nothing asked for; {HINT}"]),
        f"{told['ticks']} ticks of 10 ms, {told['slipped_ticks']} left out; {told['jobs']} planner jobs beside, "
        f"the longest {told['job_worst_ms']:.0f} ms",
        "",
        f"{'us late':<22}{'p50':>9}{'p99':>9}{'p99.9':>9}{'max':>9}",
        *(f"{name:<22}" + "".join(f"{figure:>9.0f}" for figure in found.values()) for name, found in rows),
        *_ratios(told),
        "",
        *_histogram(told["histogram"], beside["kind"] if beside else ""),
    ]


def _ratios(told: dict[str, Any]) -> list[str]:
    beside = told["reference"]
    if not beside:
        return []
    pairs = zip(told["late_us"].values(), beside["late_us"].values())
    rows = ["ours / " + beside["kind"]]
    made = [f"{rows[0]:<22}" + "".join(f"{ours / max(theirs, 0.01):>9.2f}" for ours, theirs in pairs)]
    if beside["kind"] != reference.CYCLICTEST:
        made.append(f"cyclictest is not installed (package {reference.PACKAGE}); the bare loop does the same in C++")
    return made


def _histogram(histogram: dict[str, Any], kind: str) -> list[str]:
    edges, ours, theirs = histogram["edges_us"], histogram["ours"], histogram["reference"]
    most = max(*ours, 1)
    rows = [f"{'us late':>16}{'ours':>8}" + (f"{kind:>13}" if theirs else "")]
    for k, count in enumerate(ours):
        other = f"{theirs[k]:>13}" if theirs else ""
        bar = "#" * round(40 * count / most)
        rows.append(f"{edges[k]:>7.0f} -{edges[k + 1]:>7.0f}{count:>8}{other}  {bar}")
    return rows


def _edges(ours_us: NDArray[np.float64], theirs_us: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """Histogram edges: 0, then powers of two up to the largest value."""
    most = max(float(np.max(part, initial=1.0)) for part in (ours_us, theirs_us) if part is not None)
    return np.concatenate([[0.0], 2.0 ** np.arange(0, int(np.ceil(np.log2(most))) + 1)])


def _progress(ratio: float | None) -> None:
    """Write the progress to standard error if it is a terminal; None clears the line."""
    if sys.stderr.isatty():
        text = "" if ratio is None else f"measuring: {100 * ratio:3.0f} %"
        sys.stderr.write(f"\r{text:<20}" + ("\r" if ratio is None else ""))
        sys.stderr.flush()
