"""`onboard can jog`, `home`, `reset`: a bounded movement or a release, confirmed, monitored, ended with wheels off."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from onboard.bringup.can.command import EXAMPLES, URI_HELP, app, json_option, on_bus
from onboard.command_line import (
    EX_INTERRUPTED,
    EX_UNAVAILABLE,
    EX_UNHEALTHY,
    EX_USAGE,
    agreed,
    examples_of,
    fail,
    read_config,
)

if TYPE_CHECKING:
    from onboard.bringup.can.moving.jog import Jog, Phase
    from onboard.bringup.can.moving.move import Move
    from onboard.bringup.can.moving.release import Release
    from onboard.bringup.can.shell import CanShell
    from onboard.config import Config

TELL_NS = 250_000_000
HANDS = "Are the wheels off the ground and all hands away?"


def shared_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that all three commands share."""
    for option in (
        click.option("--config", "-c", "path", type=Path, metavar="FILE", help="The rover's TOML: limits and bus."),
        click.option("--set", "-s", "settings", multiple=True, help="section.key=value, over the file; repeatable."),
        click.option("--bus", "uri", metavar="URI", help=f"Instead of can.uri: {URI_HELP}"),
        click.option("--yes", is_flag=True, help="Do not ask before it moves."),
        json_option,
    ):
        command = option(command)
    return command


@app.command("jog", epilog=examples_of(EXAMPLES, "jog"))
@click.option("--wheel", type=click.IntRange(1, 4), help="1 front left, 2 rear left, 3 rear right, 4 front right.")
@click.option("--rate", type=float, metavar="RAD/S", help="Turn the wheel, positive forward; at most 2.")
@click.option("--steer", type=float, metavar="RAD", help="Steer the wheel, positive counter-clockwise from above.")
@click.option("--tilt", type=float, metavar="RAD", help="Tilt the scanner's axis, positive down; at most 1.2.")
@click.option("--for", "seconds", type=float, metavar="S", help="How long a wheel turns (2 s), or may take to arrive.")
@shared_options
def jog(
    wheel: int | None,
    rate: float | None,
    steer: float | None,
    tilt: float | None,
    seconds: float | None,
    path: Path | None,
    settings: tuple[str, ...],
    uri: str | None,
    yes: bool,
    as_json: bool,
) -> None:
    """Move one wheel or the tilt axis a little, and show its feedback. THE HARDWARE MOVES: lift the rover.

    Listens first and refuses if another computer commands the bus, an EMERGENCY_STOP is latched, or a node is
    missing, at fault or of another DBC version. Ctrl-C stops at once: zero rate, then off. Exit codes: 0 moved as
    requested, 1 it did not, 69 refused or no bus; else those of `decode`.
    """
    from onboard.bringup.can.moving import move as moves

    config = read_config(path, settings)
    try:
        if wheel and rate is not None and steer is None and tilt is None:
            asked = moves.turn(wheel, rate, 2.0 if seconds is None else seconds, config.rover)
        elif wheel and steer is not None and rate is None and tilt is None:
            asked = moves.steer(wheel, steer, moves.TIME_LIMIT_S if seconds is None else seconds, config.rover)
        elif tilt is not None and wheel is None and rate is None and steer is None:
            asked = moves.tilt(tilt, moves.TIME_LIMIT_S if seconds is None else seconds)
        else:
            raise fail(EX_USAGE, "one movement at a time: --wheel N --rate W, --wheel N --steer A, or --tilt A")
    except moves.BoundsError as error:
        raise fail(EX_USAGE, str(error)) from None
    _run(asked, config, uri or config.can.uri, yes, as_json)


@app.command("home", epilog=examples_of(EXAMPLES, "home"))
@shared_options
def home(path: Path | None, settings: tuple[str, ...], uri: str | None, yes: bool, as_json: bool) -> None:
    """Steer all wheels straight ahead and park the tilt axis level. THE HARDWARE MOVES. Refuses and stops as `jog`."""
    from onboard.bringup.can.moving import move as moves

    config = read_config(path, settings)
    _run(moves.home(), config, uri or config.can.uri, yes, as_json)


@app.command("reset", epilog=examples_of(EXAMPLES, "reset"))
@shared_options
def reset(path: Path | None, settings: tuple[str, ...], uri: str | None, yes: bool, as_json: bool) -> None:
    """Release a latched EMERGENCY_STOP by the two steps of the bus, for a bus without a flight computer.

    Exit codes: 0 released, 1 a node did not release, 69 refused or no bus; else those of `decode`.
    """
    from onboard.bringup.can.moving.jog import Phase
    from onboard.bringup.can.moving.release import Release

    config = read_config(path, settings)
    machine = Release(int.from_bytes(os.urandom(2)), config.rover, config.can)
    with on_bus(uri or config.can.uri) as shell:
        ready = _until(machine, shell, Phase.READY)
        if machine.problem:
            raise fail(EX_UNAVAILABLE, f"refused, nothing was sent: {machine.problem}")
        stopped = machine.stopped
        if not ready or not (yes or agreed(f"{', '.join(stopped)}: stopped. Is the cause gone?")):
            raise fail(EX_INTERRUPTED, "ended before anything was released")
        _flush(machine, shell)
        machine.go()
        done = _until(machine, shell, Phase.DONE)
    if machine.problem or not done:
        raise fail(EX_UNHEALTHY, machine.problem or "ended before all nodes had answered")
    print(json.dumps({"released": stopped}) if as_json else f"released: {', '.join(stopped)}")


def _run(move: Move, config: Config, uri: str, yes: bool, as_json: bool) -> None:
    from onboard.bringup.can.moving.jog import Jog, Phase

    machine = Jog(move, config.rover, config.can)
    with on_bus(uri) as shell:
        ready = _until(machine, shell, Phase.READY)
        if machine.problem:
            raise fail(EX_UNAVAILABLE, f"refused, nothing was sent: {machine.problem}")
        if not ready or not (yes or agreed(f"{move}. {HANDS}")):
            raise fail(EX_INTERRUPTED, "ended before anything moved")
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: machine.stop())
        _flush(machine, shell)
        machine.go(shell.clock.now_ns())
        _until(machine, shell, Phase.DONE, _Teller(machine, as_json))
    if machine.problem:
        raise fail(EX_UNHEALTHY, machine.problem)
    if machine.stopped:
        raise fail(EX_INTERRUPTED, "stopped by Ctrl-C; the wheels are off")


def _until(machine: Jog | Release, shell: CanShell, phase: Phase, tell: Callable[[int], None] = lambda _: None) -> bool:
    """Run ticks until the machine is in a phase, or done; return True if it is in that phase."""
    from onboard.bringup.can.moving.jog import Phase

    for now_ns, frames in shell.ticks():
        shell.write(machine.tick(frames, now_ns))
        tell(now_ns)
        if machine.phase in (phase, Phase.DONE):
            return machine.phase is phase
    return False


def _flush(machine: Jog | Release, shell: CanShell) -> None:
    """Process the frames received while the operator decided; another computer may be among their senders."""
    while frames := shell.bus.read(shell.clock.now_ns()):
        machine.tick(frames, shell.clock.now_ns())


class _Teller:
    """Progress display: feedback of the moving nodes, four times a second; in a terminal one line, rewritten."""

    def __init__(self, machine: Jog, as_json: bool) -> None:
        self._machine, self._json, self._told_ns = machine, as_json, -TELL_NS
        self._moving = sys.stdout.isatty() and not as_json

    def __call__(self, now_ns: int) -> None:
        from onboard.bringup.can.moving.jog import Phase

        done = self._machine.phase is Phase.DONE
        if now_ns - self._told_ns < TELL_NS and not done:
            return
        self._told_ns = now_ns
        if self._json:
            row = {"t_s": now_ns / 1e9, "phase": self._machine.phase.value, **facts(self._machine)}
            print(json.dumps(row), flush=True)
        else:
            end = "\n" if not self._moving else "\x1b[K\n" if done else "\x1b[K\r"
            print(f"{self._machine.phase.value:9} {words(self._machine)}", end=end, flush=True)


def facts(machine: Jog) -> dict[str, object]:
    """Feedback of the nodes that move, for programs."""
    nodes = machine.nodes
    told: dict[str, object] = {}
    for n in machine.move.wheels:
        wheel, status = nodes.wheels[n - 1], nodes.wheel_status[n - 1]
        if wheel is not None:
            told[f"WHEEL_{n}"] = {
                "steer_rad": wheel.steer_rad,
                "rate_radps": wheel.rate_radps,
                "turned_rad": machine.turned_rad(n),
                "drive_current_a": status.drive_current_a if status else None,
            }
    if machine.move.tilt_rad is not None:
        told["TILT"] = {"angle_rad": nodes.tilt_angle_rad}
    return told


def words(machine: Jog) -> str:
    """Feedback of the nodes that move, for people."""
    if len(machine.move.wheels) > 1:
        angles = " ".join(f"{wheel.steer_rad:+.3f}" if wheel else "-" for wheel in machine.nodes.wheels)
        return f"steering {angles} rad, tilt {machine.nodes.tilt_angle_rad or 0.0:+.3f} rad"
    parts = []
    for n in machine.move.wheels:
        wheel, status = machine.nodes.wheels[n - 1], machine.nodes.wheel_status[n - 1]
        if wheel is None:
            continue
        if machine.move.rate_radps[n - 1]:
            parts.append(
                f"wheel {n}: {wheel.rate_radps:+.3f} rad/s, turned {machine.turned_rad(n):+.3f} rad"
                + (f", {status.drive_current_a:+.2f} A" if status else "")
            )
        else:
            parts.append(f"wheel {n}: {wheel.steer_rad:+.3f} rad ({math.degrees(wheel.steer_rad):+.1f} deg)")
    if machine.move.tilt_rad is not None and machine.nodes.tilt_angle_rad is not None:
        parts.append(f"tilt: {machine.nodes.tilt_angle_rad:+.3f} rad")
    return "  ".join(parts)
