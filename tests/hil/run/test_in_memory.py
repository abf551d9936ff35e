"""A scenario in one process is the scenario over sockets, but for the sockets."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from hil.faults.plan import Injection
from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory, goto
from hil.run.run import run
from hil.scenarios.model import Scenario, load_scenario
from hil.world.operator import TimedCommand
from protocol.conventions import TICK_NS
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode

ROOT = Path(__file__).parents[3]
FLAT = Scenario(terrain="flat", link="lan", lidar={"profile": "ideal"})
QUICK = {  # a scan in 15 s, a short way
    "scanning.start_rad": 1.05, "scanning.end_rad": -0.1, "scanning.spacing_m": 0.15, "scanning.floor_rad": 0.006,
    "scanning.cap_rad": 0.03, "scanning.range_m": 6.0, "mapping.size_m": 14.0, "mapping.near_m": 3.0,
}  # fmt: skip
TWO_FAULTS = """
name = "two_faults"
terrain = "flat"
seed = 3
link = "lan"
script = "at 1.0: goto 2.0 0.3\\nwait goto\\n"
end_s = 60.0

[lidar]
profile = "utm-30lx"
lost_ratio = 0.0
outlier_ratio = 0.0
sun_ratio = 0.02  # beside the sector that is mapped
sun_from_rad = 1.4
sun_to_rad = 2.2

[set.scanning]
start_rad = 1.05
end_rad = -0.1
spacing_m = 0.15
floor_rad = 0.006
cap_rad = 0.03
range_m = 6.0

[[faults]]
fault = "lidar_unplugged"
when = "sweep"
after_s = 2.0
for_s = 3.0

[[faults]]
fault = "wheel_silent"
target = 3
when = "drive"
after_s = 2.0
"""


@pytest.mark.mission
def test_every_byte_is_the_same_as_over_sockets(tmp_path):
    """Cable pulled in the sweep, wheel silent in the drive: the record's inputs and outputs, the hashes, the truth."""
    path = tmp_path / "two_faults.toml"
    path.write_text(TWO_FAULTS)
    over_sockets = run(load_scenario(path), tmp_path / "run", lambda *_: None)
    assert over_sockets.error == ""
    assert [row["what"] for row in over_sockets.faults] == ["begin", "heal", "begin"]
    words = [sys.executable, "-m", "tests.hil.memory_twin", str(path), str(tmp_path / "run")]
    told = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert told.returncode == 0, told.stderr
    twin = json.loads(told.stdout)
    assert twin["first_difference"] == ""
    assert twin["ticks"] == over_sockets.bench_s * 100
    assert twin["streams"] == over_sockets.streams
    assert twin["states_sha256"] == over_sockets.states_sha256
    assert twin["faults"] == list(over_sockets.faults)


def test_a_short_mission_arrives_and_says_so():
    bench = InMemory(
        replace(FLAT, set=QUICK), [TimedCommand(0.5, "goto", {"x_m": 1.5, "y_m": 0.0})], step_ns=CAMPAIGN_STEP_NS
    )
    where = []
    flight = bench.run(lambda tick, inputs, outputs, rover, state: where.append(state.position_m))
    assert flight.arrived and flight.error == "" and flight.contacts == ()
    assert math.dist(where[-1][:2], (1.5, 0.0)) < 0.1
    assert len(where) == flight.bench_s * 100
    assert [event.name for event in flight.events].count("ARRIVED") == 1
    assert flight.streams["lidar_to_onboard"]["bytes"] > 1e6


def test_an_order_is_answered_over_the_link_and_ends_the_run():
    flight = InMemory(FLAT, [TimedCommand(0.5, "status")]).run()
    (request,) = flight.requests
    assert request.state is RequestState.COMPLETED and request.history[0][0] == 500_000_000
    assert 0.5 <= flight.bench_s < 1.0
    assert not flight.arrived  # nobody asked it to go anywhere


def test_in_a_blackout_no_order_arrives_and_after_it_the_operator_asks_again():
    flight = InMemory(replace(FLAT, blackout_s=(0.4, 2.0)), [TimedCommand(0.5, "status")]).run()
    (request,) = flight.requests
    assert request.state is RequestState.COMPLETED
    assert 2.0 <= request.history[0][0] / 1e9 < 6.0


def test_orders_are_given_in_the_order_of_their_times():
    flight = InMemory(FLAT, [TimedCommand(0.6, "resume"), TimedCommand(0.4, "safe")]).run()
    assert [(r.telecommand.name, r.state) for r in flight.requests] == [
        ("safe", RequestState.COMPLETED),
        ("resume", RequestState.COMPLETED),
    ]


def test_an_order_that_is_no_command_is_refused_by_name():
    with pytest.raises(ValueError, match="goto: `y_m` is missing"):
        InMemory(FLAT, [TimedCommand(0.1, "goto", {"x_m": 1.0})]).run()


def test_the_observer_sees_each_tick_once_with_the_truth_of_its_time():
    bench, seen = InMemory(replace(FLAT, end_s=0.5), ()), []
    bench.run(lambda tick, inputs, outputs, rover, state: seen.append((tick, inputs.now_ns, state.now_ns, rover)))
    assert [row[0] for row in seen] == list(range(1, 51))
    assert all(now == truth == tick * TICK_NS for tick, now, truth, _ in seen)
    assert {rover.executive.mode for *_, rover in seen} == {Mode.STANDBY}


def test_a_killed_flight_program_sends_nothing_more():
    scenario = replace(FLAT, end_s=1.0, faults=(Injection("onboard_killed", after_s=0.5),))
    seen = []
    bench = InMemory(scenario, ())
    flight = bench.run(lambda tick, *_: seen.append((tick, bench.streams["can_to_nodes"].pieces)))
    assert seen[-1][0] == 50 and bench.rover is None
    assert flight.bench_s == 1.0
    assert all(wheel.timed_out for wheel in bench.nodes.wheels)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others():
    def hashes(seed):
        flight = InMemory(replace(FLAT, seed=seed, end_s=1.0), ()).run()
        return flight.streams, flight.states_sha256

    assert hashes(1) == hashes(1)
    assert hashes(1)[0]["can_to_onboard"]["sha256"] != hashes(2)[0]["can_to_onboard"]["sha256"]


def test_a_rover_that_leaves_the_field_ends_the_run_with_a_reason():
    bench = InMemory(replace(FLAT, end_s=5.0), ())
    bench.plant.field = replace(bench.field, grid=replace(bench.field.grid, x0_m=-0.2))  # the fence moves to the rover
    flight = bench.run()
    assert "from the field's edge" in flight.error and flight.bench_s < 0.1


def test_the_default_order_is_the_field_s_goal_in_millimetres():
    bench = InMemory(FLAT)
    (order,) = goto(bench.field)
    assert (order.name, order.arguments) == ("goto", {"x_m": 5.0, "y_m": 0.5})
    bench.free()
