"""Commands `hil run`, `hil list`, `hil explain`: scenarios by name or file."""

from __future__ import annotations

import difflib
import json
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hil.devices.lidar.errors import lidar_table
from hil.plant.rays.casters import CASTERS
from hil.run.options import (
    EX_CONFIG,
    EX_FAILED,
    EX_NOINPUT,
    EX_OK,
    EX_SOFTWARE,
    conclude,
    fail,
    fly,
    show,
    table_console,
)
from hil.scenarios.model import Scenario, load_scenario, paths_in
from hil.view.command import PORT, AfterOption, PortOption, WatchOption, check_film, film, shown
from hil.world.contacts import lines
from onboard.config import ConfigError, load, parse_override
from protocol.visible import visible

Name = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="A name of `hil list`, or a TOML file.",
        autocompletion=lambda incomplete: _names(incomplete),
    ),
]
LidarOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=VALUE",
        help="Of the scanner, over the scenario's [lidar] (docs/sensors.md); or a profile: ideal.",
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Of the flight program, over the scenario's [set]; paths from this folder.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="As JSON.")]


def run(
    scenario: Name,
    out: Annotated[Path | None, typer.Option(help="Folder of the run; default build/runs/NAME.")] = None,
    can: Annotated[str, typer.Option(help="CAN bus in place of the scenario's: hub, socketcan:INTERFACE.")] = "",
    rays: Annotated[str, typer.Option(help="Who casts the scanner's rays: kernel, engine, embree.")] = "",
    lidar: LidarOption = None,
    settings: SetOption = None,
    onboard_python: Annotated[str, typer.Option(help="Python that runs the flight program; default this one.")] = "",
    quick: Annotated[bool, typer.Option("--quick", help="In one process, beside a twin without each fault.")] = False,
    watch: WatchOption = False,
    port: PortOption = PORT,
    video: AfterOption = None,
) -> None:
    """Run a scenario and judge it: bench, onboard, link and ground in lock-step.

    --quick runs bench and flight program in one process without link and ground, and reports when each fault showed.

    Exit codes: 0 every promise kept, 1 a promise broken (it is named), 64 no such caster or film, 66 no such file or
    Python, 69 no such CAN interface or port in use, 70 a process failed, 78 an error in the scenario.
    """
    read = _read(scenario)
    if rays and rays not in CASTERS:
        raise fail(64, f"--rays {rays!r} should be one of {', '.join(CASTERS)}")
    scanned = scanner(lidar, read.lidar)
    told = {**read.set, **told_settings(settings or ())}
    read = replace(read, can=can or read.can, rays=rays or read.rays, lidar=scanned, set=told)
    _refuse_what_cannot_be(read, quick)
    if quick:
        if watch or video:
            raise fail(64, "--watch and --video show a run's records, and --quick keeps none")
        if onboard_python:
            raise fail(64, "--onboard-python needs a process, and --quick flies in this one")
        _quick(read)
        return
    if onboard_python and shutil.which(onboard_python) is None:
        raise fail(EX_NOINPUT, f"--onboard-python {onboard_python!r}: no program there that may be run")
    check_film(video)
    folder = out or Path("build/runs") / read.name
    with shown(folder, watch, port):
        result = fly(read, folder, onboard_python=onboard_python)
        if result.error:
            raise fail(EX_SOFTWARE, f"after {result.bench_s:.1f} s of bench time: {result.error}")
        facts = conclude(read, result)
        show(facts, result.contacts)
        verdicts: Any = facts["verdicts"]
        _tell(verdicts)
        print(f"files of the run: {folder}")
        if video:
            film(folder, video)
    raise typer.Exit(EX_OK if all(verdict["holds"] for verdict in verdicts) else EX_FAILED)


def _refuse_what_cannot_be(scenario: Scenario, quick: bool) -> None:
    from hil.faults.injection import causes  # the engine is slow to import

    try:
        known = causes(scenario.faults)
    except ConfigError as error:
        raise fail(EX_CONFIG, f"{scenario.name}: {error}") from None
    for fault, cause in zip(scenario.faults, known, strict=True):
        if cause.quick_only and not quick:
            why = "needs --quick; over sockets the bench waits for jobs"
            raise fail(EX_CONFIG, f"{scenario.name}: {fault.fault} {why}")
        if cause.never_quick and quick:
            raise fail(EX_CONFIG, f"{scenario.name}: {fault.fault} needs processes; run it without --quick")


def _quick(scenario: Scenario) -> None:
    from hil.run.judged import Twins  # the engine is slow to import: not for --help
    from hil.run.judged import fly as fly_quickly

    twins = Twins()
    with Console(stderr=True).status(f"{scenario.name} ..."):
        flown = fly_quickly(scenario, twins)
    twins.free()
    _tell([verdict._asdict() for verdict in flown.verdicts])
    print("\n".join(lines(flown.facts.contacts)))
    raise typer.Exit(EX_OK if all(verdict.holds for verdict in flown.verdicts) else EX_FAILED)


def scanner(words: list[str] | None, table: Mapping[str, Any]) -> Mapping[str, Any]:
    """Scenario's table [lidar], overridden by the words of --lidar; exit 78 on an error."""
    try:
        return lidar_table(words or (), table)
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None


def told_settings(words: Iterable[str]) -> dict[str, Any]:
    """Checked settings of the command line, paths relative to the current folder; exit 78 on an error."""
    try:
        told = dict(parse_override(word) for word in words)
        load(None, told)
        return paths_in(Path.cwd(), told)
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None


def list_scenarios(as_json: AsJson = False) -> None:
    """List the bench's own scenarios: what happens in each and how it should end."""
    from hil.scenarios.library import scenarios

    found = scenarios()
    if as_json:
        print(json.dumps([{"name": s.name, "about": s.about, **_row(s)} for s in found], indent=1))
        return
    table = Table("name", "terrain", "ends", "what happens", box=None)
    for scenario in found:
        table.add_row(scenario.name, scenario.terrain, scenario.expect.ends, scenario.about)
    table_console().print(table)
    print("more of one: hil explain NAME; fly it: hil run NAME")


def explain_scenario(scenario: Name) -> None:
    """Explain a scenario: its events and their times, the responses of the fault table, the promises."""
    from hil.scenarios.library import explain

    read = _read(scenario)
    try:
        told = list(explain(read))
    except ConfigError as error:
        raise fail(EX_CONFIG, f"{visible(scenario)}: {error}") from None
    print(f"{read.name}: " + "\n".join(map(visible, told)))


def _names(incomplete: str) -> list[str]:
    from hil.scenarios.library import names

    return names(incomplete)


def _read(name: str) -> Scenario:
    from hil.scenarios.library import find, names

    try:
        return load_scenario(find(name))
    except (FileNotFoundError, IsADirectoryError):
        near = difflib.get_close_matches(name, names(), n=1)
        hint = f"did you mean {near[0]}? All" if near else "the bench's own"
        raise fail(EX_NOINPUT, f"no scenario {name}; {hint} are in `hil list`") from None
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None


def _row(scenario: Scenario) -> dict[str, object]:
    row = {"faults": [asdict(fault) for fault in scenario.faults], "terrain": scenario.terrain}
    return {**row, "ends": scenario.expect.ends, "raises": scenario.expect.raises}


def _tell(verdicts: list[dict[str, Any]]) -> None:
    table = Table("promise", "", "found", box=None)
    for verdict in verdicts:
        kept = "[green]kept" if verdict["holds"] else "[red]broken"
        table.add_row(Text(visible(verdict["promise"])), kept, Text(visible(verdict["found"])))
    table_console().print(table)
