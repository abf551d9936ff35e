"""Common parts of the commands that run the rover: progress, exit codes, the run and its output files."""

from __future__ import annotations

import fcntl
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hil.devices.can.socket import NoInterfaceError
from hil.run import demo as after
from hil.run.folder import check
from hil.run.status import status
from hil.scenarios.model import Scenario
from hil.view.doing import Doing
from hil.world.contacts import Contact, lines
from onboard.config import ConfigError
from protocol.visible import visible_lines

if TYPE_CHECKING:
    from hil.run.run import RunResult
    from hil.world.world import Progress

SHOWN = {  # key of summary.json: its name and unit for people
    "goal_reached": ("goal reached", ""),
    "outcome": ("the rover's word", ""),
    "distance_to_goal_m": ("true distance to the goal", "m"),
    "collisions": ("contacts", ""),
    "scans": ("scans", ""),
    "replans": ("changes of the global path", ""),
    "way_m": ("driven", "m"),
    "bench_s": ("time of the bench", "s"),
    "rtf": ("times real time", ""),
    "replay": ("replay", ""),
    "link_datagrams": ("datagrams sent", ""),
    "link_lost": ("datagrams lost", ""),
    "onboard_peak_rss_mb": ("largest memory of onboard", "MB"),
}
EX_OK, EX_FAILED, EX_USAGE, EX_INTERRUPTED = 0, 1, 64, 130
_PIPE_COLUMNS = 400
_DOING_COLUMNS = 20  # `AUTONOMOUS scanning`
EX_DATA, EX_NOINPUT, EX_UNAVAILABLE, EX_SOFTWARE, EX_CONFIG = 65, 66, 69, 70, 78


def table_console() -> Console:
    """Console for tables: as wide as the terminal; in a pipe so wide that each row is one line, for `grep`."""
    return Console() if sys.stdout.isatty() else Console(width=_PIPE_COLUMNS)


def fail(code: int, text: str) -> typer.Exit:
    """Print one line on standard error and return the exit with this code."""
    print(visible_lines(f"hil: {text}"), file=sys.stderr)
    return typer.Exit(code)


def line(progress: Progress, wall_s: float, live: bool = False, said: str = "") -> Text:
    """Live progress line; with a live operator the bench does not know the goal.

    said: the flight program's own mode and phase; "": not known, so the line says what the body does.
    """
    doing = said or _seen(progress)
    rtf = progress.now_s / wall_s if wall_s > 0 else 0.0
    link = f"link {progress.link.get('received', 0)}/{progress.link.get('sent', 0)}" if progress.link else ""
    contacts = f"  contacts {len(progress.contacts)}" if progress.contacts else ""
    width = _DOING_COLUMNS if said else 8
    return Text(
        f"{progress.now_s:6.1f} s  x{rtf:4.1f}  {doing:{width}}  scan {progress.sweeps:2d}  "
        f"driven {progress.way_m:4.1f} m  "
        + ("" if live else f"to go {progress.distance_to_goal_m:5.2f} m  ")
        + link
        + contacts
    )


def _seen(progress: Progress) -> str:
    """Motion and contacts of the rover's body by the bench's truth."""
    if progress.sweeping:
        return "scanning"
    return "driving" if progress.driving else "turning" if progress.turning else "standing"


class Watch:
    """Display of a run's progress; prints each contact once, when it begins.

    folder: of the run, whose record tells mode and phase; None: not shown
    contacts: contacts of the run so far
    """

    def __init__(self, live: bool, folder: Path | None = None) -> None:
        self._live, self._console, self._shown = live, Console(stderr=True), 0
        self._doing = Doing(folder) if folder else None
        self.contacts: Sequence[Contact] = ()

    @contextmanager
    def showing(self, first: str) -> Iterator[Callable[[Progress, float], None]]:
        """Yield the function that a run calls with its progress and the wall time since its start, s."""
        with status(self._console, Text(first)) as tell:

            def show(progress: Progress, wall_s: float) -> None:
                self.contacts = progress.contacts
                for contact in self.contacts[self._shown :]:
                    text = f"contact at {contact.begin_s:.1f} s: {contact.what} at {contact.place}"
                    self._console.print(Text(text), soft_wrap=True)
                self._shown = len(self.contacts)
                said = self._doing.words() if self._doing else ""
                tell(line(progress, wall_s, self._live, said), wall_s)

            yield show


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Lock the folder for one bench: two benches would overwrite each other's records and station file.

    Raises ConfigError if a run may not use the folder; exits with EX_UNAVAILABLE if another bench uses it.
    """
    check(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            told = f"{folder} is in use by another bench: end that one, or name another folder with --out"
            raise fail(EX_UNAVAILABLE, told) from None
        yield


@contextmanager
def _told(folder: Path, watch: Watch) -> Iterator[None]:
    """Lock the folder for this run; turn Ctrl-C and user errors into a message and an exit code."""
    try:
        with _alone(folder):
            yield
    except KeyboardInterrupt:
        words = ["ended by Ctrl-C; all processes are gone", *lines(watch.contacts), *_left(folder)]
        raise fail(EX_INTERRUPTED, "\n".join(words)) from None
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
    except NoInterfaceError as error:
        raise fail(EX_UNAVAILABLE, str(error)) from None


def _left(folder: Path) -> list[str]:
    """Files that an interrupted run leaves, and the command that makes its report."""
    record = folder / "onboard.mcap"
    return [f"record: {record}", f"report: .venv/bin/ground report {folder}"] if record.is_file() else []


def write_report(folder: Path) -> None:
    """Write the report of a run that Ctrl-C has ended and print its path; a failure is one line, the record is kept."""
    if not (folder / "onboard.mcap").is_file():
        return
    with waiting(folder, "writing the report; Ctrl-C leaves it out ..."):
        problem = after.report(folder)
    if problem:
        print(visible_lines(f"hil: the report failed: {problem.splitlines()[-1]}"), file=sys.stderr)
    else:
        print(f"report: {folder / 'report.html'}")


def fly(scenario: Scenario, out: Path, pace: float = 0.0, onboard_python: str = "") -> RunResult:
    """Run with its status on standard error; on Ctrl-C end all processes and exit 130."""
    from hil.run.run import run as run_scenario  # the engine is slow to import: not for --help and `hil link`

    watch = Watch(scenario.live, out)
    with _told(out, watch), watch.showing("starting bench, onboard, link and ground ...") as show:
        return run_scenario(scenario, out, show, pace=pace, onboard_python=onboard_python)


def fly_mixed(scenario: Scenario, out: Path, lidar: str, can: str) -> None:
    """Run with real devices until Ctrl-C, which is the normal end."""
    from hil.processes import ProcessDiedError
    from hil.run.realtime import Real
    from hil.run.realtime import fly as fly_beside

    watch = Watch(live=True, folder=out)
    try:
        with _told(out, watch), watch.showing("starting bench, onboard and link ...") as show:
            fly_beside(scenario, out, Real(lidar, can), show)
    except typer.Exit as ended:
        if ended.exit_code != EX_INTERRUPTED:
            raise
    except ProcessDiedError as died:
        raise fail(EX_SOFTWARE, str(died)) from None


@contextmanager
def waiting(folder: Path, text: str) -> Iterator[None]:
    """Show what the command does after the flight; at Ctrl-C print the files of the run and exit 130."""
    try:
        with status(Console(stderr=True), Text(text)):
            yield
    except KeyboardInterrupt:
        raise fail(EX_INTERRUPTED, "\n".join(["ended by Ctrl-C after the flight", *_left(folder)])) from None


def conclude(scenario: Scenario, result: RunResult) -> dict[str, Any]:
    """Replay a run, write its summary and certificate next to its record, and return the summary."""
    with waiting(result.folder, "replaying the record ..."):
        replay = after.replay(result.folder)
    facts = after.summary(scenario, result, replay)
    facts["replay_difference"] = replay.get("first_difference", "")
    (result.folder / "summary.json").write_text(json.dumps(facts, indent=2) + "\n")
    certificate = after.certificate(scenario, result)
    (result.folder / "certificate.json").write_text(json.dumps(certificate, indent=2) + "\n")
    return facts


def show(facts: dict[str, Any], contacts: Sequence[Contact]) -> None:
    """Print the summary's main figures and each contact."""
    table = Table(show_header=False, box=None)
    for key, (name, unit) in SHOWN.items():
        value = facts[key] if not isinstance(facts[key], bool) else "yes" if facts[key] else "no"
        table.add_row(name, f"{value} {unit}".rstrip())
    table.add_row("scanner", after.scanner_line(facts["scanner"]))
    table_console().print(table)
    print("\n".join(lines(contacts)))
