"""Command `hil can`: the rover's emulated nodes on a hub or an interface, in real time, for any program on the bus."""

from __future__ import annotations

import errno
import json
import os
import time
from collections.abc import Callable
from contextlib import closing
from typing import Annotated

import typer
from rich.console import Console
from rich.live import Live
from rich.text import Text

from hil.devices.can.hub import CanHub
from hil.devices.can.socket import CanSocket, NoInterfaceError
from hil.devices.can.wheels_off_ground import FAULTS, TICK_NS, Stand
from onboard.config import ConfigError
from protocol.visible import visible_lines

NS = 1_000_000_000
EX_USAGE, EX_UNAVAILABLE = 64, 69
PORT = 29536  # socketcand's default

EPILOG = (
    "Examples:\n\n  hil can                     then: onboard can info --bus socketcand:127.0.0.1:29536/can0\n\n"
    "  hil can --fault silent=WHEEL_3 --fault foreign=WHEEL_1\n\nFaults, as KIND=NODE:\n\n"
    + "\n\n".join(f"  {name}: {fault.means}" for name, fault in FAULTS.items())
)


def main(
    port: Annotated[int, typer.Option(min=0, max=65535, help="Of the hub on the loopback; 0 takes a free one.")] = PORT,
    name: Annotated[str, typer.Option(help="Of the bus, as clients ask for it.")] = "can0",
    bus: Annotated[str, typer.Option(help="No hub: an interface of the kernel, as socketcan:vcan0.")] = "",
    fault: Annotated[list[str] | None, typer.Option(help="A fault, see below; may be repeated.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of noise, offsets and starting times.")] = 1,
    seconds: Annotated[float, typer.Option(help="End after so long; 0: at Ctrl-C.", min=0)] = 0.0,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object a second on standard output.")] = False,
) -> None:
    """Emulate the rover's CAN bus: four wheels on a stand, tilt axis, inertial sensor and power.

    Exit codes: 0 ended by Ctrl-C or --seconds, 64 an option is wrong, 69 the port or interface is not available.
    """
    try:
        stand = faulty(Stand(seed), fault or [])
    except ConfigError as error:
        raise _fail(EX_USAGE, str(error)) from None
    with closing(_opened(bus) if bus else _hub(port, name)) as wire:
        typer.echo(json.dumps({"uri": wire.uri}) if as_json else f"rover's nodes on {wire.uri}; Ctrl-C ends it")
        try:
            with _Status(as_json) as status:
                serve(wire, stand, lambda now_ns: status.go_on(wire, stand, now_ns, seconds))
        except KeyboardInterrupt:
            typer.echo("hil can: ended by Ctrl-C", err=True)
        except ConnectionError as error:
            raise _fail(EX_UNAVAILABLE, str(error)) from None


def faulty(stand: Stand, words: list[str]) -> Stand:
    """Begin the faults of the command line on the stand. Raises ConfigError for an unknown fault or node."""
    for word in words:
        kind, _, node = word.partition("=")
        if kind not in FAULTS or node not in stand.by_name:
            known = f"{', '.join(FAULTS)} and {', '.join(stand.by_name)}"
            raise ConfigError(f"--fault {word!r} should be KIND=NODE, of {known}")
        if kind in ("stuck", "reversed") and not node.startswith("WHEEL"):
            raise ConfigError(f"--fault {word!r}: {node} is no wheel")
        FAULTS[kind].begin(stand, node)
    return stand


def _hub(port: int, name: str) -> CanHub:
    try:
        return CanHub(port=port, bus=name)
    except OSError as error:
        hint = "; is another one running? --port 0 takes a free one" if error.errno == errno.EADDRINUSE else ""
        raise _fail(EX_UNAVAILABLE, f"cannot serve port {port}: {os.strerror(error.errno or 0)}{hint}") from None


def _opened(uri: str) -> CanSocket:
    try:
        return CanSocket(uri)
    except NoInterfaceError as error:
        raise _fail(EX_UNAVAILABLE, str(error)) from None


def serve(wire: CanHub | CanSocket, stand: Stand, go_on: Callable[[int], bool]) -> None:
    """Run a tick every 10 ms of the wall clock until `go_on(now_ns)` is false; late ticks are caught up."""
    begun_ns, now_ns = time.monotonic_ns(), 0
    while go_on(now_ns):
        now_ns += TICK_NS
        while (left_ns := begun_ns + now_ns - time.monotonic_ns()) > 0:
            wire.wait(left_ns / NS)
        wire.write(stand.step(wire.read(now_ns), now_ns))


def _fail(code: int, text: str) -> typer.Exit:
    typer.echo(visible_lines(f"hil can: {text}"), err=True)
    return typer.Exit(code)


class _Status:
    """Status display: a live line on a terminal, a JSON object a second for programs."""

    def __init__(self, as_json: bool) -> None:
        self._json, self._shown_s = as_json, -1
        self._console = Console(stderr=True)
        self._live = Live(console=self._console, auto_refresh=False, transient=True)

    def __enter__(self) -> _Status:
        self._live.__enter__()
        return self

    def __exit__(self, *caught: object) -> None:
        self._live.stop()

    def go_on(self, wire: CanHub | CanSocket, stand: Stand, now_ns: int, seconds: float) -> bool:
        """Show the status if due; False when the time is over."""
        if now_ns // NS > self._shown_s:
            self._shown_s = now_ns // NS
            rates = [round(drive.rate_radps, 2) for drive in stand.nodes.drives()]
            steers = [round(drive.steer_rad, 2) for drive in stand.nodes.drives()]
            clients = wire.live if isinstance(wire, CanHub) else None
            row = {
                "t_s": self._shown_s,
                "clients": clients,
                "rates_radps": rates,
                "steers_rad": steers,
                "stopped": [n.name for n in stand.nodes.all if n.latched],
            }
            if self._json:
                typer.echo(json.dumps(row))
            elif self._console.is_terminal:
                who = wire.uri if clients is None else f"{clients} clients"
                line = f"{row['t_s']:5} s  {who}  rates {rates} rad/s  angles {steers} rad"
                stopped = f"  stopped: {', '.join(row['stopped'])}" if row["stopped"] else ""
                self._live.update(Text(line + stopped, no_wrap=True, overflow="ellipsis"), refresh=True)
        return not seconds or now_ns < seconds * NS
