"""`make demo`: one mission on the bench, then replay, summary, certificate and report."""

from __future__ import annotations

import hashlib
import json
import platform
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mcap.reader import make_reader
from numpy.typing import NDArray

from hil.link.impairment import Profile, load_profile
from hil.processes import environment
from hil.scenarios.model import Scenario, scanner_of
from hil.scenarios.verdicts import Facts, Verdict, judge
from onboard.planning.archive import from_npz
from onboard.records import Event

if TYPE_CHECKING:
    from hil.run.run import RunResult

REPLANNED_M = 1.0
UNENDED = "the mission did not end"
TOLERANCE_M = {"fbm": 0.3, "craters": 0.3, "flat": 0.3, "real": 0.5}
HISTOGRAM_MS, HISTOGRAM_BINS = (0.1, 1000.0), 40
_PACKAGES = ("numpy", "scipy", "pybullet", "small-gicp", "filterpy", "python-can", "pymavlink", "eclipse-zenoh")


@dataclass(frozen=True, slots=True)
class RecordFigures:
    """Figures that the flight program reported in its record.

    outcome: end of the last mission, see `outcome`
    scans: number of scans
    replans: number of changes of the global path, see `replans`
    strategy: setting `mission.strategy`
    decisions: texts of the DECISION events
    events: all events
    """

    outcome: str
    scans: int
    replans: int
    strategy: str
    decisions: tuple[str, ...]
    events: tuple[Event, ...]


def told(record: Path) -> RecordFigures:
    """Read outcome, scans, decisions and events from a record."""
    scans, decisions, global_paths = 0, [], []
    events: list[Event] = []
    with record.open("rb") as file:
        reader = make_reader(file)
        for _, channel, message in reader.iter_messages(topics=["/out/event", "/plan"]):
            if channel.topic == "/plan":
                global_paths.append(from_npz(message.data).global_path)
                continue
            for event in json.loads(message.data):
                events.append(Event(message.log_time, event["severity"], event["name"], event["text"]))
                scans += event["name"] == "PHASE" and event["text"].startswith("MAPPING")
                if event["name"] == "DECISION":
                    decisions.append(event["text"])
        config = next(a.data.decode() for a in reader.iter_attachments() if a.name == "config.toml")
    strategy = next(line.split('"')[1] for line in config.splitlines() if line.startswith("strategy ="))
    end = outcome((event.name, event.text) for event in events)
    return RecordFigures(end, scans, replans(global_paths), strategy, tuple(decisions), tuple(events))


def outcome(events: Iterable[tuple[str, str]]) -> str:
    """End of the last mission, from (name, text) of each event: arrived, failed, or the mode that ended it."""
    end = UNENDED
    for name, text in events:
        if name in ("ARRIVED", "FAILED"):
            end = f"{name.lower()}: {text}"
        elif name == "MODE" and "-> AUTONOMOUS" in text:
            end = UNENDED
        elif name == "MODE" and text.startswith("AUTONOMOUS -> ") and end == UNENDED:
            end = text.removeprefix("AUTONOMOUS -> ")
    return end


def summary(scenario: Scenario, result: RunResult, replay: dict[str, Any]) -> dict[str, Any]:
    """Contents of `build/demo/summary.json`; see docs/demo.md."""
    word = told(result.folder / "onboard.mcap")
    directions = {name: _direction(result.link.get(name, {})) for name in ("down", "up")}
    reached = result.ground_exit == 0 and result.distance_to_goal_m <= TOLERANCE_M[scenario.terrain]
    return {
        "goal_reached": reached,
        "distance_to_goal_m": round(result.distance_to_goal_m, 4),
        "outcome": word.outcome,
        "collisions": len(result.contacts),
        "contacts": [contact.row() for contact in result.contacts],
        "scans": word.scans,
        "replans": word.replans,
        "strategy": word.strategy,
        "decisions": word.decisions,
        "bench_s": round(result.bench_s, 2),
        "wall_s": round(result.wall_s, 2),
        "rtf": round(result.bench_s / result.wall_s, 2),
        "way_m": round(result.way_m, 2),
        "replay": replay.get("verdict", "failed"),
        "replay_ticks": replay.get("ticks", 0),
        "replay_bytes": replay.get("bytes", {}),
        "can_frames": sum(result.streams[n]["pieces"] for n in ("can_to_onboard", "can_to_nodes")),
        "scip_bytes": sum(result.streams[n]["bytes"] for n in ("lidar_to_onboard", "lidar_to_sensor")),
        "link_datagrams": sum(d["sent"] for d in directions.values()),
        "link_lost": sum(d["lost"] for d in directions.values()),
        "link_by_direction": directions,
        "onboard_peak_rss_mb": round(result.onboard_rss_bytes / 1e6, 1),
        "tick_wall_ms": tick_wall_ms(result.laps_ms),
        "gdem": result.accepted.field.gdem.note,
        "seed": scenario.seed,
        "terrain": scenario.terrain,
        "link_profile": scenario.link,
        "link_note": link_note(load_profile(scenario.link)),
        **result.equipment,
        "field": result.accepted.field.stats,
        "goal_m": list(result.accepted.field.goal_m),
        "passed_over": [{"seed": seed, "reason": reason} for seed, reason in result.accepted.passed_over],
        "faults": list(result.faults),
        "verdicts": [verdict._asdict() for verdict in verdicts(scenario, result, word.events)],
        "overruns": result.overruns,
        "error": result.error,
    }


def verdicts(scenario: Scenario, result: RunResult, events: Sequence[Event]) -> tuple[Verdict, ...]:
    """Verdicts on the scenario's promises for this run; only `hil run --quick` judges when its faults showed."""
    facts = Facts(result.distance_to_goal_m, result.speed_mps, events, result.contacts, result.error)
    return judge(scenario.expect, facts)


def tick_wall_ms(laps_ms: Sequence[tuple[float, float]]) -> dict[str, dict[str, Any]]:
    """Wall time of a tick, ms: the bench's own work, and the time until onboard has answered. Both run at once.

    Percentiles and histograms. Values beyond the edges of a histogram count in its outermost bins.
    """
    columns = np.array(laps_ms).reshape(-1, 2).T
    names = ("plant_and_devices", "until_onboard_answered")
    shares = {"p50": 50, "p99": 99, "p99_9": 99.9, "max": 100}
    rows: dict[str, dict[str, Any]] = {
        name: {share: round(float(np.percentile(column, q)), 3) for share, q in shares.items()} if len(column) else {}
        for name, column in zip(names, columns)
    }
    edges_ms = np.geomspace(*HISTOGRAM_MS, HISTOGRAM_BINS + 1)
    counts = {n: np.histogram(np.clip(c, *HISTOGRAM_MS), edges_ms)[0].tolist() for n, c in zip(names, columns)}
    return {**rows, "histogram": {"edges_ms": edges_ms.round(4).tolist(), **counts}}


def link_note(profile: Profile) -> str:
    """Link profile in words: rates, delay, losses, meaning."""
    down, up = (f"{bps / 1e3:g} kbit/s" for bps in (profile.down_bps, profile.up_bps))
    words = [f"{down} both ways" if down == up else f"{down} to the ground, {up} to the rover"]
    words.append(f"{profile.one_way_s:g} s one way")
    if profile.loss:
        words.append(f"{100 * profile.loss:g} % loss")
    if profile.mean_bad_s:
        words.append(f"shadows of {profile.mean_bad_s:g} s every {profile.mean_bad_s + profile.mean_good_s:g} s, mean")
    return f"{', '.join(words)}: {profile.note}"


def replans(paths: Sequence[NDArray[np.float64]]) -> int:
    """Number of stops at which the new global path deviates by more than REPLANNED_M from the previous one."""
    return sum(_apart_m(new, old) > REPLANNED_M for old, new in pairwise(paths))


def _apart_m(path: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Largest distance from a node of `path`, (k, 2), to the polyline `other`."""
    start, way = other[:-1], np.diff(other, axis=0)
    off = path[:, None, :] - start[None, :, :]
    share = np.clip((off * way).sum(axis=2) / np.maximum((way**2).sum(axis=1), 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(off - share[:, :, None] * way, axis=2).min(axis=1).max())


def _direction(row: dict[str, Any]) -> dict[str, int]:
    keys = {"sent": "offered", "lost": "lost", "delivered": "delivered"}
    return {name: int(row.get(key, 0)) for name, key in keys.items()}


def certificate(scenario: Scenario, result: RunResult) -> dict[str, Any]:
    """Hashes of every channel and of the plant's states: equal for the same seed on any machine of the set."""
    flown = {**asdict(scenario), "lidar": asdict(scanner_of(scenario.lidar))}  # explicit, since the default may change
    flight = json.loads(json.dumps(flown, default=dict))
    link = {f"link_{d}_{end}": result.link[d][end] for d in ("down", "up") for end in ("in", "out") if d in result.link}
    config = json.dumps(flight, sort_keys=True).encode()
    return {
        "scenario": scenario.name,
        "terrain": scenario.terrain,
        "seed": scenario.seed,
        "flight": flight,
        "scenario_sha256": hashlib.sha256(config).hexdigest(),
        "versions": {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}},
        "machine": platform.machine(),
        "channels": {**result.streams, **link},
        "plant": {"states": result.states, "sha256": result.states_sha256},
    }


def differences(old: Any, new: Any, where: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield place, old and new value of each leaf that differs between two certificates."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted({*old, *new}):
            yield from differences(old.get(key), new.get(key), f"{where}.{key}" if where else key)
    elif old != new:
        yield where, old, new


def scanner_line(scanner: dict[str, Any]) -> str:
    """Scanner of a summary in a few words; '' for an old summary without the key."""
    return f"{scanner['profile']}, {100 * scanner['lost_ratio']:.2f} % lost" if scanner else ""


def replay(folder: Path) -> dict[str, Any]:
    """Run `onboard replay` on the run's record in a child process; returns its JSON."""
    command = [sys.executable, "-m", "onboard", "replay", "--json", str(folder / "onboard.mcap")]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=False)
    if done.returncode not in (0, 1) or not done.stdout.startswith("{"):
        return {"verdict": "failed", "first_difference": done.stderr.strip()[-400:]}
    return dict(json.loads(done.stdout))


def report(folder: Path) -> str:
    """Run `ground report` on the run; returns the error text, or ''."""
    command = [sys.executable, "-m", "ground", "report", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=False)
    return "" if done.returncode == 0 else done.stderr.strip()[-2000:]
