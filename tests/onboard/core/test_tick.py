"""The core is a function of its inputs: the same bytes in give the same bytes out, whatever the clock or hash seed."""

import hashlib
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from onboard.core.tick import farewell
from onboard.records import Frame, LinkMessage
from protocol.generated.can_codec import WheelMode
from protocol.link.datagrams import DatagramKind
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode, Phase
from tests.onboard.core_bench import STATION, CoreBench

ROOT = Path(__file__).parents[3]


def short_mission():
    """Two scans, two maps, a plan, a second of driving and a product; digests of each tick."""
    rover = CoreBench()
    rover.settle()
    rover.goto(3.0, 0.5)
    rover.until_driving()
    rover.order("get", product="ldem")
    rover.order("status")
    rover.run(1.0)
    assert rover.phase is Phase.DRIVING
    return rover.digests


@pytest.fixture(scope="module")
def reference():
    return short_mission()


def test_the_same_inputs_give_the_same_outputs_byte_for_byte(reference):
    assert len(set(reference)) == len(reference) > 2500
    assert short_mission() == reference


def test_the_hash_seed_of_python_changes_no_byte(reference):
    hash_seed = "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"  # other than the one of this process
    script = "import hashlib, test_tick; print(hashlib.sha256(b''.join(test_tick.short_mission())).hexdigest())"
    paths = os.pathsep.join((str(ROOT), str(Path(__file__).parent)))
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "PYTHONPATH": paths}
    told = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False)
    assert told.stdout.strip() == hashlib.sha256(b"".join(reference)).hexdigest(), told.stderr


def test_no_output_depends_on_the_wall_clock(reference, monkeypatch):
    times = iter(range(10**9, 10**10, 12345))
    for name in ("time", "time_ns", "monotonic", "monotonic_ns", "perf_counter", "perf_counter_ns", "process_time"):
        monkeypatch.setattr(time, name, lambda: next(times))
    assert short_mission() == reference


def test_noise_on_the_bus_and_the_link_is_counted_and_changes_no_decision():
    rng = np.random.default_rng(5)
    rover = CoreBench()
    rover.settle()
    request = rover.goto(3.0, 0.5)
    for _ in range(300):
        length, can_id = int(rng.integers(0, 9)), int(rng.integers(0x30, 0x7FF))
        rover.noise = (Frame(can_id, rng.bytes(length), rover.now_ns),)
        rover.hear(LinkMessage(rover.now_ns, False, "tag", 0, 0, b""))
        kind = int(rng.choice([*DatagramKind, 99]))
        rover.hear(LinkMessage(rover.now_ns, True, "ok", STATION + 1, kind, b"" if kind == 4 else rng.bytes(3)))
        rover.step()
    assert rover.rover.downlink.refused["tag"] == 300
    assert rover.told("LINK_REFUSED")[0][1].endswith("tag 1")
    assert rover.rover.nodes.bad_frames + rover.rover.nodes.unknown_frames == 300
    assert rover.mode is Mode.AUTONOMOUS
    assert rover.states(request) == [RequestState.STARTED]
    rover.until_driving()


def test_the_farewell_stops_the_wheels_and_the_stream():
    rover = CoreBench()
    rover.settle()
    rover.goto(3.0, 0.5)
    rover.until(lambda: rover.lidar.scans > 5, 20.0)
    now_ns = rover.now_ns + 5_000_000  # at any time, also between two releases of the wheels' orders
    last = farewell(rover.rover, now_ns)
    rover._deliver(last, now_ns)
    assert [rover.ordered[n].mode for n in (1, 2, 3, 4)] == [WheelMode.HOLD] * 4
    assert rover.rates == [0.0] * 4
    assert b"QT" in last.lidar_bytes
