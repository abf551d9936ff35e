"""The drive over vcan0 gives the same bits as over the bench's hub, and all of it is in a standard tool's log."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.vcan.inside import LAST, LOG

FOLDER = Path(os.environ["EL_DORADO_DRIVES"])
DBC = Path(__file__).parents[2] / "protocol" / "rover.dbc"
LINE = re.compile(r"\((\d+\.\d{6})\) vcan0 ([0-9A-F]{3})#([0-9A-F]*)")


def certificate(drive):
    return json.loads((FOLDER / drive / "certificate.json").read_text())


def crc8_j1850(data):
    """Bit by bit, from the design: polynomial 0x1D, begun with 0xFF, inverted at the end."""
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ (0x1D if crc & 0x80 else 0)) & 0xFF
    return crc ^ 0xFF


@pytest.fixture(scope="module")
def lines():
    whole = (FOLDER / LOG).read_text().splitlines()
    assert LINE.match(whole[-1])[2] == f"{LAST:03X}"
    return whole[:-1]


@pytest.fixture(scope="module")
def decoded(lines):
    """(frame, {signal: value}) of each line by the command of cantools."""
    command = [sys.executable, "-m", "cantools", "decode", "--single-line", str(DBC)]
    done = subprocess.run(command, input="\n".join(lines), capture_output=True, text=True, check=True)
    found = []
    for line in done.stdout.splitlines():
        name, signals = re.search(r":: (\w+)\((.*)\)$", line).groups()
        found.append((name, dict(re.findall(r"(\w+): ([^,]+)", signals))))
    return found


def test_the_wheels_turned(decoded):
    rates = [float(signals["rate_radps"].split()[0]) for name, signals in decoded if name == "WHEEL_1_FEEDBACK"]
    assert max(map(abs, rates)) > 0.5


def test_every_channel_and_the_plant_have_the_same_bits_over_both_buses():
    hub, real = certificate("hub"), certificate("real")
    assert real["channels"] == hub["channels"]
    assert real["plant"] == hub["plant"]


def test_the_record_of_the_drive_over_vcan0_replays_to_the_byte():
    command = [sys.executable, "-m", "onboard", "replay", str(FOLDER / "real" / "onboard.mcap")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.split(":")[0]) == (0, "identical"), done.stdout + done.stderr


def test_candump_saw_every_frame_that_the_bench_counted_and_then_the_wheels_told_to_stand(lines, decoded):
    channels = certificate("real")["channels"]
    farewell = decoded[channels["can_to_onboard"]["pieces"] + channels["can_to_nodes"]["pieces"] :]
    assert [name for name, _ in farewell] == [f"WHEEL_{n}_COMMAND" for n in (1, 2, 3, 4)]
    assert all(float(signals["rate_radps"].split()[0]) == 0.0 for _, signals in farewell)


def test_every_frame_that_candump_saw_has_a_good_crc(lines):
    for line in lines:
        can_id, data = int(LINE.match(line)[2], 16), bytes.fromhex(LINE.match(line)[3])
        assert data[7] == crc8_j1850(can_id.to_bytes(2, "big") + data[:7]), line


def test_cantools_names_every_frame_and_its_signals(lines, decoded):
    assert len(decoded) == len(lines)
    names = {name for name, _ in decoded}
    assert {"TIME_SYNC", "DRIVE_ENABLE", "WHEEL_1_COMMAND", "WHEEL_4_FEEDBACK", "TILT_FEEDBACK", "IMU_GYRO"} <= names
    assert all({"counter", "crc"} <= signals.keys() for _, signals in decoded)
