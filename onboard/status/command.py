"""The command `onboard status`: shows the state of the daemon on this machine, once or repeatedly."""

from __future__ import annotations

import json
import math
import time
from pathlib import Path
from typing import Any

import click
from click.exceptions import Exit

from onboard.command_line import EX_UNAVAILABLE, fail
from onboard.drivers.status_port import StatusError, ask, usual_places
from protocol.visible import visible, visible_lines

CLEAR = "\x1b[H\x1b[2J"


@click.command()
@click.option("--socket", "place", type=Path, metavar="PATH", help="The daemon's status.socket; without: where usual.")
@click.option("--json", "as_json", is_flag=True, help="The report as it comes, one JSON object a line.")
@click.option("--watch", "-w", is_flag=True, help="Again and again, until Ctrl-C.")
@click.option("--every", "every_s", type=click.FloatRange(0.1, 3600), default=1.0, show_default=True, metavar="S",
              help="Time between two looks of --watch.")  # fmt: skip
def status(place: Path | None, as_json: bool, watch: bool, every_s: float) -> None:
    """Mode, phase, pose, rate groups with slips and worst times, jobs, real-time options, record of the daemon here;
    processor, memory, temperature and disk of the computer.

    Exit codes: 0 report shown, 69 no daemon answers.

    \b
    Examples:
      onboard status
      onboard status --watch
      onboard status --json | jq .ticks.slipped
    """
    places = (place,) if place else usual_places()
    while True:
        try:
            told = ask(places)
            shown = told.decode("utf-8", "replace") if as_json else "\n".join(map(visible, page(told))) + "\n"
        except StatusError as error:
            hint = "`onboard run` starts one, its status.socket says where it answers"
            raise fail(EX_UNAVAILABLE, f"{error}; {hint}") from None
        click.echo((CLEAR if watch and not as_json else "") + visible_lines(shown), nl=False)
        if not watch:
            raise Exit(0)
        time.sleep(every_s)


def page(told: bytes) -> list[str]:
    """Read the report and format it for people. Raises StatusError if another program than the daemon answered."""
    try:
        return lines(json.loads(told))
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise StatusError("what answers there is no daemon of this version") from None


def lines(told: dict[str, Any]) -> list[str]:
    """Format the report for people."""
    pose = told["pose"]
    at = f"x {pose['x_m']:.2f} y {pose['y_m']:.2f} z {pose['z_m']:.2f} m"
    return [
        f"mode      {told['mode']}, phase {told['phase']}; faults: {', '.join(told['faults']) or 'none'}",
        f"pose      {at}, heading {math.degrees(pose['yaw_rad']):.1f} deg",
        f"running   {_time(told['uptime_s'])}, {told['clock']} clock, process {told['pid']}",
        f"record    {_record(told['record'])}",
        f"computer  {_computer(told['computer'])}",
        *_real_time(told["real_time"]),
        "",
        *_groups(told["rate_groups"]),
        "",
        *_ticks(told["ticks"], told["clock"]),
        "",
        *_jobs(told["jobs"]),
    ]


def _time(seconds: float) -> str:
    minutes, rest = divmod(seconds, 60)
    hours, minutes = divmod(int(minutes), 60)
    return f"{hours} h {minutes} min {rest:.0f} s" if hours else f"{minutes} min {rest:.0f} s"


def _record(record: dict[str, Any] | None) -> str:
    return f"{record['path']}, {record['bytes'] / 1e6:.1f} MB" if record else "none (record.path is empty)"


def _computer(told: dict[str, float | None] | None) -> str:
    if told is None:
        return "says nothing of itself (it is looked at once a second, on the wall clock)"
    parts = {
        "cpu_ratio": (100, "% of the processor at work"),
        "process_ratio": (1, "cores for this program"),
        "rss_bytes": (1e-6, "MB resident"),
        "free_memory_bytes": (1e-6, "MB of memory free"),
        "temperature_c": (1, "°C"),
        "free_disk_bytes": (1e-9, "GB of disk free"),
    }
    known = {name: value for name, value in told.items() if value is not None}
    return ", ".join(f"{known[name] * scale:.4g} {unit}" for name, (scale, unit) in parts.items() if name in known)


def _real_time(rows: list[dict[str, Any]]) -> list[str]:
    if not rows:
        return ["real time nothing asked for ([realtime] in the configuration)"]
    return [f"real time {row['option']}: {'' if row['granted'] else 'NOT granted: '}{row['text']}" for row in rows]


def _groups(rows: list[dict[str, Any]]) -> list[str]:
    head = f"{'rate group':<14}{'rate':>8}{'budget':>10}{'worst':>10}{'over':>8}{'slips':>8}"
    return [head] + [
        f"{row['name']:<14}{row['rate_hz']:>5.0f} Hz{row['budget_us']:>7.0f} us{row['worst_us']:>7.0f} us"
        f"{row['over_budget']:>8}{row['slips']:>8}"
        for row in rows
    ]


def _ticks(ticks: dict[str, Any], clock: str) -> list[str]:
    if not sum(ticks["lateness"]):
        return [f"ticks are not measured on the {clock} clock"] if clock != "wall" else ["no tick was measured yet"]
    below = ticks["late_below_us"]
    return [
        f"wake-up late: 50 % under {below['p50']} us, 99 % under {below['p99']} us, 99.9 % under {below['p999']} us, "
        f"worst {ticks['late_worst_ms']:.2f} ms; longest tick {ticks['worst_ms']:.2f} ms",
        f"ticks left out: {ticks['slipped']}",
        *(
            f"  {row['ticks']} by {row['cause']}{' beside ' + row['job'] if row['job'] else ''}, "
            f"{row['worst_ms']:.1f} ms"
            for row in ticks["slips"]
        ),
    ]


def _jobs(jobs: dict[str, Any]) -> list[str]:
    rows = [
        f"{name:<14}{row['done']:>6} done{row['late']:>5} late, at worst {row['worst_late_ticks'] * 10} ms after its "
        f"tick; ran {row['worst_ms']:.0f} ms"
        for name, row in jobs["kept"].items()
    ]
    return [f"jobs running: {', '.join(jobs['running']) or 'none'}", *rows]
