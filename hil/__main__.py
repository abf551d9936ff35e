"""Command line `hil` of the bench."""

from __future__ import annotations

from onboard import quiet_start  # first, before what takes long to load

# isort: split
import json
import signal
from importlib.metadata import version as package_version
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from hil.campaign import command as campaign_command
from hil.devices.can.command import EPILOG as CAN_EPILOG
from hil.devices.can.command import main as can_command
from hil.devices.lidar.command import EPILOG as LIDAR_EPILOG
from hil.devices.lidar.command import main as lidar_command
from hil.link.command import EPILOG as LINK_EPILOG
from hil.link.command import main as link_command
from hil.run import demo as after
from hil.run import scenario_command
from hil.run.options import (
    EX_CONFIG,
    EX_FAILED,
    EX_INTERRUPTED,
    EX_NOINPUT,
    EX_OK,
    EX_SOFTWARE,
    EX_USAGE,
    conclude,
    fail,
    fly,
    fly_mixed,
    show,
    table_console,
    waiting,
    write_report,
)
from hil.run.verify_command import verify
from hil.scenarios.model import Scenario
from hil.view.command import EPILOG as WATCH_EPILOG
from hil.view.command import PORT, AfterOption, PortOption, WatchOption, check_film, film, shown
from hil.view.command import main as watch_command
from onboard.config import ConfigError, load

DEMO_LIMIT_S = 3600.0  # the longest demo, 56 m over measured land, takes 1,600 s
_CLICK_USAGE = 2  # of click, for an unknown option or a missing argument; ours are those of sysexits.h
TALLIED = (
    "terrain",
    "seed",
    "goal_reached",
    "distance_to_goal_m",
    "collisions",
    "scans",
    "way_m",
    "rtf",
    "replay",
)

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="The hardware-in-the-loop bench.\n\nExamples:\n\n"
    "  hil demo --seed 3\n\n  hil list\n\n  hil run lidar_unplugged\n\n  hil link --profile moon-bad\n\n"
    "  hil lidar --profile utm-30lx --pty\n\n  hil can --fault silent=WHEEL_3\n\n  hil watch build/demo\n\n"
    "  hil campaign first\n\n  hil case first 7\n\n  hil compare build/campaigns/a build/campaigns/b",
)
app.command("link", epilog=LINK_EPILOG)(link_command)
app.command("lidar", epilog=LIDAR_EPILOG)(lidar_command)
app.command("can", epilog=CAN_EPILOG)(can_command)
app.command("run")(scenario_command.run)
app.command("list")(scenario_command.list_scenarios)
app.command("explain")(scenario_command.explain_scenario)
app.command("verify")(verify)
app.command("campaign", epilog=campaign_command.CAMPAIGN_EPILOG)(campaign_command.campaign)
app.command("case", epilog=campaign_command.CASE_EPILOG)(campaign_command.case)
app.command("compare", epilog=campaign_command.COMPARE_EPILOG)(campaign_command.compare)
app.command("watch", epilog=WATCH_EPILOG)(watch_command)


def _show_version(asked: bool) -> None:
    if asked:
        print(f"hil {package_version('el-dorado')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Take the options that stand before a command's name."""


SeedOption = Annotated[int, typer.Option(min=1, help="The n-th accepted field.")]
StrategyOption = Annotated[str, typer.Option(help="Next stop by optimistic, explore, visibility or hill-climb.")]
LidarOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=VALUE",
        help="Of the scanner, as in [lidar] (docs/sensors.md); or a profile: ideal. May be repeated.",
    ),
]
TerrainOption = Annotated[
    str,
    typer.Option(
        autocompletion=lambda: list(after.TOLERANCE_M),
        help="fbm: 20 m fractal field, craters: with them, real: DEM, flat.",
    ),
]


@app.command()
def demo(
    seed: SeedOption = 1,
    terrain: TerrainOption = "fbm",
    out: Annotated[Path, typer.Option(help="Folder of the run.")] = Path("build/demo"),
    strategy: StrategyOption = "optimistic",
    lidar: LidarOption = None,
    watch: WatchOption = False,
    port: PortOption = PORT,
    video: AfterOption = None,
) -> None:
    """Drive a rover across rocks to its goal; ends with the path of the report.

    Exit codes: 0 goal reached, 1 goal not reached (with the reason), 64 unknown kind of film, 69 port in use,
    70 a process of the run failed, 78 an error in --lidar.

    Examples: hil demo --seed 3 | hil demo --lidar ideal | hil demo --lidar lost_ratio=0.03 --lidar rock_albedo=0.05
    """
    told = {"mission.strategy": strategy}
    scenario = Scenario(
        terrain=_terrain(terrain), seed=seed, limit_s=DEMO_LIMIT_S, set=told, lidar=scenario_command.scanner(lidar, {})
    )
    check_film(video)
    with shown(out, watch, port):
        result = fly(scenario, out)
        if result.error:
            raise fail(EX_SOFTWARE, f"after {result.bench_s:.1f} s of bench time: {result.error}")
        facts = conclude(scenario, result)
        with waiting(out, "writing the report ..."):
            problem = after.report(out)
        show(facts, result.contacts)
        if problem:
            raise fail(EX_SOFTWARE, f"the report failed:\n{problem}")
        print(f"report: {out / 'report.html'}")
        if video:
            film(out, video)
    raise typer.Exit(EX_OK if facts["goal_reached"] and facts["replay"] == "identical" else EX_FAILED)


def _terrain(name: str) -> str:
    if name not in after.TOLERANCE_M:
        raise fail(64, f"--terrain {name!r} should be one of {', '.join(after.TOLERANCE_M)}")
    return name


@app.command()
def sim(
    seed: SeedOption = 1,
    terrain: TerrainOption = "fbm",
    out: Annotated[Path, typer.Option(help="Folder of the run.")] = Path("build/sim"),
    lidar: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ADDRESS or KEY=VALUE",
            help="A real scanner, tty:/dev/ttyACM0 or tcp:HOST:PORT; or of the emulated one, as for `hil demo`.",
        ),
    ] = None,
    can: Annotated[str, typer.Option(help="The real nodes: socketcan:can0.")] = "",
    watch: WatchOption = False,
    port: PortOption = PORT,
) -> None:
    """Run bench, onboard and link in real time until Ctrl-C, for `ground` commands from another terminal.

    Ctrl-C ends it with the report of the run; a second Ctrl-C leaves the report out.

    With --lidar ADDRESS or --can that device is real and the others are emulated; the run is not in lock-step then.

    Exit codes: 0 ended by Ctrl-C, 69 port in use or no such interface, 70 a process failed, 78 an error in --lidar.
    """
    real, words = _real(lidar or [])
    scanner = scenario_command.scanner(words, {})
    scenario = Scenario(name="sim", terrain=_terrain(terrain), seed=seed, limit_s=1e6, live=True, lidar=scanner)
    station = f" --station {out / 'ground.toml'}" if out != Path("build/sim") else ""
    print(
        "ready in a few seconds; from another terminal, in this folder:\n"
        f"  .venv/bin/ground status{station}\n  .venv/bin/ground goto 8 3{station}\n"
        f"  .venv/bin/ground stop{station}\n"
        "Ctrl-C ends it."
    )
    if real or can:
        with shown(out, watch, port):
            fly_mixed(scenario, out, real, can)
        write_report(out)
        return
    try:
        with shown(out, watch, port):
            result = fly(scenario, out, pace=1.0)
    except typer.Exit as ended:
        if ended.exit_code != EX_INTERRUPTED:
            raise
        write_report(out)
        return
    if result.error:
        raise fail(EX_SOFTWARE, f"after {result.bench_s:.1f} s of bench time: {result.error}")


def _real(words: list[str]) -> tuple[str, list[str]]:
    """Split the values of --lidar into a real scanner's address and other words. Exit 64 for both, or two addresses."""
    addresses = [word for word in words if word.startswith(("tty:", "tcp:"))]
    others = [word for word in words if word not in addresses]
    if len(addresses) > 1 or (addresses and others):
        raise fail(64, f"--lidar {' '.join(words)}: one real scanner, or keys of the emulated one")
    return "".join(addresses), others


@app.command()
def urdf(
    config: Annotated[Path | None, typer.Option(help="Rover's configuration (TOML); default: the bench's own.")] = None,
) -> None:
    """Print the rover's URDF on standard output, for RViz and other ROS tools: hil urdf > rover.urdf.

    Exit codes: 0 written, 66 no such file, 78 an error in the configuration.
    """
    from hil.plant.ros_urdf import ros_urdf

    try:
        print(ros_urdf(load(config).rover), end="")
    except FileNotFoundError:
        raise fail(EX_NOINPUT, f"no configuration {config}") from None
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None


@app.command()
def tally(
    folder: Annotated[Path, typer.Argument(help="Folder of run folders with summary.json.")],
    need: Annotated[float, typer.Option(help="Share of the runs that must reach their goal.")] = 0.9,
) -> None:
    """Print a table of many runs; exit 1 if too few reached their goal, a rover had a contact or a replay differs."""
    rows = [json.loads(path.read_text()) for path in sorted(folder.glob("*/summary.json"))]
    table = Table("terrain", "seed", "goal", "distance", "collisions", "scans", "way", "rtf", "replay", "scanner")
    for r in rows:
        table.add_row(*(str(r[key]) for key in TALLIED), after.scanner_line(r.get("scanner", {})))
    table_console().print(table)
    for r in rows:
        if not r["goal_reached"] or r["collisions"]:
            print(f"{r['terrain']} {r['seed']}: {r['outcome']}; {r['contacts'][:1]}")
    reached = sum(bool(r["goal_reached"]) for r in rows)
    clean = all(r["collisions"] == 0 and r["replay"] == "identical" for r in rows)
    print(f"{reached} of {len(rows)} reached their goal")
    raise typer.Exit(EX_OK if rows and reached >= need * len(rows) and clean else EX_FAILED)


def main() -> None:
    """Entry point."""
    quiet_start.loaded()
    for number in (signal.SIGINT, signal.SIGTERM):  # both end a run in order, also where a shell ignores Ctrl-C
        signal.signal(number, signal.default_int_handler)
    try:
        app(prog_name="hil")
    except SystemExit as ended:
        raise SystemExit(EX_USAGE if ended.code == _CLICK_USAGE else ended.code) from None


if __name__ == "__main__":
    main()
