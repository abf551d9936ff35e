"""The command `onboard guard`."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from onboard.bus_guard.rules import BusGuard, Verdict
from onboard.command_line import EX_CONFIG, EX_UNAVAILABLE, fail, read_config
from onboard.config import ConfigError
from onboard.records import PortState

if TYPE_CHECKING:
    from onboard.drivers.can.bus import CanBus

LOOK_S = 0.01  # period of the checks when no frame arrives
EXAMPLES = """\b
Examples:
  onboard guard --bus socketcan:can0
  onboard guard --config rover.toml --json
  onboard guard --bus socketcand:127.0.0.1:29536/can0 --watch-only"""


@click.command("guard", epilog=EXAMPLES)
@click.option("--bus", metavar="URI", help="Which bus; without it can.uri of the configuration.")
@click.option("--config", "-c", type=Path, metavar="FILE", help="TOML file with the rover's limits.")
@click.option("--set", "-s", "settings", multiple=True, help="section.key=value, over the file; repeatable.")
@click.option("--watch-only", is_flag=True, help="Say what would be stopped, send nothing.")
@click.option("--json", "as_json", is_flag=True, help="One object a line, for programs.")
def app(bus: str | None, config: Path | None, settings: tuple[str, ...], watch_only: bool, as_json: bool) -> None:
    """Watch the computer's orders on the bus, in a separate process, and stop the rover if they make no sense.

    It checks rate, range, counter and checksum of every order, and that the sender of motion orders also sends its
    heartbeat and has enabled the drive. It can send EMERGENCY_STOP and nothing else; the computer's two-step reset
    releases it.

    Exit codes: 0 ended by SIGTERM or Ctrl-C, 66 no such file, 69 the bus cannot be opened or is lost, 78 something
    wrong in the configuration.
    """
    from onboard.drivers.can.bus import open_bus

    def tell(event: str, verdict: Verdict | None = None) -> None:
        print(json.dumps(_record(event, verdict)) if as_json else _line(event, verdict), flush=True)

    tree = read_config(config, settings)
    uri = bus or tree.can.uri
    try:
        port = open_bus(uri)
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
    except OSError as error:
        raise fail(EX_UNAVAILABLE, str(error)) from None
    ended = False

    def end(*_: object) -> None:
        nonlocal ended
        ended = True

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    tell(f"watching {uri}" + (", sending nothing" if watch_only else ""))
    try:
        watch(port, BusGuard(tree.rover, time.monotonic_ns()), tell, lambda: ended, send=not watch_only)
    finally:
        port.close()
    if not ended:
        raise fail(EX_UNAVAILABLE, f"{uri} is lost: the orders to the wheels are not monitored now")


def watch(
    bus: CanBus,
    guard: BusGuard,
    tell: Callable[[str, Verdict | None], None],
    ended: Callable[[], bool],
    *,
    send: bool = True,
    now_ns: Callable[[], int] = time.monotonic_ns,
) -> None:
    """Run until `ended` or the bus closes; report each latched offence and each release."""
    from onboard.drivers.platform.clock import wait_for

    told = guard.verdict
    while not ended() and bus.state is not PortState.CLOSED:
        wait_for(bus.fileno(), LOOK_S)
        now = now_ns()
        frames = guard.step(now, bus.read(now))
        if send:
            bus.write(frames)
        if guard.verdict != told:
            told = guard.verdict
            tell("released" if told is None else "STOP", told)


def _record(event: str, verdict: Verdict | None) -> dict[str, object]:
    if verdict is None:
        return {"event": event}
    return {"event": event, "offence": verdict.offence.name, "can_id": verdict.can_id, "text": verdict.text}


def _line(event: str, verdict: Verdict | None) -> str:
    return f"guard: {event}" if verdict is None else f"guard: {event}: {verdict.offence.name}: {verdict.text}"
