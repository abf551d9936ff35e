"""Any processor flies the same bytes and replays the same record: one short mission, then again under pretended ones.

All with the missions: the oldest processor, which pretends every row at once, and every row by itself.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from onboard.native.variant import available
from tests.hil.flown import flown, told
from tests.pretended import OLDEST, ROWS, environment

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """Record and hashes of a short mission that asks for every kind of job."""
    path = tmp_path_factory.mktemp("record") / "onboard.mcap"
    kinds, registered = set(), []

    def observe(tick, inputs, outputs, rover, state):
        kinds.update(request.name for request in outputs.jobs)
        registered.extend(event.text for event in outputs.events if event.name == "REGISTERED")

    flight = flown(path, observe)
    assert flight.error == ""
    assert {"look", "remember", "plan", "guard_listen"} <= kinds and registered
    return path, told(flight)


@pytest.fixture(scope="module")
def record(here):
    return here[0]


def asked(module, row, *words):
    """What a program of the tests prints in a process with these variables, and none of the other rows'."""
    words = [sys.executable, "-W", "ignore", "-m", module, *words]
    done = subprocess.run(words, cwd=ROOT, env=environment(row), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def check(record, row):
    """Identical; else tick, channel and which item of state is another (onboard.record.state_checks)."""
    verdict = asked("tests.onboard.replayed", row, str(record))
    assert verdict["identical"], verdict["difference"]
    return verdict


@pytest.mark.mission
def test_a_record_replays_on_the_oldest_processor(record):
    here, there = check(record, {}), check(record, OLDEST)
    assert there["asked"] == here["asked"]  # numpy's own sums
    if there["not asked"] == here["not asked"]:
        pytest.skip("this machine cannot pretend to be another")


@pytest.mark.mission
@pytest.mark.parametrize("name", ROWS)
def test_a_record_replays_on_every_pretended_processor(record, name):
    check(record, ROWS[name])


@pytest.mark.mission
def test_the_oldest_processor_flies_the_same_bytes(here):
    assert asked("tests.hil.flown", OLDEST) == here[1]


@pytest.mark.mission
@pytest.mark.parametrize("name", ROWS)
def test_every_pretended_processor_flies_the_same_bytes(here, name):
    assert asked("tests.hil.flown", ROWS[name]) == here[1]


def test_the_rows_are_all_that_this_machine_can_pretend():
    cores = {"Prescott", "Sandybridge"} | {
        core for core, variant in (("Haswell", "avx2"), ("SkylakeX", "avx512")) if variant in available()
    }
    assert {name.removeprefix("BLAS for ") for name in ROWS if name.startswith("BLAS for ")} == cores
    assert {name.removeprefix("kernels for ") for name in ROWS if name.startswith("kernels for ")} == set(available())
    assert {
        "numpy with all features",
        "numpy without AVX-512",
        "numpy without AVX2",
        "C library without FMA and AVX2",
        "BLAS with one thread",
        "BLAS with two threads",
        "another hash seed",
    } <= set(ROWS)
