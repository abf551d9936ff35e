"""The command `hil`: the bench."""

from __future__ import annotations

import json
import os
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hil import demo as after
from hil.can_command import EPILOG as CAN_EPILOG
from hil.can_command import main as can_command
from hil.can_socket import NoInterfaceError
from hil.lidar_command import EPILOG as LIDAR_EPILOG
from hil.lidar_command import main as lidar_command
from hil.link_emulator import main as link_command
from hil.processes import FIXED_ENVIRONMENT
from hil.scenario import Scenario, load_scenario
from hil.status import status
from onboard.config import ConfigError

if TYPE_CHECKING:
    from hil.run import RunResult
    from hil.world import Progress

SHOWN = (
    "goal_reached", "outcome", "distance_to_goal_m", "collisions", "scans", "replans", "way_m", "bench_s", "rtf",
    "replay", "link_datagrams", "link_lost", "onboard_peak_rss_mb",
)
TALLIED = (
    "terrain", "seed", "goal_reached", "distance_to_goal_m", "collisions", "scans", "way_m", "rtf", "replay",
)
EX_OK, EX_FAILED, EX_NOINPUT, EX_UNAVAILABLE, EX_SOFTWARE, EX_CONFIG, EX_INTERRUPTED = 0, 1, 66, 69, 70, 78, 130

app = typer.Typer(
    no_args_is_help=True, pretty_exceptions_enable=False,
    help="The hardware-in-the-loop bench.\n\nExamples:\n\n"
    "  hil demo --seed 3\n\n  hil run hil/scenarios/lidar_unplugged.toml\n\n  hil link --profile moon-bad\n\n"
    "  hil lidar --profile utm-30lx --pty\n\n  hil can --fault silent=WHEEL_3",
)
app.command("link")(link_command)
app.command("lidar", epilog=LIDAR_EPILOG)(lidar_command)
app.command("can", epilog=CAN_EPILOG)(can_command)


def fail(code: int, text: str) -> typer.Exit:
    """One helpful line on standard error, and the exit code."""
    print(f"hil: {text}", file=sys.stderr)
    return typer.Exit(code)


def line(progress: Progress, wall_s: float, live: bool = False) -> Text:
    """The live progress line; with a live operator the bench does not know the goal."""
    doing = "scanning" if progress.sweeping else "driving" if progress.driving else "thinking"
    rtf = progress.now_s / wall_s if wall_s > 0 else 0.0
    link = f"link {progress.link.get('received', 0)}/{progress.link.get('sent', 0)}" if progress.link else ""
    return Text(
        f"{progress.now_s:6.1f} s  x{rtf:4.1f}  {doing:8}  scan {progress.sweeps:2d}  driven {progress.way_m:4.1f} m  "
        + ("" if live else f"to go {progress.distance_to_goal_m:5.2f} m  ") + link
    )


def fly(scenario: Scenario, out: Path, pace: float = 0.0) -> RunResult:
    """Run with its status on standard error; exit 130 on Ctrl-C, nothing left behind."""
    from hil.run import run as run_scenario  # the engine is heavy: not for --help and `hil link`

    try:
        with status(Console(stderr=True), Text("starting bench, onboard, link and ground ...")) as tell:
            return run_scenario(
                scenario, out, lambda p, wall_s: tell(line(p, wall_s, scenario.live), wall_s), pace=pace
            )
    except KeyboardInterrupt:
        raise fail(EX_INTERRUPTED, "ended by Ctrl-C; all processes are gone") from None
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
    except NoInterfaceError as error:
        raise fail(EX_UNAVAILABLE, str(error)) from None


def conclude(scenario: Scenario, result: RunResult) -> dict[str, object]:
    """Replay, certificate and summary of a run, written beside its record."""
    replay = after.replay(result.folder)
    facts = after.summary(scenario, result, replay)
    facts["replay_difference"] = replay.get("first_difference", "")
    (result.folder / "summary.json").write_text(json.dumps(facts, indent=2) + "\n")
    certificate = after.certificate(scenario, result)
    (result.folder / "certificate.json").write_text(json.dumps(certificate, indent=2) + "\n")
    return facts


SeedOption = Annotated[int, typer.Option(min=1, help="The n-th accepted field.")]
StrategyOption = Annotated[str, typer.Option(help="Next stop by optimistic, explore, visibility or hill-climb.")]
TerrainOption = Annotated[str, typer.Option(help="fbm: 20 m fractal field, craters: with them, real: DEM, flat.")]


@app.command()
def demo(
    seed: SeedOption = 1,
    terrain: TerrainOption = "fbm",
    out: Annotated[Path, typer.Option(help="Folder of the run.")] = Path("build/demo"),
    strategy: StrategyOption = "optimistic",
) -> None:
    """Drive a rover across rocks to its goal; ends with the path of the report.

    Exit codes: 0 goal reached, 1 not reached (and why), 70 a process of the run failed.
    """
    scenario = Scenario(terrain=_terrain(terrain), seed=seed, set={"mission.strategy": strategy})
    result = fly(scenario, out)
    if result.error:
        raise fail(EX_SOFTWARE, f"after {result.bench_s:.1f} s of bench time: {result.error}")
    facts = conclude(scenario, result)
    problem = after.report(out)
    _show(facts)
    if problem:
        raise fail(EX_SOFTWARE, f"the report failed:\n{problem}")
    print(f"report: {out / 'report.html'}")
    raise typer.Exit(EX_OK if facts["goal_reached"] and facts["replay"] == "identical" else EX_FAILED)


def _terrain(name: str) -> str:
    if name not in after.TOLERANCE_M:
        raise fail(64, f"--terrain {name!r} should be one of {', '.join(after.TOLERANCE_M)}")
    return name


def _show(facts: dict[str, object]) -> None:
    table = Table(show_header=False, box=None)
    for key in SHOWN:
        table.add_row(key, str(facts[key]))
    Console().print(table)


@app.command()
def run(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    out: Annotated[Path | None, typer.Option(help="Folder of the run; default build/runs/NAME.")] = None,
    can: Annotated[str, typer.Option(help="CAN bus in place of the scenario's: hub, socketcan:INTERFACE.")] = "",
) -> None:
    """Run a scenario: bench, onboard, link and ground in lock-step.

    Exit codes: 0 ran to its end, 66 no such file, 69 no such CAN interface, 70 a process failed, 78 something wrong in
    the scenario.
    """
    try:
        read = load_scenario(scenario)
        read = replace(read, can=can or read.can)
    except FileNotFoundError:
        raise fail(EX_NOINPUT, f"no scenario {scenario}; the bench's own are in hil/scenarios") from None
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
    folder = out or Path("build/runs") / read.name
    result = fly(read, folder)
    if result.error:
        raise fail(EX_SOFTWARE, f"after {result.bench_s:.1f} s of bench time: {result.error}")
    _show(conclude(read, result))
    print(f"files of the run: {folder}")


@app.command()
def sim(
    seed: SeedOption = 1,
    terrain: TerrainOption = "fbm",
    out: Annotated[Path, typer.Option(help="Folder of the run.")] = Path("build/sim"),
) -> None:
    """Bench, onboard and link in real time until Ctrl-C, for `ground` commands from another terminal."""
    scenario = Scenario(name="sim", terrain=_terrain(terrain), seed=seed, limit_s=1e6, live=True)
    print("ready in a few seconds; from another terminal, in this folder:\n"
          "  .venv/bin/ground status\n  .venv/bin/ground goto 8 3\n  .venv/bin/ground stop\nCtrl-C ends it.")
    try:
        result = fly(scenario, out, pace=1.0)
    except typer.Exit as ended:
        raise typer.Exit(EX_OK if ended.exit_code == EX_INTERRUPTED else ended.exit_code) from None
    if result.error:
        raise fail(EX_SOFTWARE, f"after {result.bench_s:.1f} s of bench time: {result.error}")


@app.command()
def tally(
    folder: Annotated[Path, typer.Argument(help="Folder of run folders with summary.json.")],
    need: Annotated[float, typer.Option(help="Share of the runs that must reach their goal.")] = 0.9,
) -> None:
    """A table of many runs; exit 1 when too few reached their goal or any rover touched something."""
    rows = [json.loads(path.read_text()) for path in sorted(folder.glob("*/summary.json"))]
    table = Table("terrain", "seed", "goal", "distance", "collisions", "scans", "way", "rtf", "replay")
    for r in rows:
        table.add_row(*(str(r[key]) for key in TALLIED))
    Console().print(table)
    for r in rows:
        if not r["goal_reached"] or r["collisions"]:
            print(f"{r['terrain']} {r['seed']}: {r['outcome']}; {r['contacts'][:1]}")
    reached = sum(bool(r["goal_reached"]) for r in rows)
    clean = all(r["collisions"] == 0 and r["replay"] == "identical" for r in rows)
    print(f"{reached} of {len(rows)} reached their goal")
    raise typer.Exit(EX_OK if rows and reached >= need * len(rows) and clean else EX_FAILED)


def main() -> None:
    """Entry point; starts itself anew where the environment is not the one that gives the same bits every time."""
    if any(os.environ.get(name) != text for name, text in FIXED_ENVIRONMENT.items()):
        os.execve(sys.executable, [sys.executable, "-m", "hil", *sys.argv[1:]], {**os.environ, **FIXED_ENVIRONMENT})
    for number in (signal.SIGINT, signal.SIGTERM):  # both end a run in order, also where a shell ignores Ctrl-C
        signal.signal(number, signal.default_int_handler)
    app(prog_name="hil")


if __name__ == "__main__":
    main()
