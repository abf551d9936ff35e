"""The two drives give the same bits, and each record replays on both processors."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from onboard.record.made_by import versions
from onboard.record.reader import open_record
from tests.pretended import environment

FOLDER = Path(os.environ["EL_DORADO_ARM64"])
PYTHONS = {"here": Path(sys.executable), "there": FOLDER / "venv/bin/python"}
MACHINES = {"here": os.uname().machine, "there": "aarch64"}


def record(drive):
    return FOLDER / "work" / drive / "onboard.mcap"


def certificate(drive):
    return json.loads((FOLDER / "work" / drive / "certificate.json").read_text())


@pytest.mark.parametrize("drive", MACHINES)
def test_each_record_names_the_processor_that_flew(drive):
    assert versions(open_record(record(drive)).attachments)["machine"] == MACHINES[drive]


def test_the_wheels_turned():
    assert certificate("there")["channels"]["can_to_nodes"]["pieces"] > 100


def test_every_channel_and_the_plant_have_the_same_bits_on_both_processors():
    here, there = certificate("here"), certificate("there")
    assert there["channels"] == here["channels"]
    assert there["plant"] == here["plant"]


@pytest.mark.parametrize("drive", MACHINES)
@pytest.mark.parametrize("processor", PYTHONS)
def test_each_record_replays_identical_on_both_processors(drive, processor):
    command = [PYTHONS[processor], "-m", "onboard", "replay", record(drive)]
    done = subprocess.run(command, cwd=FOLDER, env=environment({}), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.split(":")[0]) == (0, "identical"), done.stdout + done.stderr
