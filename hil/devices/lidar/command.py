"""Command `hil lidar`: an emulated scanner for any driver, on TCP and a pseudo terminal."""

from __future__ import annotations

import errno
import json
import os
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.live import Live
from rich.text import Text

from hil.devices.lidar.cable import Cable
from hil.devices.lidar.errors import NEEDS_A_FIELD, lidar_errors, lidar_table, plain
from hil.devices.lidar.faults import KINDS, load_faults, parse_fault
from hil.devices.lidar.profile import PROFILES, Profile
from hil.devices.lidar.scenes import SCENES, still
from hil.devices.lidar.sensor import Cast, Lidar
from hil.devices.lidar.server import LidarServer, LidarTerminal
from hil.devices.lidar.service import Outlet, serve
from onboard.config import ConfigError
from protocol import scip
from protocol.visible import visible_lines

NS = 1_000_000_000
EX_USAGE, EX_NOINPUT, EX_UNAVAILABLE = 64, 66, 69
PORT = 10940  # factory default

EPILOG = (
    "Examples:\n\n  hil lidar                                        an EW on 127.0.0.1:10940, in a room\n\n"
    "  hil lidar --profile utm-30lx --pty               USB; prints the device's path\n\n"
    "  hil lidar --clock-start -5000                    the counter wraps after 5 s\n\n"
    "  hil lidar --lidar lost_ratio=0.02 --lidar mixed_ratio=0.1\n\n"
    "  hil lidar --fault flip=0.001@10+5 --fault cable@30+2\n\nFaults, as KIND[=VALUE]@BEGIN[+SECONDS]:\n\n"
    + "\n\n".join(f"  {name}={kind.value}: {kind.means}" for name, kind in KINDS.items())
)


def main(
    profile: Annotated[str, typer.Option(help=f"Sensor: {', '.join(PROFILES)}.")] = "utm-30lx-ew",
    tcp: Annotated[str, typer.Option(help="Serve TCP on PORT or HOST:PORT; 0 takes a free port.")] = "",
    pty: Annotated[bool, typer.Option("--pty", help="Serve a pseudo terminal.")] = False,
    link: Annotated[Path | None, typer.Option(help="A link of this name to the pseudo terminal.")] = None,
    scene: Annotated[str, typer.Option(help=f"What it sees: {', '.join(SCENES)}.")] = "room",
    tilt: Annotated[float, typer.Option(help="Degrees that its front looks down.", min=-90, max=90)] = 0.0,
    lidar: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="As in a scenario's [lidar] (docs/sensors.md), over the profile; may be repeated.",
        ),
    ] = None,
    fault: Annotated[list[str] | None, typer.Option(help="A fault, see below; may be repeated.")] = None,
    faults: Annotated[Path | None, typer.Option(help="TOML file of `fault` tables: kind, at_s, for_s, value.")] = None,
    clock_start: Annotated[float, typer.Option(help="First count of its clock, ms; below 0: before the wrap.")] = 0.0,
    rate_error: Annotated[float, typer.Option(help="Its clock runs fast by so many ppm.", min=-1e4, max=1e4)] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="Of noise, jitter and faults.")] = 1,
    seconds: Annotated[float, typer.Option(help="End after so long; 0: at Ctrl-C.", min=0)] = 0.0,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object a second on standard output.")] = False,
) -> None:
    """Emulate a Hokuyo scanner for a driver under test. Without --tcp and --pty: TCP on port 10940.

    TCP and terminal have a sensor each, in the same place. Exit codes: 0 ended by Ctrl-C or --seconds, 64 an option is
    wrong, 66 no such file, 69 the port is not available.
    """
    try:
        made = _profile(profile, lidar or [], clock_start, rate_error)
        schedule = tuple(parse_fault(text) for text in fault or ()) + (load_faults(faults) if faults else ())
        cast = _scene(scene, tilt)
        with ExitStack() as stack:
            cables = _cables(stack, tcp, pty, link)
            outlets = [Outlet(Lidar(seed + k, cast, made, schedule), cable) for k, cable in enumerate(cables)]
            _serve(outlets, profile, seconds, as_json)
    except ConfigError as error:
        raise _fail(EX_USAGE, str(error)) from None
    except FileNotFoundError:
        raise _fail(EX_NOINPUT, f"no file {faults}") from None
    except KeyboardInterrupt:
        typer.echo("hil lidar: ended by Ctrl-C", err=True)


def _fail(code: int, text: str) -> typer.Exit:
    typer.echo(visible_lines(f"hil lidar: {text}"), err=True)
    return typer.Exit(code)


def _profile(name: str, words: list[str], clock_start_ms: float, rate_error_ppm: float) -> Profile:
    """Sensor of --profile without added errors, with the keys of --lidar over it."""
    if name not in PROFILES:
        raise ConfigError(f"--profile {name!r} should be one of {', '.join(PROFILES)}")
    table = lidar_table(words, {})
    if missing := {"profile", *NEEDS_A_FIELD} & set(table):
        raise ConfigError(f"--lidar {min(missing)}: not here; a sensor without a field has --profile and no albedo")
    made = lidar_errors({"rate_error_ppm": rate_error_ppm, **table}, "--lidar", plain(name)).applied()
    return replace(made, start_ms=clock_start_ms % scip.STAMP_MODULUS)


def _scene(name: str, tilt_deg: float) -> Cast:
    if name not in SCENES:
        raise ConfigError(f"--scene {name!r} should be one of {', '.join(SCENES)}")
    return still(SCENES[name](), float(np.deg2rad(tilt_deg)))


def _cables(stack: ExitStack, tcp: str, pty: bool, link: Path | None) -> list[Cable]:
    cables: list[Cable] = []
    if tcp or not (pty or link):
        host, _, port = (tcp or str(PORT)).rpartition(":")
        if not port.isdecimal() or int(port) > 65_535:
            raise ConfigError(f"--tcp {tcp!r} should be PORT or HOST:PORT, as in 10940")
        host = host or "127.0.0.1"
        try:
            cables.append(LidarServer(host, int(port)))
        except OSError as error:
            hint = "; is another one running? --tcp 0 takes a free port" if error.errno == errno.EADDRINUSE else ""
            number = error.errno or 0
            why = os.strerror(number) if number > 0 else error.strerror  # errors of host name lookup are below 0
            raise _fail(EX_UNAVAILABLE, f"cannot serve {host}:{port}: {why}{hint}") from None
        stack.callback(cables[-1].close)
    if pty or link:
        try:
            cables.append(LidarTerminal(link))
        except OSError as error:
            raise _fail(EX_UNAVAILABLE, f"cannot make {link or 'a pseudo terminal'}: {error.strerror}") from None
        stack.callback(cables[-1].close)
    return cables


def _serve(outlets: list[Outlet], profile: str, seconds: float, as_json: bool) -> None:
    addresses = [outlet.cable.address for outlet in outlets]
    if as_json:
        typer.echo(json.dumps({"profile": profile, "addresses": addresses}))
    else:
        typer.echo(f"{profile} on {' and '.join(addresses)}; Ctrl-C ends it")
    console, shown_s = Console(stderr=True), -1

    with Live(console=console, auto_refresh=False, transient=True) as live:

        def go_on(now_ns: int) -> bool:
            nonlocal shown_s
            if now_ns // NS > shown_s:
                shown_s = now_ns // NS
                rows = [outlet.status(now_ns) for outlet in outlets]
                if as_json:
                    typer.echo(json.dumps({"t_s": shown_s, "sensors": rows}))
                elif console.is_terminal:
                    live.update(Text("\n".join(map(_line, rows)), no_wrap=True, overflow="ellipsis"), refresh=True)
            return not seconds or now_ns < seconds * NS

        serve(outlets, go_on)


def _line(row: dict[str, object]) -> str:
    faults, client = row["faults"], "client" if row["client"] else "-"
    text = f"{row['state']:8} {client:6} {row['clock_ms']:8} ms  {row['requests']} requests  {row['scans']} scans  "
    text += f"{row['dropped']} dropped  {row['address']}"
    return text + (f"  faults: {', '.join(faults)}" if isinstance(faults, dict) and faults else "")
