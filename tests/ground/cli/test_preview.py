"""`ground preview goto`: the rover's own planner on the map that was fetched, and what is said of its limits."""

import json
from dataclasses import replace

import numpy as np
import pytest

from ground.__main__ import run
from ground.archive.store import Archive
from ground.products.preview import READ
from ground.station.station import StationError
from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory
from hil.scenarios.model import Scenario, flight_settings
from hil.world.operator import TimedCommand
from onboard.config import load
from onboard.config_text import to_toml
from onboard.parameters import TABLE as PARAMETERS
from onboard.parameters import ParameterSet, listing
from onboard.planning.prediction import digest, predict
from protocol.link import bulk
from protocol.link.datagrams import DatagramKind, bench_keys, payload_limit
from protocol.products import LDEM_CODEC, LdemProduct, MapGrid, encode_ldem
from protocol.products.pose_map import PoseMap, encode_poses
from tests.ground.gateway_bed import GatewayRover
from tests.ground.virtual_station import VirtualClock, VirtualStation

QUICK = {  # a scan in 6 s
    "scanning.start_rad": 1.05, "scanning.end_rad": -0.1, "scanning.spacing_m": 0.15, "scanning.floor_rad": 0.006,
    "scanning.cap_rad": 0.03, "scanning.range_m": 6.0, "mapping.size_m": 14.0, "mapping.near_m": 3.0,
}  # fmt: skip
GRID = MapGrid(-4.95, -4.95, 0.1, 100, 100)


def flat(blocked=np.s_[0:0, 0:0], known=True, settings=None, pose=(0.0, 0.0, 0.0)):
    """A map of level ground as the product's bytes; the cells `blocked` can be stood on by nobody."""
    freedom = np.full((8, 100, 100), 2, np.uint8)
    freedom[:, *blocked] = 0
    sets = np.where(freedom.any(axis=0), 3, 2).astype(np.uint8)
    poses = PoseMap(freedom, pose, known=known, settings=digest(load()) if settings is None else settings)
    return encode_ldem(LdemProduct(GRID, np.zeros((100, 100), np.float32), sets)) + encode_poses(poses)


def no_link(*_):
    raise StationError("no link at tcp/127.0.0.1:7448: nobody is there")


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """Puts products into an archive of a station, which is where the command looks."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ground.toml").write_text("bench_seed = 7\narchive = 'archive.db'\n")
    monkeypatch.setattr("ground.cli.operations.operate.Station", no_link)

    def put(*data, name="ldem", codec=LDEM_CODEC, items=()):
        with Archive(tmp_path / "archive.db", utc_ns=10**18) as archive:
            for n, one in enumerate(data):
                archive.add("products", n, n, name, codec, one)
            for item, value in items:
                archive.add("items", 10**9, 10**9, item, value, 1)
        return tmp_path

    return put


def told(capsys, *argv):
    code = run(["preview", "goto", *argv])
    streams = capsys.readouterr()
    assert "Traceback" not in streams.err
    return code, streams.out, streams.err


@pytest.mark.mission
def test_the_previewed_path_is_the_one_that_the_rover_then_reports(kept, capsys):
    """Scan, get ldem, preview on the ground; then the goto is given, and its answer is that path, to the millimetre."""
    scenario = Scenario(terrain="fbm", seed=3, link="lan", set=QUICK)
    orders = [
        TimedCommand(0.5, "scan"),
        TimedCommand(9.5, "get", {"product": "ldem"}),
        TimedCommand(11.0, "goto", {"x_m": 2.5, "y_m": 0.7}),
    ]
    bench, receiver, got = InMemory(scenario, orders, step_ns=CAMPAIGN_STEP_NS), bulk.Receiver(payload_limit(1e9)), {}
    while "way" not in got and bench.tick < 2500:
        bench.step(
            lambda tick, inputs, outputs, *_: [
                got.update({product.name: product})
                for kind, payload in outputs.link_payloads
                if kind == DatagramKind.BULK_CHUNK and (product := receiver.receive(payload, inputs.now_ns)) is not None
            ]
        )
    start, orbit = bench.start, bench.field.gdem
    bench.free()
    folder = kept(got["ldem"].data)
    (folder / "rover.toml").write_text(to_toml(load(None, flight_settings(scenario, start))))
    code, out, err = told(capsys, "2.5", "0.7", "--config", "rover.toml", "--json")
    way, preview = json.loads(got["way"].data), json.loads(out)
    assert (code, err) == (0, "")
    same = ("kind", "rule", "reason", "path", "beyond", "length_m", "time_s", "looks")
    assert {key: preview[key] for key in same} == {key: way[key] for key in same}
    assert len(way["path"]) >= 2 and 2.4 < way["length_m"] < 6.0
    assert orbit is not None  # the goal lies on the map: the orbiter's is not asked


def test_a_way_round_an_obstacle_is_longer_than_the_straight_one_and_drawn(kept, capsys):
    folder = kept(flat(), flat(np.s_[20:70, 60:66]))
    code, out, err = told(capsys, "3", "0", "--out", "way.png")
    assert code == 0 and err == "way.png written\n"
    assert "the newest map in" in out and "2001-09-09" in out
    length_m = float(out.split("predicted ")[1].split(" m")[0])
    assert 4.5 < length_m < 7.5
    assert (folder / "way.png").read_bytes().startswith(b"\x89PNG")


def test_no_way_is_exit_code_1_with_the_reason(kept, capsys):
    ring = np.zeros((100, 100), bool)
    ring[41:60, 60:78] = True  # within 3 m of the rover: what is blocked there is believed
    ring[47:53, 66:72] = False
    kept(flat(np.where(ring)))
    code, out, _ = told(capsys, "1.9", "0.05", "--json")
    tree = json.loads(out)
    assert (code, tree["kind"], tree["length_m"]) == (1, "unreachable", None)


def test_without_a_map_it_says_how_to_get_one(kept, capsys):
    assert told(capsys, "1", "0")[0] == 66
    kept()
    code, _, err = told(capsys, "1", "0")
    assert code == 66 and "no map yet; `ground scan`, then `ground get ldem`" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("data", "part"),
    [
        (b"LDM1", "damaged"),
        (flat()[:-3], "damaged"),
        (flat()[: flat().index(b"POS1")], "older program"),
    ],
)
def test_a_damaged_or_old_map_is_one_line_and_exit_code_65(kept, capsys, data, part):
    kept(data)
    code, _, err = told(capsys, "1", "0")
    assert code == 65 and part in err and err.count("\n") == 1


def test_what_makes_the_preview_worth_less_is_said(kept, capsys):
    kept(flat(known=False), items=(("x_m", 2.0), ("y_m", 0.0)))
    code, _, err = told(capsys, "30", "0")
    assert code == 0
    assert "the goal lies beyond the map" in err and "it will look behind as well" in err
    assert "the rover stands 2.0 m from where this map was made" in err


def test_other_settings_than_the_rovers_are_warned_of_until_they_were_fetched(kept, capsys):
    flown = load(None, {"motion.cruise_mps": 0.05})
    kept(flat(settings=digest(flown)))
    _, out, err = told(capsys, "3", "0")
    assert "flies other settings than the default settings" in err and "`ground param list` fetches them" in err
    assert "the rover's parameters were not fetched: no link at tcp/127.0.0.1:7448: nobody is there\n" in err
    assert "assumed are the defaults of rover, mapping, planning, mission, scanning, drive_guard, motion, jobs" in err
    kept(listing(ParameterSet(flown)).encode(), name="parameters", codec="text")
    _, later, err = told(capsys, "3", "0")
    assert err == ""
    assert float(later.split(" in ")[1].split(" s")[0]) > float(out.split(" in ")[1].split(" s")[0]) + 20


@pytest.fixture
def flying(kept, monkeypatch):
    """A rover that answers, and flies other settings than the default; what it was asked for."""
    flown = load(None, {"motion.cruise_mps": 0.05})
    kept(flat(settings=digest(flown)))
    station = VirtualStation()
    station.rover = GatewayRover(bench_keys(7))
    station.rover.settings = ParameterSet(flown)
    monkeypatch.setattr("ground.cli.operations.operate.Station", lambda *_: station)
    monkeypatch.setattr("ground.cli.operations.operate.WallClock", VirtualClock)
    return station.rover


def test_a_rover_that_answers_is_asked_for_its_parameters_and_it_is_said(flying, kept, capsys):
    _, out, err = told(capsys, "3", "0")
    assert flying.executed == ["param_list"]
    assert err == "ground: the rover's parameters were fetched from it just now\n"
    kept(listing(flying.settings).encode(), name="parameters", codec="text")
    assert told(capsys, "3", "0")[1:] == (out, "")  # known by now: not asked again
    assert flying.executed == ["param_list"]


def test_a_rover_whose_parameters_were_changed_since_they_were_fetched_is_asked_again(flying, kept, capsys):
    kept(listing(ParameterSet(load(None, {"motion.cruise_mps": 0.03}))).encode(), name="parameters", codec="text")
    assert told(capsys, "3", "0")[2] == "ground: the rover's parameters were fetched from it just now\n"


@pytest.mark.parametrize("argv", [["--no-fetch"], ["--config", "rover.toml"]])
def test_the_rover_is_not_asked_where_that_is_not_wanted(flying, capsys, tmp_path, argv):
    (tmp_path / "rover.toml").write_text(to_toml(load()))
    assert "flies other settings than" in told(capsys, "3", "0", *argv)[2] and flying.executed == []


def test_a_map_that_was_made_with_the_defaults_needs_no_parameters(flying, kept, capsys):
    kept(flat())
    assert told(capsys, "3", "0")[2] == "" and flying.executed == []


def test_parameters_of_a_program_that_knows_fewer_say_which_are_assumed(kept, capsys):
    kept(flat(settings=b"12345678"))
    listed = listing(ParameterSet(load())).splitlines()
    fewer = "\n".join(line for line in listed if "motion.cruise_mps" not in line and "link.lease_s" not in line)
    kept(fewer.encode(), name="parameters", codec="text")
    err = told(capsys, "3", "0")[2]
    assert "than the parameters that were fetched last with defaults assumed for motion.cruise_mps: the real" in err


def test_the_sections_that_are_named_as_assumed_are_those_of_the_digest():
    default = load()
    for name in PARAMETERS:
        section, _, key = name.partition(".")
        part = getattr(default, section)
        if isinstance(value := getattr(part, key), float):
            changed = replace(default, **{section: replace(part, **{key: value + 1e-9})})
            assert (digest(changed) != digest(default)) == (section in READ), name


def test_a_file_of_get_ldem_gives_the_same_as_the_archive(kept, capsys):
    from ground.products.files import ldem_arrays

    data = flat(np.s_[20:70, 60:66])
    folder = kept(data)
    (folder / "map.bin").write_bytes(data)
    np.savez_compressed(folder / "map.npz", **ldem_arrays(data))
    told_of = [
        json.loads(told(capsys, "3", "0", "--json", *more)[1])
        for more in ((), ("--map", "map.bin"), ("--map", "map.npz"))
    ]
    assert told_of[0]["path"] == told_of[1]["path"] == told_of[2]["path"]
    assert told(capsys, "3", "0", "--map", "none.npz")[0] == 66
    (folder / "bad.npz").write_bytes(b"x")
    assert told(capsys, "3", "0", "--map", "bad.npz")[0] == 65


def test_the_prediction_is_the_same_each_time_and_counts_looks_turns_and_way():
    from protocol.products import decode_ldem, poses_of

    data = flat()
    near, again, far = (
        predict(decode_ldem(data), poses_of(data), goal, None, load()) for goal in ((1.5, 0.0), (1.5, 0.0), (4.5, 0.0))
    )
    assert near.to_json() == again.to_json()
    assert (near.looks, far.looks) == (1, 2)  # farther than 2 m it looks again before it says arrived
    assert far.length_m == pytest.approx(4.5, abs=0.05)
    cruise_s = 3.0 / load().motion.cruise_mps
    unseen = predict(decode_ldem(data), replace_known(poses_of(data)), (1.5, 0.0), None, load())
    assert far.time_s - near.time_s > cruise_s and unseen.looks == near.looks + 1


def replace_known(poses):
    return poses._replace(known=False)


def test_an_archive_that_is_none_is_one_line(kept, capsys, tmp_path):
    (tmp_path / "archive.db").write_bytes(b"rubbish" * 1000)
    code, _, err = told(capsys, "1", "0")
    assert code == 65 and "damaged, or no archive" in err and err.count("\n") == 1
    assert (tmp_path / "archive.db").read_bytes().startswith(b"rubbish")
