"""The commands `onboard can ...`: a bus without the flight program, by its own codec, checks and node code."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.exceptions import Exit

from onboard.command_line import (
    EX_CONFIG,
    EX_DATAERR,
    EX_NOINPUT,
    EX_UNAVAILABLE,
    EX_UNHEALTHY,
    EX_USAGE,
    examples_of,
    fail,
)
from onboard.config import Can

if TYPE_CHECKING:
    from onboard.bringup.can.candump import ReceivedFrame
    from onboard.bringup.can.shell import CanShell

URI_HELP = "socketcan:IF, socketcand:HOST:PORT/BUS or virtual:NAME."
URI_KINDS = ("socketcan", "socketcand", "virtual")
EXAMPLES = """\b
Examples:
  onboard can info --bus socketcan:can0
  onboard can watch --only 'WHEEL_*_FEEDBACK'
  candump -L can0 | onboard can decode - --node TILT
  onboard can decode rover.log --errors
  onboard can load
  onboard can jog --wheel 2 --rate 0.5 --for 2
  onboard can home
  onboard can reset"""

bus_option = click.option("--bus", "uri", metavar="URI", default=Can().uri, show_default=True, help=URI_HELP)
json_option = click.option("--json", "as_json", is_flag=True, help="For programs.")
only_option = click.option("--only", multiple=True, metavar="FRAME", help="WHEEL_1_STATUS, WHEEL_*, 0x1a1; repeatable.")
node_option = click.option("--node", "nodes", multiple=True, metavar="NODE", help="Of this sender only; repeatable.")


@click.group("can", epilog=EXAMPLES)
def app() -> None:
    """A CAN bus without the flight program: its nodes, their frames and its load; and the wheels moved one by one."""


@app.command("decode", epilog=examples_of(EXAMPLES, "decode"))
@click.argument("file", required=False)
@click.option("--bus", "uri", metavar="URI", help=f"Listen to a bus instead: {URI_HELP}")
@only_option
@node_option
@click.option("--errors", is_flag=True, help="Only what is wrong, and a table of it at the end.")
@click.option("--seconds", type=click.FloatRange(min=0), default=0.0, help="Of a bus: how long; 0: until Ctrl-C.")
@json_option
def decode_command(
    file: str | None,
    uri: str | None,
    only: tuple[str, ...],
    nodes: tuple[str, ...],
    errors: bool,
    seconds: float,
    as_json: bool,
) -> None:
    """Show frames as named signals, a line each; FILE: candump (-L or not), .asc, .blf, or - for standard input.

    Each frame is checked as in flight: CRC, alive counter (lost, repeated), range, lateness.

    Exit codes of all commands: 0 done, 1 something is wrong with the bus or the hardware, 64 no such frame, node or
    bound, 65 no log of a CAN bus, 66 no such file, 69 the bus cannot be opened, 78 the URI or the configuration is
    wrong, 130 Ctrl-C.
    """
    from onboard.bringup.can.decode import Decoder
    from onboard.bringup.can.show import line_of, row_of, summary_lines, summary_row

    if (file is None) == (uri is None):
        raise fail(EX_USAGE, "give a log file, - for standard input, or --bus URI")
    if file is not None and file.partition(":")[0] in URI_KINDS and not Path(file).exists():
        raise fail(EX_USAGE, f"{file} is a bus, no file: onboard can decode --bus {file}")
    chosen = chosen_frames(only, nodes)
    decoder = Decoder()

    def show(heard: Iterable[ReceivedFrame]) -> None:
        for one in heard:
            seen = decoder.receive(one)
            wanted = seen.can_id in chosen if seen.node else not (only or nodes)
            if wanted and (seen.problems or not errors):
                print(json.dumps(row_of(seen)) if as_json else line_of(seen), flush=uri is not None)

    if uri is not None:
        with on_bus(uri) as shell:
            show(_live(shell, seconds))
    else:
        _from_file(str(file), show)
    if errors:
        named = [tally for tally in decoder.tallies() if tally.can_id in chosen]
        others = {} if only or nodes else dict(decoder.others)
        print(json.dumps(summary_row(named, others)) if as_json else "\n".join(summary_lines(named, others)))


@app.command("info", epilog=examples_of(EXAMPLES, "info"))
@bus_option
@click.option("--seconds", type=click.FloatRange(0.1, 600), default=2.0, show_default=True, help="How long to listen.")
@json_option
def info_command(uri: str, seconds: float, as_json: bool) -> None:
    """Listen for 2 s without sending: list the nodes and their state; report each problem, and what to do.

    Exit code 1: something is wrong.
    """
    from onboard.bringup.can.report import lines_of
    from onboard.bringup.can.survey import Survey

    survey = Survey()
    with on_bus(uri) as shell:
        heard_ns = 1
        for now_ns, frames in shell.ticks(seconds):
            survey.receive(frames)
            heard_ns = now_ns
        report = survey.report(heard_ns / 1e9, shell.bus.error_frames)
    print(json.dumps(report.as_dict()) if as_json else "\n".join(lines_of(report)))
    if report.findings:
        raise Exit(EX_UNHEALTHY)


@app.command("watch", epilog=examples_of(EXAMPLES, "watch"))
@bus_option
@only_option
@node_option
@click.option("--seconds", type=click.FloatRange(min=0), default=0.0, help="How long; 0: until Ctrl-C.")
@json_option
def watch_command(uri: str, only: tuple[str, ...], nodes: tuple[str, ...], seconds: float, as_json: bool) -> None:
    """Show the newest signals of every frame as they change; once a second if the output is no terminal."""
    from onboard.bringup.can.live import Screen

    chosen = chosen_frames(only, nodes)
    with on_bus(uri) as shell, Screen(chosen, as_json) as screen:
        for now_ns, frames in shell.ticks(seconds):
            screen.show(frames, now_ns)


@app.command("load", epilog=examples_of(EXAMPLES, "load"))
@json_option
def load_command(as_json: bool) -> None:
    """Print load and worst-case response times of the bus, computed from rover.dbc, for three cases."""
    from onboard.bringup.can.load import Case, analyse
    from onboard.bringup.can.report import load_lines

    if as_json:
        print(json.dumps({case.value: [row._asdict() for row in analyse(case)] for case in Case}))
        return
    for case in Case:
        print("\n".join((*load_lines(case, analyse(case)), "")))


def chosen_frames(only: tuple[str, ...], nodes: tuple[str, ...]) -> frozenset[int]:
    """The ids selected by --only and --node, or exit 64."""
    from onboard.bringup.can.names import UnknownNameError, frames_of

    try:
        return frames_of(only, nodes)
    except UnknownNameError as error:
        raise fail(EX_USAGE, str(error)) from None


@contextmanager
def on_bus(uri: str) -> Iterator[CanShell]:
    """The open bus; Ctrl-C ends its ticks. A bus error becomes one line and an exit code."""
    from onboard.bringup.can.shell import BusError, CanShell
    from onboard.config import ConfigError
    from onboard.drivers.platform.clock import WallClock

    clock = WallClock()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: setattr(clock, "stopping", True))
    try:
        with CanShell(uri, clock) as shell:
            yield shell
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
    except BrokenPipeError:
        raise
    except (BusError, OSError) as error:
        raise fail(EX_UNAVAILABLE, str(error)) from None


def _live(shell: CanShell, seconds: float) -> Iterator[ReceivedFrame]:
    from onboard.bringup.can.candump import ReceivedFrame

    errors = 0
    for now_ns, frames in shell.ticks(seconds):
        yield from (ReceivedFrame(frame.stamp_ns, frame.can_id, frame.data) for frame in frames)
        yield from (
            ReceivedFrame(now_ns, 0x20000000, b"", "error frame") for _ in range(shell.bus.error_frames - errors)
        )
        errors = shell.bus.error_frames


def _from_file(name: str, show: Callable[[Iterable[ReceivedFrame]], None]) -> None:
    """Show the frames of a file or of standard input; Ctrl-C in a pipe ends the reading, not the summary after it."""
    from onboard.bringup.can.logs import NoLogError, heard_in, heard_of

    def tell(text: str) -> None:
        print(f"onboard: {text}", file=sys.stderr)

    try:
        if name == "-":
            show(heard_of(sys.stdin, "standard input", tell))
        else:
            show(heard_in(Path(name), tell))
    except KeyboardInterrupt:
        if name != "-":
            raise
    except NoLogError as error:
        raise fail(EX_DATAERR, str(error)) from None
    except ValueError as error:
        raise fail(EX_DATAERR, f"{name} is damaged: {error}") from None
    except BrokenPipeError:
        raise
    except OSError as error:
        raise fail(EX_NOINPUT, f"{name} cannot be read: {error.strerror}") from None
