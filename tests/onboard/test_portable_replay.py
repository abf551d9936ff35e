"""A record replays on any processor: one record under pretended ones, each in a process of its own.

One row with all of it in the fast suite, every row by itself with the missions.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from hil.bench.in_memory import CAMPAIGN_STEP_NS, InMemory
from hil.bench.operator import Order
from hil.scenario.scenario import Scenario
from onboard.native.variant import FORCED_BY, available

ROOT = Path(__file__).parents[2]
SCENARIO = Scenario(terrain="fbm", seed=4, link="lan", set={  # a scan in 15 s, a short way
    "scanning.start_rad": 1.05, "scanning.end_rad": -0.1, "scanning.spacing_m": 0.15, "scanning.floor_rad": 0.006,
    "scanning.cap_rad": 0.03, "scanning.range_m": 6.0, "mapping.size_m": 14.0, "mapping.near_m": 3.0,
    "drive_guard.on": True,
})  # fmt: skip
PLAIN_LIBRARY = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA"}
PLAIN_NUMPY = {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"}
WIDE = "avx512" in available()  # BLAS built for what the machine lacks would end the process
CORES = ("Prescott", "Sandybridge", "Haswell", *(("SkylakeX",) if WIDE else ()))
ROWS = {
    "as it is": {},
    "C library without FMA and AVX2": PLAIN_LIBRARY,
    "numpy of the oldest machine": PLAIN_NUMPY,
    "numpy without AVX-512": {"NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"},
    **{f"BLAS for {core}": {"OPENBLAS_CORETYPE": core} for core in CORES},
    **{f"kernels for {variant}": {FORCED_BY: variant} for variant in available()},
    "BLAS with two threads": {"OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"},
    "another hash seed": {"PYTHONHASHSEED": "4242"},
}
OLDEST = {**PLAIN_LIBRARY, **PLAIN_NUMPY, "OPENBLAS_CORETYPE": "Prescott", "OPENBLAS_NUM_THREADS": "2",
          "PYTHONHASHSEED": "4242", FORCED_BY: "baseline"}  # fmt: skip
OWN = {name for row in (*ROWS.values(), OLDEST) for name in row}


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """A scan; then a mission: a scan ahead that registers to it, one behind, a plan, a short drive under the guard."""
    path = tmp_path_factory.mktemp("record") / "onboard.mcap"
    orders = [Order(0.5, "scan"), Order(9.5, "goto", {"x_m": 1.5, "y_m": 0.0})]
    bench = InMemory(SCENARIO, orders, step_ns=CAMPAIGN_STEP_NS, record=path)
    kinds, registered = set(), []

    def observe(tick, inputs, outputs, rover, state):
        kinds.update(request.name for request in outputs.jobs)
        registered.extend(event.text for event in outputs.events if event.name == "REGISTERED")

    flight = bench.run(observe)
    assert flight.error == ""
    assert {"look", "remember", "plan", "guard_listen"} <= kinds and registered
    return path


def replayed(record, row, at=0):
    """What a replay says with these variables, and none of the others."""
    environment = {name: text for name, text in os.environ.items() if name not in OWN} | row
    words = [sys.executable, "-W", "ignore", "-m", "tests.onboard.replayed", str(record), str(at)]
    told = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert told.returncode == 0, told.stderr
    return json.loads(told.stdout)


def first_item(record, row, tick):
    """The first item of state that is another with these variables, in words."""
    ours, theirs = (replayed(record, variables, tick)["items"] for variables in ({}, row))
    pairs = [(part, k, a, b) for part in ours for k, (a, b) in enumerate(zip(ours[part], theirs[part], strict=True))]
    return next(
        (f"{part}[{k}]: {float.fromhex(a)!r}, here {float.fromhex(b)!r}" for part, k, a, b in pairs if a != b), ""
    )


def check(record, row):
    """Identical; else which item of state is another, and when."""
    told = replayed(record, row)
    if tick := re.match(r"tick (\d+), channel /out/tick", told["difference"]):
        pytest.fail(f"{told['difference']}; {first_item(record, row, int(tick[1]))}")
    assert told["identical"], told["difference"]
    return told


def test_a_record_replays_on_the_oldest_processor(record):
    here, there = check(record, {}), check(record, OLDEST)
    assert there["asked"] == here["asked"]  # numpy's own sums
    if there["not asked"] == here["not asked"]:
        pytest.skip("this machine cannot pretend to be another")


@pytest.mark.mission
@pytest.mark.parametrize("name", ROWS)
def test_a_record_replays_on_every_pretended_processor(record, name):
    check(record, ROWS[name])


def test_a_difference_names_the_first_item_of_state(record, tmp_path, monkeypatch):
    """The state after a tick in two runs, one number of it changed."""
    tick = 5
    here = replayed(record, {}, tick)["items"]
    there = {**here, "nodes": [*here["nodes"][:2], (1.5).hex(), *here["nodes"][3:]]}
    answers = iter([{"items": here}, {"items": there}])
    monkeypatch.setattr(sys.modules[__name__], "replayed", lambda *_: next(answers))
    assert first_item(record, {}, tick).startswith("nodes[2]: ")
