"""Commands `hil campaign`, `hil case`, `hil compare`."""

from __future__ import annotations

import json
import os
import shlex
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hil.run.options import (
    EX_CONFIG,
    EX_FAILED,
    EX_INTERRUPTED,
    EX_NOINPUT,
    EX_OK,
    EX_SOFTWARE,
    EX_UNAVAILABLE,
    EX_USAGE,
    fail,
    table_console,
)
from hil.run.status import Tell, status
from onboard.config import ConfigError
from protocol.visible import visible, visible_lines

if TYPE_CHECKING:  # slow to import: not for --help
    from hil.campaign.compare import Comparison
    from hil.campaign.plan import Plan
    from hil.campaign.table import CampaignFolder, Row

EX_IOERR = 74
FOLDER = Path("build/campaigns")
_FIRST_CASES = 10  # of those that a message names
CAMPAIGN_EPILOG = (
    "Examples: hil campaign first | hil campaign mine.toml --workers 4 | "
    "hil campaign mine.toml --scheduler tcp://10.0.0.5:8786"
)
CASE_EPILOG = "Examples: hil case first 7 | hil case mine.toml 17 --dry | hil watch build/campaigns/first/case-7"
COMPARE_EPILOG = (
    "Examples: hil compare build/campaigns/before build/campaigns/after | "
    "hil compare old.parquet new.parquet --junit compare.xml"
)
PlanFile = Annotated[
    str,
    typer.Argument(
        metavar="PLAN",
        help="A TOML file (docs/campaign-command.md), or a plan of the bench: first, reference.",
        autocompletion=lambda incomplete: _plan_names(incomplete),
    ),
]
OutOption = Annotated[Path | None, typer.Option(help="Folder of the campaign; default build/campaigns/NAME.")]


def campaign(
    plan: PlanFile,
    workers: Annotated[
        int, typer.Option(min=0, max=1024, help="Flights at a time on this machine; 0: one for each processor.")
    ] = 0,
    scheduler: Annotated[str, typer.Option(metavar="tcp://HOST:PORT", help="An existing dask scheduler.")] = "",
    out: OutOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="The statistics as JSON.")] = False,
    flies: Annotated[str, typer.Option(hidden=True, help="MODULE:FUNCTION that flies a case.")] = "",
) -> None:
    """Fly the cases of a plan, each in one process; then write results.parquet and report.html.

    Every case is stored as it ends. After Ctrl-C, or a power cut, the same command flies what is missing.

    Exit codes: 0 every case flown, 66 no such plan, 69 folder in use or scheduler not reachable, 70 a case could not be
    flown, 74 the results cannot be written (full disk), 78 an error in the plan, 130 Ctrl-C.
    """
    read = _read(plan)
    if workers and scheduler:
        raise fail(EX_USAGE, "--workers is for this machine, and --scheduler has workers of its own")
    folder = out or FOLDER / read.name
    with _opened(folder, read) as store:
        missing, known = store.missing(read.cases), len(store.rows)
        if known:
            _say(f"{known} cases are in {folder} already; {len(missing)} are missing")
            _say_versions(store)
        lost = _fly(store, read, missing, _Flying(workers or os.cpu_count() or 1, scheduler, flies)) if missing else []
        of = f"--campaign {shlex.quote(str(out))} " if out else ""
        _conclude(store, read, f"hil case {of}{shlex.quote(plan)}", as_json)
        if lost:
            _say("\n".join(lost))
            raise fail(EX_SOFTWARE, f"{len(lost)} cases could not be flown; the same command tries them again")


def _say_versions(store: CampaignFolder) -> None:
    """Say so if cases were flown by other sources than these."""
    from hil.campaign.case import sources_version

    others = sorted({str(row["version"]) for row in store.rows.values()} - {sources_version()})
    if others:
        _say(
            f"The stored cases were flown by {', '.join(others)}, this is {sources_version()}. "
            "To have one version only, use another folder (--out)."
        )


@dataclass(frozen=True, slots=True)
class _Flying:
    """How the cases are flown."""

    workers: int
    scheduler: str
    flies: str


def _fly(store: CampaignFolder, plan: Plan, missing: Sequence[int], how: _Flying) -> list[str]:
    """Fly cases and store their rows; return a line for each that was lost."""
    from hil.campaign.cluster import NoSchedulerError, cluster, fly_all, without_workers
    from hil.campaign.flight_process import FLIES

    lost: list[str] = []
    begun_s = time.monotonic()
    where = how.scheduler or f"{how.workers} processes of this machine"
    first = Text(f"{plan.name}: {len(missing)} cases on {where} ...")
    try:
        with status(Console(stderr=True), first) as tell, cluster(how.workers, how.scheduler) as client:
            for _ in without_workers(client):
                waited_s = time.monotonic() - begun_s
                tell(Text(f"{where} has no workers; waiting for one, {_duration(waited_s)} so far"), waited_s)
            for ended in fly_all(client, plan, missing, how.flies or FLIES):
                if ended.row is None:
                    lost.append(ended.problem)
                else:
                    store.add(ended.row)
                _tell(tell, store, plan, len(missing), len(lost), begun_s)
    except NoSchedulerError as error:
        raise fail(EX_UNAVAILABLE, f"{error}; {_stored(store, plan)}") from None
    except KeyboardInterrupt:
        store.read()
        raise fail(EX_INTERRUPTED, f"ended by Ctrl-C; {_stored(store, plan)}") from None
    return lost


def _stored(store: CampaignFolder, plan: Plan) -> str:
    flown = plan.cases - len(store.missing(plan.cases))
    return f"{flown} of {plan.cases} cases are stored in {store.path}; the same command flies the rest"


def _tell(tell: Tell, store: CampaignFolder, plan: Plan, asked: int, lost: int, begun_s: float) -> None:
    """Show how far the campaign is."""
    from hil.campaign.statistics import arrived, touched

    rows = [row for number, row in store.rows.items() if number <= plan.cases]
    left = plan.cases - len(rows) - lost
    wall_s = time.monotonic() - begun_s
    rest_s = wall_s / max(asked - left, 1) * left
    gone = f", {lost} lost" if lost else ""
    words = f"{len(rows)} of {plan.cases} flown{gone}, {sum(map(arrived, rows))} at the goal"
    touches = sum(map(touched, rows))
    tell(Text(f"{words}, {touches} with a contact; {_duration(rest_s)} left"), wall_s)


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s" if minutes else f"{rest} s"


@contextmanager
def _opened(folder: Path, plan: Plan) -> Iterator[CampaignFolder]:
    """Campaign's folder; turns what may be wrong with it into a message and an exit code."""
    from hil.campaign.table import CampaignFolder, FolderInUseError

    try:
        store = CampaignFolder(folder, plan)
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
    except FolderInUseError as error:
        raise fail(EX_UNAVAILABLE, str(error)) from None
    except OSError as error:
        raise fail(EX_IOERR, f"{folder}: {error.strerror or error}") from None
    try:
        yield store
    except OSError as error:
        raise fail(EX_IOERR, f"{store.path}: {error.strerror or error}; {_stored(store, plan)}") from None
    finally:
        store.close()


def _conclude(store: CampaignFolder, plan: Plan, command: str, as_json: bool) -> None:
    """Write table and report of the cases that are flown; show the statistics. command: flies a case again."""
    from hil.campaign.report import page, summary
    from hil.campaign.statistics import HEADLINES, failures
    from hil.campaign.table import replace_file

    rows = store.flown(plan.cases)
    if not rows:
        return
    table = store.finish(plan.cases)
    report = store.path / "report.html"
    replace_file(report, page(plan, rows, command))
    groups = failures(rows)
    if as_json:
        shares = {name: asdict(of(rows)) for name, of in HEADLINES.items()}
        told = {"table": str(table), "report": str(report), "shares": shares, "failures": [asdict(g) for g in groups]}
        print(json.dumps(told, indent=1))
        return
    print("\n".join(summary(rows)))
    for group in groups:
        print(f"{len(group.cases)} {group.outcome}: {visible(group.example)}: {_commands(command, group.cases)}")
    print(f"table: {table}\nreport: {report}")


def _commands(command: str, cases: Sequence[int]) -> str:
    more = f" and {len(cases) - 1} more" if len(cases) > 1 else ""
    return f"`{command} {cases[0]}`{more}"


def case(
    plan: PlanFile,
    number: Annotated[int, typer.Argument(min=1, metavar="N", help="Case, from 1.")],
    out: Annotated[Path | None, typer.Option(help="Folder of the flight; default build/campaigns/NAME/case-N.")] = None,
    dry: Annotated[bool, typer.Option("--dry", help="Show the drawn values only.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="The row as JSON.")] = False,
    of: Annotated[
        Path | None, typer.Option("--campaign", help="Folder of the campaign; default build/campaigns/NAME.")
    ] = None,
) -> None:
    """Fly one case of a plan again, with all records, and show its row.

    If the campaign has flown it by the same plan, the two flights are compared, hash by hash.

    Exit codes: 0 flown, and equal to the campaign's flight if there is one, 1 not equal to it, 66 no such plan or
    campaign, 74 the records cannot be written, 78 an error in the plan.
    """
    from hil.campaign.case import fly
    from hil.campaign.plan import drawn
    from hil.campaign.table import sha256_in

    read = _read(plan)
    if dry:
        _show_row(drawn(read, number), as_json)
        return
    stored = of or FOLDER / read.name
    known = sha256_in(stored)
    if of and known is None:
        raise fail(EX_NOINPUT, f"{of} holds no campaign")
    folder = out or stored / f"case-{number}"
    try:
        with Console(stderr=True).status(f"{read.name}, case {number} ..."):
            row = fly(read, number, folder)
    except OSError as error:
        raise fail(EX_IOERR, f"{folder}: {error.strerror or error}") from None
    except KeyboardInterrupt:
        raise fail(EX_INTERRUPTED, "ended by Ctrl-C") from None
    _show_row(row, as_json)
    _say(f"records: {folder}; look at them: hil watch {folder}")
    if known not in (None, read.sha256):
        _say(f"the campaign in {stored} is of another plan, not compared")
        return
    raise typer.Exit(EX_OK if _same_as_stored(stored, row) else EX_FAILED)


def _same_as_stored(folder: Path, row: Row) -> bool:
    """Compare a row with the campaign's, and say so; True if there is none."""
    from hil.campaign.table import TIMES, read_table

    try:
        stored = next((other for other in read_table(folder) if other["case_number"] == row["case_number"]), None)
    except ConfigError:
        stored = None
    if stored is None:
        return True
    differs = sorted(key for key in {*row, *stored} - TIMES - {"version"} if row.get(key) != stored.get(key))
    by = f" of version {stored['version']}" if stored["version"] != row["version"] else ""
    what = f"differs in {', '.join(differs)}" if differs else "is identical"
    _say(f"the campaign's flight{by} {what}")
    return not differs


def _show_row(row: Row, as_json: bool) -> None:
    if as_json:
        print(json.dumps(row, indent=1))
        return
    table = Table(show_header=False, box=None)
    for name, item in row.items():
        table.add_row(Text(name), Text("" if item is None else visible(str(item))))
    table_console().print(table)


def compare(
    before: Annotated[Path, typer.Argument(metavar="A", help="Folder or results.parquet of the earlier campaign.")],
    after: Annotated[Path, typer.Argument(metavar="B", help="That of the later one.")],
    as_json: Annotated[bool, typer.Option("--json", help="As JSON.")] = False,
    junit: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write JUnit's XML: a test for each figure.")
    ] = None,
    alpha: Annotated[float, typer.Option(min=1e-9, max=0.5, help="Probability of any wrong verdict.")] = 0.05,
) -> None:
    """Compare two campaigns case by case: which figures are better, the same or worse from A to B.

    Exit codes: 0 nothing is worse, 1 a figure is worse, 65 no case is in both, 66 no such campaign, 74 FILE cannot be
    written.
    """
    from hil.campaign.compare import compare as compare_rows
    from hil.campaign.compare import junit as junit_of
    from hil.campaign.table import read_table

    try:
        tables = read_table(before), read_table(after)
    except ConfigError as error:
        raise fail(EX_NOINPUT, str(error)) from None
    found = compare_rows(*tables, alpha)
    if not found.pairs:
        raise fail(65, f"{before} and {after} have no case with the same number and seed")
    if junit:
        try:
            junit.write_text(junit_of(found, f"{before} to {after}"), encoding="utf-8")
        except OSError as error:
            raise fail(EX_IOERR, f"{junit}: {error.strerror or error}") from None
    print(json.dumps(asdict(found), indent=1)) if as_json else _show(found, before, after)
    raise typer.Exit(EX_FAILED if found.worse else EX_OK)


def _show(found: Comparison, before: Path, after: Path) -> None:
    """Print a comparison, and the cases that changed sides."""
    from hil.campaign.compare import FIGURES

    console = table_console()
    without = f"; {found.unpaired} cases without a pair" if found.unpaired else ""
    print(f"{before} to {after}: {found.pairs} pairs{without}")
    table = Table("figure", "verdict", "better in", "worse in", "of", "p", box=None)
    colours = {"better": "green", "worse": "red", "same": ""}
    for change in found.changes:
        verdict = Text(change.verdict, style=colours[change.verdict])
        cells = (str(len(change.better)), str(len(change.worse)), str(change.pairs), f"{change.p:.3g}")
        table.add_row(Text(FIGURES[change.name].means), verdict, *cells)
    console.print(table)
    for change in found.changes:
        if change.is_count:
            _sides(f"{FIGURES[change.name].means}, in A only", change.better)
            _sides(f"{FIGURES[change.name].means}, in B only", change.worse)


def _sides(what: str, cases: Sequence[int]) -> None:
    if cases:
        more = f" and {len(cases) - _FIRST_CASES} more" if len(cases) > _FIRST_CASES else ""
        print(f"{what}: cases {', '.join(map(str, cases[:_FIRST_CASES]))}{more}")


def _plan_names(incomplete: str) -> list[str]:
    from hil.campaign.plan import plan_names

    return plan_names(incomplete)


def _read(name: str) -> Plan:
    from hil.campaign.plan import check_cases, find_plan, load_plan

    try:
        plan = load_plan(find_plan(name))
        check_cases(plan)
        return plan
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError):
        raise fail(EX_NOINPUT, f"no plan {name}; the bench's own are {', '.join(_plan_names(''))}") from None
    except OSError as error:
        raise fail(EX_NOINPUT, f"{name}: {error.strerror or error}") from None
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None


def _say(text: str) -> None:
    Console(stderr=True).print(Text(visible_lines(text)), soft_wrap=True)
