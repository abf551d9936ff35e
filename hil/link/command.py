"""Command `hil link`: the lossy link between rover and ground, alone or as part of a run."""

from __future__ import annotations

import json
import re
import signal
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from hil.link.emulator import LinkEmulator, LinkError, run_lockstep, run_wall
from hil.link.impairment import PROFILES, Impairment, Profile, load_profile, profile_names
from hil.link.record import Meter, Recorder
from hil.link.udp_relay import UdpRelay
from onboard.config import ConfigError
from protocol import WireError
from protocol.barrier import parse_address
from protocol.visible import visible_lines

EX_USAGE, EX_UNAVAILABLE, EX_CANTCREAT = 64, 69, 73
NS = 1_000_000_000
ZENOH, UDP = "zenoh", "udp"
_LISTEN = {ZENOH: ("tcp/127.0.0.1:7447", "tcp/127.0.0.1:7448"), UDP: ("udp/127.0.0.1:7450", "udp/127.0.0.1:7451")}

EPILOG = (
    "Examples:\n\n  hil link --list                                   the profiles\n\n"
    "  hil link --profile moon-bad --record lost.csv     each datagram's fate\n\n"
    "  hil link --profile stress --json                  figures, a line of JSON a second\n\n"
    "  hil link --carrier udp --profile moon             the rover listens on UDP port 7450,\n\n"
    "                                                    the ground connects to 7451\n\n"
    "Exit codes: 0 ended, 64 wrong option or profile, 69 port in use or bench gone, 73 a file cannot be written."
)


def main(
    profile: Annotated[str, typer.Option(help="Name of a link profile; --list shows them.")] = "lan",
    profiles: Annotated[Path, typer.Option(help="File of link profiles.")] = PROFILES,
    carrier: Annotated[str, typer.Option(help="zenoh: samples go through this node; udp: a relay.")] = ZENOH,
    rover: Annotated[str, typer.Option(help="Where to listen for the rover; udp: where it listens.")] = "",
    ground: Annotated[str, typer.Option(help="Where to listen for the ground station.")] = "",
    seed: Annotated[int, typer.Option(min=0, help="Seed of both directions' drop lists.")] = 1,
    barrier: Annotated[str, typer.Option(help="tcp:HOST:PORT of the bench; without it the wall clock.")] = "",
    real_time: Annotated[bool, typer.Option("--real-time", help="The ground is live: take what it sends.")] = False,
    report: Annotated[Path | None, typer.Option(help="JSON file for the counts and sums at the end.")] = None,
    record: Annotated[Path | None, typer.Option(help="CSV file for each datagram: when, what, why lost.")] = None,
    seconds: Annotated[float, typer.Option(min=0, help="End after so long (wall clock); 0: by Ctrl-C.")] = 0.0,
    as_json: Annotated[bool, typer.Option("--json", help="Figures as a line of JSON a second.")] = False,
    list_them: Annotated[bool, typer.Option("--list", help="Show the profiles and end.")] = False,
) -> None:
    """Carry datagrams between rover and ground through a lossy link; live figures on a terminal."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # the report is written at every end
    try:
        if list_them:
            _list(profiles, as_json)
            return
        chosen, ends = load_profile(profile, profiles), _endpoints(carrier, rover, ground)
        address = _address(barrier, carrier)
        with ExitStack() as stack:
            recorder = stack.enter_context(Recorder(record)) if record else None
            link = stack.enter_context(_carrier(carrier, chosen, seed, ends, recorder))
            try:
                if address and isinstance(link, LinkEmulator):
                    run_lockstep(link, address, real_time)
                else:
                    run_wall(link.turn, _watch((link.down, link.up), seconds, as_json))
            except KeyboardInterrupt:
                typer.echo("hil link: ended by a signal", err=True)
            finally:
                if report:
                    report.write_text(json.dumps(link.report(), indent=2) + "\n")
    except (ConfigError, LinkError, WireError) as error:
        raise _fail(EX_USAGE if isinstance(error, ConfigError) else EX_UNAVAILABLE, error) from None
    except OSError as error:
        raise _fail(EX_CANTCREAT, f"{error.filename}: {error.strerror}") from None


def _fail(code: int, text: object) -> typer.Exit:
    typer.echo(visible_lines(f"hil link: {text}"), err=True)
    return typer.Exit(code)


def _endpoints(carrier: str, rover: str, ground: str) -> tuple[str, str]:
    if carrier not in _LISTEN:
        raise ConfigError(f"--carrier {carrier!r} should be {ZENOH} or {UDP}")
    usual = _LISTEN[carrier]
    return rover or usual[0], ground or usual[1]


def _address(barrier: str, carrier: str) -> tuple[str, int] | None:
    if barrier and carrier == UDP:
        raise ConfigError("--barrier: a session over UDP keeps its own time; leave it out or take --carrier zenoh")
    try:
        return parse_address(barrier) if barrier else None
    except ValueError as error:
        raise ConfigError(f"--barrier {error}") from None


def _carrier(
    carrier: str, profile: Profile, seed: int, endpoints: tuple[str, str], recorder: Recorder | None
) -> LinkEmulator | UdpRelay:
    if carrier == ZENOH:
        return LinkEmulator(profile, seed, *endpoints, recorder)
    rover, ground = (_udp(text, name) for text, name in zip(endpoints, ("--rover", "--ground")))
    try:
        return UdpRelay(profile, seed, rover, ground, recorder)
    except OSError as error:
        raise LinkError(f"cannot listen on {endpoints[1]}: {error.strerror}") from error


def _udp(text: str, option: str) -> tuple[str, int]:
    found = re.fullmatch(r"udp/([^:/]+):(\d{1,5})", text)
    if not found or int(found[2]) > 65_535:
        raise ConfigError(f"{option} {text!r} should be udp/HOST:PORT")
    return found[1], int(found[2])


def _list(path: Path, as_json: bool) -> None:
    loaded = {name: load_profile(name, path) for name in profile_names(path)}
    if as_json:
        rows = [
            {"name": name, **{key: getattr(one, key) for key in one.__dataclass_fields__}}
            for name, one in loaded.items()
        ]
        typer.echo(json.dumps(rows))
        return
    table = Table("name", "down / up, kbit/s", "one way, s", "loss", "beside", "stands for")
    for name, p in loaded.items():
        table.add_row(
            name, f"{p.down_bps / 1e3:g} / {p.up_bps / 1e3:g}", f"{p.one_way_s:g}", f"{p.loss:.0%}", _beside(p), p.note
        )
    Console(width=None if sys.stdout.isatty() else 150).print(table)


def _beside(p: Profile) -> str:
    parts = {
        f"shadows of {p.mean_bad_s:g} s, {p.mean_good_s:g} s apart": p.mean_bad_s,
        f"blackouts of {p.blackout_length_s:g} s": p.blackout_length_s,
        f"{p.duplicate:.0%} twice": p.duplicate,
        f"{p.reorder:.0%} late": p.reorder,
    }
    return ", ".join(text for text, there in parts.items() if there)


def _watch(models: tuple[Impairment, Impairment], seconds: float, as_json: bool) -> Callable[[int], bool]:
    """Stop function of the run: True when its time is over; shows figures once a second, on a terminal or as JSON."""
    meters = [Meter(name, model) for name, model in zip(("down", "up"), models)]
    shown, next_ns = as_json or sys.stderr.isatty(), NS

    def over(now_ns: int) -> bool:
        nonlocal next_ns
        if shown and now_ns >= next_ns:
            next_ns += NS
            rows = [meter.now(now_ns) for meter in meters]
            if as_json:
                figures: dict[str, Any] = {row.direction: row.report() for row in rows}
                typer.echo(json.dumps({"at_s": round(now_ns / NS, 3), **figures}))
            else:
                sys.stderr.write(f"\r\x1b[K{now_ns // NS} s  " + "  |  ".join(row.text() for row in rows))
                sys.stderr.flush()
        return bool(seconds) and now_ns >= seconds * NS

    return over
