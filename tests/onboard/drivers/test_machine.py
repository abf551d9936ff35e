"""What the flight program reads of its computer: the system's own figures, once a second, and NaN where it has none."""

import math
import os
from pathlib import Path

import pytest

from onboard.drivers.platform.load import LOOK_NS, Probe, folders_written
from onboard.record.schema import decode_inputs, encode_inputs
from onboard.records import Inputs, Machine

STAT = "cpu  {user} 0 100 {idle} 50 0 0 0 7 7\ncpu0 1 2 3 4\n"


def write(root, user, idle, own):
    (root / "proc/self").mkdir(parents=True, exist_ok=True)
    (root / "proc/stat").write_text(STAT.format(user=user, idle=idle))
    (root / "proc/self/stat").write_text(f"42 (a (b) c) S 1 1 1 0 -1 0 0 0 0 0 {own} 5 0 0 20 0 1 0\n")
    (root / "proc/self/statm").write_text("90000 25600 500 1 0 800 0\n")
    (root / "proc/meminfo").write_text("MemTotal:  4000000 kB\nMemFree:  1 kB\nMemAvailable:  1500000 kB\n")


def sensor(root, zone, text):
    folder = root / f"sys/class/thermal/thermal_zone{zone}"
    folder.mkdir(parents=True)
    (folder / "temp").write_text(text)


def test_shares_are_of_the_time_between_two_looks(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    write(tmp_path, user=1000, idle=2000, own=10)
    sensor(tmp_path, 0, "41000\n")
    sensor(tmp_path, 1, "58500\n")
    sensor(tmp_path, 2, "asleep\n")
    probe = Probe([tmp_path], tmp_path)
    probe.look(0)
    first = probe.take()
    assert math.isnan(first.cpu_ratio) and math.isnan(first.process_ratio)
    write(tmp_path, user=1100, idle=2300, own=60)  # 400 ticks of all cores, 300 of them idle, 50 ours
    probe.look(LOOK_NS)
    seen = probe.take()
    assert (seen.cpu_ratio, seen.process_ratio) == (0.25, 0.5)
    assert seen.rss_bytes == 25600 * os.sysconf("SC_PAGE_SIZE")
    assert (seen.free_memory_bytes, seen.temperature_c) == (1_500_000 * 1024, 58.5)


def test_it_looks_once_a_second_and_what_it_saw_is_given_once(tmp_path):
    probe = Probe([tmp_path])
    taken = []
    for now_ns in range(0, 3 * LOOK_NS, LOOK_NS // 100):
        probe.look(now_ns)
        taken.append(probe.take())
    assert [k for k, machine in enumerate(taken) if machine] == [0, 100, 200]


def test_a_system_that_says_nothing_gives_nan_in_every_row(tmp_path):
    probe = Probe([tmp_path / "gone"], tmp_path)
    probe.look(0)
    assert all(map(math.isnan, probe.take()))


def test_of_this_system_it_reads_what_the_system_says_elsewhere(tmp_path):
    probe = Probe([tmp_path])
    probe.look(0)
    seen = probe.take()
    status = Path("/proc/self/status").read_text()
    rss_kb = int(next(row for row in status.splitlines() if row.startswith("VmRSS:")).split()[1])
    assert seen.rss_bytes == pytest.approx(rss_kb * 1024, abs=4e6)
    disk = os.statvfs(tmp_path)
    assert seen.free_disk_bytes == pytest.approx(disk.f_bavail * disk.f_frsize, rel=0.2)


def test_the_disks_are_those_of_what_is_written_though_it_is_not_there_yet(tmp_path):
    (tmp_path / "map").mkdir()
    wanted = (str(tmp_path / "map"), "", str(tmp_path / "state" / "deep"))
    assert folders_written(wanted) == (tmp_path / "map", tmp_path)
    assert folders_written(("", "")) == ()


def test_what_the_computer_does_not_say_comes_back_from_the_record_to_the_bit():
    machine = Machine(math.nan, 0.1, 2e8, math.nan, math.nan, 1e10)
    messages = encode_inputs(Inputs(7, 70, machine=machine))
    read, _ = decode_inputs(messages)
    assert encode_inputs(read) == messages
    assert "/in/machine" not in encode_inputs(Inputs(7, 70))
