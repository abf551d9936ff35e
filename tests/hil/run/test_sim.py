"""`hil sim` with an operator at its station: real processes in real time."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hil.run.run import keep_record

ROOT = Path(__file__).parents[3]
NOT_YET = (66, 69, 75)  # the station's exit codes while the simulation comes up: no file, no endpoint, no answer


@pytest.fixture
def sim(tmp_path):
    """A simulation on flat ground, and `ask(words)` for the station's answers as one text of JSON lines."""
    words = [sys.executable, "-m", "hil", "sim", "--terrain", "flat", "--out", str(tmp_path)]
    process = subprocess.Popen(words, cwd=ROOT, stderr=subprocess.PIPE, text=True, start_new_session=True)

    def ask(*order):
        asked = [sys.executable, "-m", "ground", *order, "--station", str(tmp_path / "ground.toml"), "--timeout", "100"]
        while True:
            told = subprocess.run([*asked, "--json"], cwd=ROOT, capture_output=True, text=True, timeout=150)
            if told.returncode not in NOT_YET or process.poll() is not None:
                assert told.returncode == 0, told.stderr + process.communicate(timeout=30)[1]
                return [json.loads(line) for line in told.stdout.splitlines()]

    process.ask, process.folder = ask, tmp_path
    yield process
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=300)
    assert process.returncode == 0, said
    lines = said.splitlines()
    at = lines.index("hil: ended by Ctrl-C; all processes are gone")
    assert lines[at + 1 : at + 3] == ["contacts: none", f"record: {tmp_path / 'onboard.mcap'}"]
    assert (tmp_path / "report.html").is_file(), said


def test_the_record_of_a_start_that_has_ended_is_kept_with_all_its_parts(tmp_path):
    for text in ("first", "second"):
        for name in ("onboard.mcap", "onboard.2.mcap"):
            (tmp_path / name).write_text(text)
        keep_record(tmp_path)
    kept = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert kept == {
        "onboard-boot1.mcap": "first",
        "onboard-boot1.2.mcap": "first",
        "onboard-boot2.mcap": "second",
        "onboard-boot2.2.mcap": "second",
    }


@pytest.mark.mission
def test_a_rover_that_is_rebooted_comes_up_again_with_what_was_saved(sim):
    sim.ask("param", "set", "drive_guard.on", "true")
    sim.ask("param", "save")
    sim.ask("reboot", "--yes")
    told = [str(row["text"]) for row in sim.ask("param", "get", "drive_guard.on") if "text" in row]
    assert any("drive_guard.on = true" in text for text in told), told
    assert sim.poll() is None
    assert (sim.folder / "onboard-boot1.mcap").is_file() and (sim.folder / "onboard.mcap").is_file()
