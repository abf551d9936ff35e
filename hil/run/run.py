"""One run of a scenario: the bench in this process, onboard, link and ground as children, and the result."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil.devices.can.hub import CanHub
from hil.devices.can.socket import CanSocket
from hil.faults.injection import Injector
from hil.link.impairment import PROFILES
from hil.plant.plant import PlantAbortError
from hil.processes import ProcessDiedError, Processes, free_ports
from hil.run.bench import Bench, BenchConnections
from hil.run.folder import KEPT, check, cleared
from hil.run.lockstep import ParticipantLostError
from hil.scenarios.model import Scenario, fitting_of, flight_settings, ground_of, paths_in, script_of, set_words
from hil.terrain import field_file
from hil.terrain.fields import AcceptedField
from hil.world.contacts import Contact
from hil.world.equipment import equipment
from hil.world.truth import Truth
from hil.world.world import Progress
from onboard.config import load
from onboard.maps.gdem_file import to_npz
from onboard.native import linear
from protocol.conventions import TICK_NS

NAMES = frozenset({"onboard", "link", "ground"})
_END_S = 20.0
FAILED, UNFINISHED = 1, 75  # exit codes of the operator's script
REBOOTS = 75  # exit code of the flight program after the command `reboot`


@dataclass(frozen=True, slots=True)
class RunResult:
    """Result of a run.

    folder: folder of the run
    accepted: field of the run
    bench_s, wall_s: bench time and wall time
    distance_to_goal_m, speed_mps: true values at the end
    contacts: all contacts
    sweeps: number of sweeps
    streams: counts and hashes of each channel
    states, states_sha256: number and hash of the plant's states
    link: report of the link emulator
    ground_exit: exit code of the operator's script, None if it has not ended
    faults: log of the injections
    way_m: distance driven
    onboard_rss_bytes: largest resident memory of onboard
    overruns: number of ticks that were late by more than one tick
    laps_ms: wall time of each tick: of plant and devices, and until onboard has answered
    equipment: see hil.world.equipment
    error: '' if the run ended as the scenario intends, else the reason
    """

    folder: Path
    accepted: AcceptedField
    bench_s: float
    wall_s: float
    distance_to_goal_m: float
    speed_mps: float
    contacts: tuple[Contact, ...]
    sweeps: int
    streams: dict[str, Any]
    states: int
    states_sha256: str
    link: dict[str, Any]
    ground_exit: int | None
    faults: tuple[dict[str, object], ...]
    way_m: float
    onboard_rss_bytes: int
    overruns: int
    laps_ms: tuple[tuple[float, float], ...]
    equipment: dict[str, Any]
    error: str = ""


def run(
    scenario: Scenario,
    folder: Path,
    progress: Callable[[Progress, float], None],
    *,
    pace: float = 0.0,
    onboard_python: str = "",
) -> RunResult:
    """Run to the end of the operator's script. pace 0: as fast as possible; 1: real time, overruns are counted.

    onboard_python: interpreter that runs the flight program, if it is not this one

    Chooses the children's addresses; each child writes FOLDER/NAME.log. Ctrl-C ends them in order and is raised again.
    Raises ConfigError if the folder contains files that no run made.
    """
    check(folder)
    accepted = ground_of(scenario)
    cleared(folder)
    (folder / "field.npz").write_bytes(field_file.to_npz(accepted.field))
    (folder / "gdem.npz").write_bytes(to_npz(accepted.field.gdem))
    (folder / "script.txt").write_text(script_of(scenario, accepted.field))
    truth = Truth(folder / "truth.mcap")
    with Processes(folder) as processes, ExitStack() as interrupted:
        joined = BenchConnections(CanHub() if scenario.can == "hub" else CanSocket(scenario.can), processes.check)
        config = load(None, flight_settings(scenario, accepted.field.start))
        bench = Bench(accepted.field, scenario.seed, load().rover, truth, joined, scenario.soil)
        interrupted.callback(bench.close, "the run was interrupted")
        bench.fit(fitting_of(scenario, config.scanning.sector_rad))
        injector, error = Injector(scenario.faults), ""
        started = time.monotonic()
        try:
            _start(scenario, folder, bench, processes, onboard_python)
            bench.gather(NAMES - {"ground"} if scenario.live else NAMES)
            started = time.monotonic()
            _loop(scenario, bench, processes, injector, progress, pace, folder)
        except (ParticipantLostError, ProcessDiedError, PlantAbortError, TimeoutError, ConnectionError) as lost:
            error = _why(lost, processes)
        wall_s = time.monotonic() - started
        rss_bytes = processes.peak_rss_bytes("onboard")
        interrupted.pop_all()
        bench.close(error or "the run is over")
        codes = processes.wait(_END_S)
        cut = scenario.live or bench.ground_code is None  # the bench ended before the script did
        error = error or _bad_ends(cut, codes, processes)
    report = folder / "link.json"
    return RunResult(
        folder,
        accepted,
        bench.tick * TICK_NS / 1e9,
        wall_s,
        bench.progress.distance_to_goal_m,
        linear.norm(bench.state.velocity_mps),
        tuple(truth.contacts),
        bench.progress.sweeps,
        {name: stream.report() for name, stream in bench.streams.items()},
        truth.states,
        truth.sha256(),
        json.loads(report.read_text()) if report.exists() else {},
        bench.ground_code,
        tuple(injector.log),
        bench.progress.way_m,
        rss_bytes,
        bench.progress.overruns,
        tuple(bench.laps_ms),
        equipment(bench),
        error,
    )


def _start(scenario: Scenario, folder: Path, bench: Bench, processes: Processes, onboard_python: str) -> None:
    """Start link, onboard and, without a live operator, ground, each with its addresses."""
    rover_side, ground_side = (f"tcp/127.0.0.1:{port}" for port in free_ports(2))
    barrier = ("--barrier", bench.barrier.address)
    write_station(folder / "ground.toml", ground_side, scenario.seed)
    processes.start(
        "link",
        "hil",
        [
            "link",
            "--profile",
            scenario.link,
            "--profiles",
            str(_profiles(scenario, folder)),
            "--seed",
            str(scenario.seed),
            "--rover",
            rover_side,
            "--ground",
            ground_side,
            "--report",
            str(folder / "link.json"),
            *barrier,
            "--record",
            str(folder / "link.csv"),
            *(("--real-time",) if scenario.live else ()),
        ],
    )
    settings = _settings(scenario, folder, bench, rover_side)
    processes.start("onboard", "onboard", ["run", *settings], python=onboard_python)
    if scenario.live:
        processes.let_end("onboard", REBOOTS)
        return
    station, script = str(folder / "ground.toml"), str(folder / "script.txt")
    processes.start("ground", "ground", ["script", "--station", station, *barrier, script])


def _settings(scenario: Scenario, folder: Path, bench: Bench, rover_side: str) -> list[str]:
    settings = {
        "clock.mode": "lockstep",
        "clock.barrier": bench.barrier.address,
        "can.uri": bench.hub.uri,
        "lidar.address": bench.lidar_server.address,
        "link.endpoint": rover_side,
        "mission.gdem": str(folder / "gdem.npz"),
        "record.path": str(folder / "onboard.mcap"),
        **paths_in(folder, flight_settings(scenario, bench.start)),
    }
    if scenario.live or any(fault.fault == "onboard_restarted" for fault in scenario.faults):
        settings |= {f"{part}.folder": str(folder / part) for part in KEPT}
    return set_words(settings)


def _profiles(scenario: Scenario, folder: Path) -> Path:
    """Profile file, with the scenario's blackouts if it has some."""
    if not scenario.blackout_s:
        return PROFILES
    head = f"[{scenario.link}]"
    tables = PROFILES.read_text().replace(head, f"{head}\nblackouts_s = {list(scenario.blackout_s)}")
    path = folder / "link_profiles.toml"
    path.write_text(tables)
    return path


def write_station(path: Path, endpoint: str, seed: int) -> None:
    """Write the ground station's file for this run: bench keys from the seed; counters and archive in ground/."""
    path.write_text(f'endpoint = "{endpoint}"\nbench_seed = {seed}\nstate = "ground"\narchive = "ground/archive.db"\n')


def _loop(
    scenario: Scenario,
    bench: Bench,
    processes: Processes,
    injector: Injector,
    progress: Callable[[Progress, float], None],
    pace: float,
    folder: Path,
) -> None:
    started = shown = time.monotonic()
    while not _ended(scenario, bench):
        injector.step(bench, processes, bench.tick * TICK_NS)
        try:
            bench.step()
        except ParticipantLostError:
            if not (scenario.live and processes.has_ended("onboard", _END_S)):
                raise
            bench.lose("onboard")  # as a service manager does; bench time stands still until onboard runs again
            keep_record(folder)
            processes.restart("onboard")
            bench.regain("onboard")
        if bench.ground_code is not None:
            processes.let_end("ground", bench.ground_code)
        now = time.monotonic()
        if pace:
            early_s = bench.tick * TICK_NS / 1e9 / pace - (now - started)
            if early_s > 0:
                time.sleep(early_s)
            bench.progress.overruns += early_s < -TICK_NS / 1e9
        if now - shown > 0.5:
            shown = now
            progress(bench.progress, now - started)


def keep_record(folder: Path) -> None:
    """Rename all parts of the record of an ended start to onboard-bootN.mcap; the next start writes onboard.mcap."""
    number = 1
    while (folder / f"onboard-boot{number}.mcap").exists():
        number += 1
    for part in [folder / "onboard.mcap", *folder.glob("onboard.*.mcap")]:
        if part.exists():
            part.rename(folder / part.name.replace("onboard", f"onboard-boot{number}", 1))


def _ended(scenario: Scenario, bench: Bench) -> bool:
    now_s = bench.tick * TICK_NS / 1e9
    if scenario.end_s:
        return now_s >= scenario.end_s
    return bench.ground_code is not None or now_s >= scenario.limit_s


def _bad_ends(cut: bool, codes: dict[str, int], processes: Processes) -> str:
    """Error text for processes with an unexpected exit code, or ''.

    Expected: a process killed by a fault; a failed script; an unfinished script if the bench ended first.
    """
    good = {"ground": (0, FAILED, UNFINISHED) if cut else (0, FAILED)}
    return "\n".join(
        f"{name} ended with {code}:\n{processes.tail(name)}"
        for name, code in codes.items()
        if code not in good.get(name, (0,)) and not processes.killed(name)
    )


def _why(lost: Exception, processes: Processes) -> str:
    """Exit code and last lines of a process that has died, else the text of the exception."""
    try:
        processes.settle(2.0)
        processes.check()
    except ProcessDiedError as died:
        return str(died)
    return str(lost)
