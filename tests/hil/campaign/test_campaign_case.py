"""Flights of a campaign: their rows, flown again the same, and the figures that an observer makes."""

import json
import math
import struct
from contextlib import chdir
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from hil.__main__ import app
from hil.campaign.case import COLUMNS, OUTCOMES, fly, reason_class, verdict
from hil.campaign.mission import Estimate, Watch
from hil.campaign.plan import plan_of
from hil.campaign.table import TIMES
from hil.faults.ground_faults import KINDS
from hil.terrain.obstacle import Obstacle
from hil.view.folder import Folder
from onboard.config import Rover as RoverConfig
from protocol.link.reports import RequestState
from protocol.tables.modes import Phase

PLAN = """
cases = 1
seed = 4
[mission]
terrain = "flat"
limit_s = 12
edges = false
[lidar]
lost_ratio = { uniform = [0.0, 0.05] }
[[faults]]
fault = "imu_silent"
after_s = 5
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A campaign of one case that a fault ends, and the same case flown again with its records."""
    place = tmp_path_factory.mktemp("flown")
    (place / "short.toml").write_text(PLAN)
    with chdir(place):
        campaign = CliRunner().invoke(app, ["campaign", "short.toml", "--json"])
        again = CliRunner().invoke(app, ["case", "short.toml", "1", "--json"])
    return SimpleNamespace(place=place, campaign=campaign, again=again, row=json.loads(again.stdout))


def test_a_flight_that_a_fault_ends_is_stopped_and_its_row_has_every_column(flown):
    assert flown.campaign.exit_code == 0, flown.campaign.stderr
    assert {column.name for column in COLUMNS} <= set(flown.row)
    row = flown.row
    assert (row["outcome"], row["reachable"], row["way_ratio"]) == ("stopped", True, None) and "IMU" in row["reason"]
    assert 500 < row["ticks"] < 1200 and row["bench_s"] == row["ticks"] / 100
    assert row["optimum_m"] == pytest.approx(math.hypot(5.0, 0.5), abs=0.35)  # up to the goal's tolerance of 0.3 m
    assert row["injected"] == "5.00 s imu_silent begin" and "IMU" in row["faults"] and 0 < row["fault_delay_s"] < 2
    assert 0 <= row["position_error_m"] < 0.1 and row["contacts"] == 0 and 0 <= row["max_tilt_deg"] < 2


def test_a_case_flown_again_is_identical_to_the_campaigns_flight(flown):
    assert flown.again.exit_code == 0 and "is identical" in flown.again.stderr
    stored = json.loads((flown.place / "build/campaigns/short/cases.jsonl").read_text())
    assert {k: v for k, v in stored.items() if k not in TIMES} == {k: v for k, v in flown.row.items() if k not in TIMES}


def test_a_case_has_records_that_the_viewer_opens(flown):
    folder = flown.place / "build/campaigns/short/case-1"
    assert {path.name for path in folder.iterdir()} >= {"onboard.mcap", "truth.mcap", "field.npz"}
    assert Folder(folder).ground.goal_m == (5.0, 0.5)


def test_a_case_that_differs_from_the_campaigns_flight_ends_with_1_and_names_what_differs(flown, monkeypatch):
    stored = flown.place / "build/campaigns/short/cases.jsonl"
    before = stored.read_text()
    stored.write_text(json.dumps({**json.loads(before), "way_m": 99.0}) + "\n")
    monkeypatch.setattr("hil.campaign.case.fly", lambda plan, number, folder: flown.row)
    with chdir(flown.place):
        done = CliRunner().invoke(app, ["case", "short.toml", "1"])
    stored.write_text(before)
    assert done.exit_code == 1 and "differs in way_m" in done.stderr


def test_a_case_is_not_compared_with_the_campaign_of_another_plan(flown, monkeypatch):
    other = {**flown.row, "way_m": 99.0}
    monkeypatch.setattr("hil.campaign.case.fly", lambda plan, number, folder: other)
    (flown.place / "other.toml").write_text('name = "short"\n' + PLAN.replace("seed = 4", "seed = 5"))
    with chdir(flown.place):
        done = CliRunner().invoke(app, ["case", "other.toml", "1"])
    assert done.exit_code == 0 and "of another plan, not compared" in done.stderr and "differs" not in done.stderr


def test_a_case_is_compared_with_the_campaign_of_a_named_folder(flown, monkeypatch):
    folders = []
    monkeypatch.setattr("hil.campaign.case.fly", lambda plan, number, folder: folders.append(folder) or flown.row)
    (flown.place / "named.toml").write_text(PLAN)
    with chdir(flown.place):
        alone = CliRunner().invoke(app, ["case", "named.toml", "1"])
        named = CliRunner().invoke(app, ["case", "named.toml", "1", "--campaign", "build/campaigns/short"])
        none = CliRunner().invoke(app, ["case", "named.toml", "1", "--campaign", "build"])
    assert alone.exit_code == 0 and "campaign's flight" not in alone.stderr
    assert named.exit_code == 0 and "is identical" in named.stderr
    assert folders == [Path("build/campaigns/named/case-1"), Path("build/campaigns/short/case-1")]
    assert none.exit_code == 66 and "build holds no campaign" in none.stderr


def test_a_case_shows_its_drawn_values_without_flying(flown):
    with chdir(flown.place):
        done = CliRunner().invoke(app, ["case", "short.toml", "1", "--dry", "--json"])
    told = json.loads(done.stdout)
    assert done.exit_code == 0 and told["mission.terrain"] == "flat" and 0 <= told["lidar.lost_ratio"] <= 0.05


def test_a_case_that_the_bench_cannot_make_is_a_row_of_outcome_error():
    plan = plan_of({"name": "p", "cases": 1, "lidar": {"sun_ratio": 0.5}}, "p.toml")  # without a sector
    row = fly(plan, 1)
    assert (row["outcome"], row["case_number"], row["seed"]) == ("error", 1, 1) and "sun_ratio" in row["reason"]


@pytest.mark.parametrize("defect", [
    AssertionError("no fault is injected"), struct.error("bad char"), MemoryError(), OSError(24, "too many files"),
])  # fmt: skip
def test_a_defect_of_the_bench_is_a_row_of_outcome_error_with_its_words(monkeypatch, defect):
    def bench(*_args, **_how):
        raise defect

    monkeypatch.setattr("hil.campaign.case.InMemory", bench)
    row = fly(plan_of({"name": "p", "cases": 1, "mission": {"terrain": "flat"}}, "p.toml"), 1)
    assert (row["outcome"], row["reason"]) == ("error", f"{type(defect).__name__}: {defect}")


def test_records_that_cannot_be_written_are_no_row(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError):
        fly(plan_of({"name": "p", "cases": 1, "mission": {"terrain": "flat"}}, "p.toml"), 1, tmp_path / "file/case-1")


def flight(*states, error="", to_goal_m=0.1):
    requests = [
        SimpleNamespace(state=state, telecommand=SimpleNamespace(name="goto"), report=SimpleNamespace(text="told"))
        for state in states
    ]
    done = bool(states) and all(state is RequestState.COMPLETED for state in states)
    return SimpleNamespace(error=error, arrived=done, distance_to_goal_m=to_goal_m, requests=requests)


@pytest.mark.parametrize(("made", "outcome"), [
    (flight(RequestState.COMPLETED), "arrived"), (flight(RequestState.COMPLETED, to_goal_m=0.31), "silent"),
    (flight(RequestState.COMPLETED, RequestState.FAILED), "stopped"), (flight(RequestState.PROGRESS), "undecided"),
    (flight(RequestState.PROGRESS, error="tipped"), "aborted"), (flight(RequestState.EXPIRED), "stopped"),
])  # fmt: skip
def test_the_outcome_is_the_rovers_word_checked_by_truth(made, outcome):
    assert verdict(made)[0] == outcome and outcome in OUTCOMES


def test_reasons_that_differ_in_numbers_only_are_of_one_class():
    assert reason_class("2.50 m from (1.0, -3)") == reason_class("17 m from (-4, 2.25)")
    assert reason_class("no way") != reason_class("no scan")


def test_an_estimates_sigma_is_that_of_its_worst_axis_and_its_nees_that_of_its_axes():
    turn = math.radians(30)
    axes = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = axes @ np.diag([0.04, 0.01]) @ axes.T
    covariance[2, 2] = 0.0001
    estimate = Estimate(np.array([*(axes @ [0.4, 0.1]), 0.02]), covariance)
    assert estimate.sigma_m == pytest.approx(0.2) and estimate.sigma_rad == pytest.approx(0.01)
    assert estimate.nees == pytest.approx(2.0**2 + 1.0**2 + 2.0**2)


def seen(phase, x_m, true_x_m, yaw_rad=0.0, roll_rad=0.0):
    """Arguments of a tick for an observer."""
    pose = SimpleNamespace(x_m=x_m, y_m=0.0, yaw_rad=yaw_rad)
    localisation = SimpleNamespace(pose=pose, estimate=SimpleNamespace(covariance=0.01 * np.eye(4)))
    rover = SimpleNamespace(localisation=localisation, executive=SimpleNamespace(phase=phase))
    turned = np.array([math.sin(roll_rad / 2), 0.0, 0.0, math.cos(roll_rad / 2)])
    return rover, SimpleNamespace(position_m=np.array([true_x_m, 0.0, 0.0]), quaternion_xyzw=turned)


def test_an_observer_keeps_the_largest_errors_of_the_mission_the_tilt_and_the_stops():
    watch, outputs = Watch(), SimpleNamespace(jobs=(1, 2))
    ticks = [
        (Phase.NONE, 5.0, 0.0), (Phase.SCANNING, 0.1, 0.0), (Phase.MAPPING, 0.3, 0.1), (Phase.MAPPING, 0.1, 0.1),
        (Phase.DRIVING, 1.0, 0.9),
    ]  # fmt: skip
    for tick, (phase, x_m, true_x_m) in enumerate(ticks, 1):
        watch(tick, None, outputs, *seen(phase, x_m, true_x_m, yaw_rad=0.02, roll_rad=0.1 * tick))
    assert watch.max_error_m == pytest.approx(0.2) and watch.error_m == pytest.approx(0.1)
    assert watch.max_heading_rad == pytest.approx(0.02) and watch.max_tilt_rad == pytest.approx(0.5)
    assert [stop.error[0] for stop in watch.stops] == [pytest.approx(0.2)] and watch.jobs == 10


@pytest.mark.parametrize(("x_m", "inside"), [(0.0, False), (0.4, False), (0.7, True), (1.3, True)])
def test_an_observer_notes_a_wheel_over_an_obstacle_and_has_no_word_without_one(x_m, inside):
    obstacles, outputs = [], SimpleNamespace(jobs=())
    watch = Watch(obstacles)
    rover, state = seen(Phase.DRIVING, x_m, x_m)
    rover.config = SimpleNamespace(rover=RoverConfig())
    state.pose = SimpleNamespace(x_m=x_m, y_m=0.0, yaw_rad=0.0)
    watch(1, None, outputs, rover, state)
    assert watch.in_obstacle is None
    reach_m = RoverConfig().half_wheelbase_m + RoverConfig().wheel_radius_m
    obstacles.append(Obstacle(KINDS["trench"], 0.45 + reach_m, 0.0, 0.0))
    watch(2, None, outputs, rover, state)
    assert watch.in_obstacle is inside
