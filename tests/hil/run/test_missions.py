"""Whole missions with a fault, in four real processes on real sockets, in lock-step."""

import json
import os
import sqlite3
from contextlib import closing, suppress
from itertools import pairwise
from pathlib import Path

import pytest
from mcap.reader import make_reader

from hil.run.demo import told
from hil.run.run import run
from hil.scenarios.model import Scenario, load_scenario
from onboard.record.replay import replay

SCENARIOS = Path(__file__).parents[3] / "hil" / "scenarios" / "data"
pytestmark = pytest.mark.mission


def fly(name, folder, watch=lambda progress, wall_s: None):
    result = run(load_scenario(SCENARIOS / f"{name}.toml"), folder, watch)
    assert result.error == ""
    return result


def events(folder):
    with (folder / "onboard.mcap").open("rb") as file:
        for _, _, message in make_reader(file).iter_messages(topics=["/out/event"]):
            for event in json.loads(message.data):
                yield event["now_ns"] / 1e9, event["name"], event["text"]


def truth(folder):
    with (folder / "truth.mcap").open("rb") as file:
        for _, _, message in make_reader(file).iter_messages(topics=["/truth"]):
            yield message.log_time / 1e9, json.loads(message.data)


def files_of_onboard(folder):
    """Names of the run's files that the flight program has open now."""
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            words = (process / "cmdline").read_bytes()
            if b"-m\0onboard\0run" in words and bytes(folder) in words:
                paths = [Path(os.readlink(link)) for link in (process / "fd").iterdir()]
                yield from (path.name for path in paths if folder in path.parents)


def fault_times(result):
    return {row["what"]: row["t_s"] for row in result.faults}


def test_a_run_that_its_time_limit_ends_is_no_error_and_was_not_finished(tmp_path):
    result = run(Scenario(terrain="flat", limit_s=5.0), tmp_path, lambda *_: None)
    assert (result.error, result.bench_s, result.ground_exit) == ("", 5.0, None)
    assert not told(tmp_path / "onboard.mcap").outcome.startswith("arrived")


def test_lidar_unplugged_in_mid_sweep_is_scanned_again_and_the_goal_is_reached(tmp_path):
    opened = set()
    result = fly("lidar_unplugged", tmp_path, lambda progress, wall_s: opened.update(files_of_onboard(tmp_path)))
    times = fault_times(result)
    told = [(t, text) for t, name, text in events(tmp_path) if name == "FAULT" and text.startswith("LIDAR_SILENT")]
    assert 0 < told[0][0] - times["begin"] <= 0.2
    cleared = [t for t, name, text in events(tmp_path) if name == "FAULT_CLEARED" and text == "LIDAR_SILENT"]
    assert cleared[0] > times["heal"]
    assert result.ground_exit == 0
    assert result.distance_to_goal_m <= 0.3
    assert not result.contacts
    assert opened == {"onboard.mcap", "onboard.log"}  # the truth lies in the same folder, and is never opened


def test_a_silent_wheel_stops_the_rover_at_once_and_safe_says_why(tmp_path):
    result = fly("wheel_silent", tmp_path)
    begin = fault_times(result)["begin"]
    safe = [(t, text) for t, name, text in events(tmp_path) if name == "MODE" and "-> SAFE" in text]
    assert safe[0][0] - begin <= 0.23
    assert "WHEEL_SILENT" in safe[0][1]
    assert result.ground_exit == 1
    rates = [max(map(abs, row["wheel_rate_radps"])) for t, row in truth(tmp_path) if t > begin + 2.0]
    assert max(rates) < 0.02


def test_the_drive_goes_on_through_a_blackout_of_60_s_and_everything_arrives_after_it(tmp_path):
    scenario = load_scenario(SCENARIOS / "link_blackout.toml")
    start_s, end_s = scenario.blackout_s
    result = fly("link_blackout", tmp_path)
    way = [row["position_m"][:2] for t, row in truth(tmp_path) if start_s < t < end_s]
    assert sum(abs(a[0] - b[0]) + abs(a[1] - b[1]) for a, b in pairwise(way)) > 1.0
    assert result.ground_exit == 0
    assert result.distance_to_goal_m <= 0.3
    heard = list(received(tmp_path))
    assert not [t for t in heard if start_s + 1.0 < t < end_s]
    assert min(t for t in heard if t > end_s) <= end_s + 0.3 + 2.0


def received(folder):
    """Bench times at which the station archived a datagram of the rover."""
    with closing(sqlite3.connect(folder / "ground" / "archive.db")) as archive:
        for (at_ns,) in archive.execute("select at_ns from datagrams where direction = 'down' order by at_ns"):
            yield at_ns / 1e9


def test_kill_9_in_mid_drive_stops_the_wheels_and_the_next_start_stands_knows_its_place_and_goes_on(tmp_path):
    result = fly("onboard_restarted", tmp_path)
    killed, started = fault_times(result)["begin"], fault_times(result)["heal"]
    rows = list(truth(tmp_path))
    rates = [(t, max(map(abs, row["wheel_rate_radps"]))) for t, row in rows]
    assert max(rate for t, rate in rates if killed - 1.0 < t < killed) > 0.5
    # the nodes' own timeout: 0.1 s without a command, then down by 1 rad/s2 from 1.1 rad/s
    assert max(rate for t, rate in rates if killed + 0.1 + 1.3 < t < started + 10.0) < 0.02
    told = list(events(tmp_path))  # of the second start, whose clock starts again at 0
    assert next(text for _, name, text in told if name == "MODE").startswith("STANDBY -> AUTONOMOUS")
    at_s, name, text = told[0]
    x_m, y_m = map(float, text.split(": ")[1].split(",")[0].split())
    true_x_m, true_y_m = next(row for t, row in rows if t > started)["position_m"][:2]
    assert (at_s, name) == (0.0, "STATE")
    # a step of the kept poses, and 0.08 m until the nodes have stopped the wheels
    assert abs(x_m - true_x_m) < 0.15 and abs(y_m - true_y_m) < 0.05
    with (tmp_path / "onboard.mcap").open("rb") as file:
        kept = {attachment.name for attachment in make_reader(file).iter_attachments()}
    assert {"kept/pose", "map-start/0_0", "map-start/-1_-1"} <= kept
    assert (tmp_path / "state" / "boots.json").read_text() == "2"
    phases = [text.split()[0] for _, name, text in told if name == "PHASE"]
    assert "TURNING" not in phases[: phases.index("DRIVING")]  # with a map it needs no look behind
    assert result.distance_to_goal_m <= 0.3 and not result.contacts
    assert replay(tmp_path / "onboard.mcap").identical
