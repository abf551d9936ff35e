"""Faults of sensor and cable by schedule: each does what its row says, and only while it is on."""

from types import SimpleNamespace

import numpy as np
import pytest

from hil.devices.lidar.faults import KINDS, ScheduledFault, load_faults, parse_fault
from hil.devices.lidar.profile import IDEAL, PROFILES
from hil.devices.lidar.sensor import Lidar
from hil.faults.injection import INJECTIONS
from onboard.config import ConfigError
from protocol import WireError, scip

MS = 1_000_000
ALL = scip.ScanRequest("MD", 0, 1080)


def run(*faults, until_ms=1000, asked=b"MD0000108001000\n", seed=7):
    """Pieces of a stream of 5 m from the start on."""
    sensor = Lidar(seed, lambda times_ns: np.full(len(times_ns), 5.0), IDEAL, faults)
    sensor.connect()
    sensor.receive(asked, 0)
    sensor.step(until_ms * MS)
    return sensor, sensor.pieces()


def joined(pieces):
    return b"".join(piece.data for piece in pieces)


def scans(pieces):
    frames = joined(pieces).split(b"\n\n")[1:-1]
    return [scip.parse_scan(scip.parse_reply(frame), ALL) for frame in frames]


_, CLEAN = run()


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_a_fault_begins_and_ends_on_time_and_repeats_with_its_seed(kind):
    fault = ScheduledFault(kind, 0.3, 0.4)
    _, one = run(fault)
    _, two = run(fault)
    _, other = run(fault, seed=8)
    assert one == two != other
    before = [piece for piece in CLEAN if piece.at_ns < 300 * MS]
    assert one[: len(before)] == before
    assert (one == CLEAN) is (kind in ("cable", "refuse"))  # for the cable's owner; only requests


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"fail", "drill", "reboot", "cable", "jump"}))
def test_what_follows_a_healed_fault_is_whole(kind):
    _, pieces = run(ScheduledFault(kind, 0.3, 0.2))
    late = [piece for piece in pieces if piece.at_ns > 610 * MS]
    begins = next(k for k, piece in enumerate(late) if piece.begins)
    frames = joined(late[begins:]).split(b"\n\n")[:-1]
    assert len(frames) >= 14 and all(len(scip.parse_scan(scip.parse_reply(f), ALL).values) == 1081 for f in frames)


@pytest.mark.parametrize(("kind", "sign"), [("flip", 0), ("lose", -1), ("double", 1)])
def test_share_of_damaged_bytes(kind, sign):
    _, pieces = run(ScheduledFault(kind, 0.0, value="0.01"))
    clean, dirty = joined(CLEAN), joined(pieces)
    assert len(dirty) - len(clean) == pytest.approx(sign * 0.01 * len(clean), rel=0.15)
    if kind == "flip":
        differ = [(a ^ b).bit_count() for a, b in zip(clean, dirty) if a != b]
        assert set(differ) == {1} and len(differ) == pytest.approx(0.01 * len(clean), rel=0.15)


def test_garbage_comes_before_each_reply():
    _, pieces = run(ScheduledFault("garbage", 0.0, value="40"))
    assert [len(piece.data) - len(whole.data) for piece, whole in zip(pieces, CLEAN, strict=True)] == [40] * len(CLEAN)
    assert all(piece.data.endswith(whole.data) for piece, whole in zip(pieces, CLEAN, strict=True))


def test_split_and_merged_pieces_hold_the_same_bytes():
    _, split = run(ScheduledFault("split", 0.0, value="7"))
    assert joined(split) == joined(CLEAN) and max(len(piece.data) for piece in split) == 7
    assert sum(piece.begins for piece in split) == len(CLEAN)
    _, merged = run(ScheduledFault("merge", 0.0, value="100"))
    assert joined(CLEAN).startswith(joined(merged)) and {piece.at_ns % (100 * MS) for piece in merged} == {0}


def test_slow_and_stalled_replies():
    _, slow = run(ScheduledFault("slow", 0.0, value="300"))
    assert [piece.at_ns for piece in slow] == [piece.at_ns + 300 * MS for piece in CLEAN[: len(slow)]]
    sensor, stalled = run(ScheduledFault("stall", 0.3))
    sensor.step(2000 * MS)
    assert sensor.pieces() == [] and len(stalled) < len(CLEAN)


def test_cable_is_for_its_owner_to_pull():
    sensor, _ = run(ScheduledFault("cable", 0.3, 0.2), until_ms=400)
    assert not sensor.reachable
    sensor.step(501 * MS)
    assert sensor.reachable


def test_repeated_stamps_and_jumps():
    _, pieces = run(ScheduledFault("stamp", 0.3, 0.2))
    steps = np.diff([scan.stamp_ms for scan in scans(pieces)])
    assert (steps == 0).sum() == 7 and steps.sum() == 25 * len(steps)  # the first of 8 is repeated
    _, pieces = run(ScheduledFault("jump", 0.3, value="-100"))
    assert sorted(np.diff([scan.stamp_ms for scan in scans(pieces)]))[:2] == [-75, 25]


def test_a_wrong_echo_is_one_that_looks_right():
    _, pieces = run(ScheduledFault("echo", 0.0))
    frame = joined(pieces).split(b"\n\n")[1]
    assert frame.startswith(b"MD0001108001000\n99b\n")
    with pytest.raises(WireError, match="echo"):
        scip.parse_scan(scip.parse_reply(frame), ALL)


def test_semicolon_sums_are_legal_and_cost_at_most_63_mm():
    _, pieces = run(ScheduledFault("semicolon", 0.0))
    frame = joined(pieces).split(b"\n\n")[1]
    assert all(line.endswith(b";") for line in frame.split(b"\n")[3:])
    for made, clean in zip(scans(pieces), scans(CLEAN), strict=True):
        assert 0 < np.abs(made.values - clean.values).max() <= 63 and (made.values != clean.values).sum() <= 51


def test_dust_and_other_sensors_light():
    _, pieces = run(ScheduledFault("dust", 0.0, value="0.5"), ScheduledFault("clash", 0.0, value="0.2"))
    values = np.array([scan.values for scan in scans(pieces)])
    assert (values == 3).mean() == pytest.approx(0.2, abs=0.01)
    assert (values == 1).mean() == pytest.approx(0.4, abs=0.015)


def test_a_fault_leaves_the_noise_alone():
    _, pieces = run(ScheduledFault("garbage", 0.0), ScheduledFault("echo", 0.0, 0.5))
    assert joined(pieces).endswith(CLEAN[-1].data)


# -- how they are asked for ------------------------------------------------------------------------------------


def test_text_and_file_give_the_same_rows(tmp_path):
    path = tmp_path / "faults.toml"
    first, second = 'kind = "flip"\nat_s = 10\nfor_s = 5\nvalue = 0.001\n', 'kind = "reboot"\nat_s = 20.0\n'
    path.write_text(f"[[fault]]\n{first}[[fault]]\n{second}")
    assert load_faults(path) == (parse_fault("flip=0.001@10+5"), parse_fault("reboot@20"))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("flip", "should look like"),
        ("flop@3", "'flop' should be one of cable, clash"),
        ("flip=x@3", "flip=x should be a number"),
        ("flip=-1@3", "should be a number"),
        ("refuse=99@3", "should be 0A or 0B or 0I or 0M"),
        ("flip@-1", "should look like"),
    ],
)
def test_a_wrong_fault_says_what_is_allowed(text, says):
    with pytest.raises(ConfigError, match=says):
        parse_fault(text)


@pytest.mark.parametrize(
    ("text", "says"),
    [("[[fault]", "not valid TOML"), ("[[faults]]", "tables"), ("fault = 3", "tables"), ("[[fault]]\nat = 3", "at_s")],
)
def test_a_wrong_file_says_where(tmp_path, text, says):
    path = tmp_path / "faults.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=f"faults.toml.*{says}"):
        load_faults(path)


@pytest.mark.parametrize("name", PROFILES)
def test_every_profile_repeats_with_its_seed_under_all_faults_at_once(name):
    def record(seed):
        faults = [ScheduledFault(kind, 0.1 * k, 1.5) for k, kind in enumerate(sorted(KINDS))]
        sensor = Lidar(seed, lambda times_ns: np.linspace(0.05, 31, len(times_ns)), PROFILES[name], tuple(faults))
        sensor.connect()
        out = []
        for tick in range(600):
            if tick % 40 == 0:
                sensor.receive(b"QT\nII\nBM\nGE0000108001\nMD0000108001000\n", tick * 10 * MS)
            sensor.step(tick * 10 * MS)
            out += sensor.pieces()
        return out

    assert record(3) == record(3) != record(4)


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"cable"}))
def test_the_bench_injects_each_fault_by_the_same_table(kind):
    sensor, _ = run(until_ms=200)
    twin, _ = run(ScheduledFault(kind, 0.2, 0.2), until_ms=200)
    bench, row = SimpleNamespace(lidar=sensor), INJECTIONS[f"lidar_{kind}"]
    row.begin(bench, None, 0)
    for device in (sensor, twin):
        device.step(399 * MS)
    assert sensor.faults.active == twin.faults.active
    row.heal(bench, None, 0)
    for device in (sensor, twin):
        device.step(1000 * MS)
    assert sensor.faults.active == twin.faults.active == {}
    assert sensor.machine.report == twin.machine.report
