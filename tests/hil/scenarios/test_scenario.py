"""A scenario file is right, or refused with file, key and help."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from hil.faults.injection import INJECTIONS, Injector, causes
from hil.faults.plan import Injection
from hil.scenarios.model import Scenario, ground_of, load_scenario, scenario_of
from hil.terrain import field_file
from hil.terrain.field import truth_height
from onboard.config import ConfigError

OWN = sorted((Path(__file__).parents[3] / "hil" / "scenarios" / "data").glob("*.toml"))


@pytest.mark.parametrize("path", OWN, ids=lambda p: p.stem)
def test_the_benchs_own_scenarios_are_named_as_their_files_and_their_faults_exist(path):
    scenario = load_scenario(path)
    assert scenario.name == path.stem
    assert scenario.about.endswith(".")
    Injector(scenario.faults)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("seed = 1\nterain = 'flat'", r"unknown key `terain`; did you mean `terrain`\?"),
        ("seed = 1\nterrain = 'mud'", r"should be one of fbm, craters, real, flat"),
        ("seed = 1\nterrain = 'ridg'", r"did you mean 'ridge'\?"),
        ("seed = 1\nterrain = 'no.npz'", r"no such file"),
        ("terrain = 'flat'", r"`seed` is missing"),
        ("start = [1.0]", r"`start` should be x, y in metres and yaw in degrees, found \[1.0\]"),
        ("goal = 3", r"`goal` should be x, y in metres, found 3"),
        ("[expect]\nraises = ['RAIN']", r"`expect.raises`: 'RAIN' is no row of the fault table"),
        ("seed = 0", r"out of range"),
        ("[[faults]]\nwhen = 'driving'", r"`faults.when` = 'driving' should be one of time, sweep, drive"),
        ("blackout_s = [1.0]", r"should be pairs of start and end"),
        ("[set]\nmapping.foldr = 'map'", r"\[set\]: unknown key `mapping.foldr`; did you mean `mapping.folder`\?"),
        ("[set]\nmaping.folder = 'map'", r"\[set\]: unknown key `maping`; did you mean `mapping`\?"),
        ("[set]\n'mission.guard' = 1", r"\[set\]: `mission.guard` should be bool, found 1"),
        ("[set]\nmapping = 1\n'mapping.folder' = 'map'", r"\[set\]: `mapping` should be a table, found 1"),
        ("set = 1", r"`set` should be a table, found 1"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, complaint):
    path = tmp_path / "s.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=complaint) as raised:
        load_scenario(path)
    assert str(path) in str(raised.value)


def test_an_unknown_fault_names_those_there_are(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text("seed = 1\n[[faults]]\nfault = 'rain'")
    with pytest.raises(ConfigError, match="lidar_unplugged"):
        Injector(load_scenario(path).faults)


@pytest.mark.parametrize(
    "text", ["[set]\nmapping.folder = 'a b'", "[set]\n'mapping.folder' = 'a b'", "[set.mapping]\nfolder = 'a b'"]
)
def test_a_setting_may_be_written_in_each_way_of_toml(tmp_path, text):
    path = tmp_path / "s.toml"
    path.write_text(f"seed = 1\n{text}")
    assert load_scenario(path).set == {"mapping.folder": "a b"}


def test_every_fault_of_the_bench_s_catalogue_that_the_rover_must_survive_has_a_scenario():
    flown = {fault.fault for path in OWN for fault in load_scenario(path).faults}
    alone = {  # one by one in tests/hil/devices/test_lidar_faults.py
        "lidar_split",
        "lidar_merge",
        "lidar_semicolon",
        "lidar_double",
        "lidar_lose",
        "lidar_stamp",
        "lidar_echo",
        "lidar_clash",
        "lidar_fail",
        "lidar_unstable",
        "lidar_refuse",
        "lidar_drill",
    }
    assert set(INJECTIONS) - alone == flown


def test_a_start_in_a_rock_a_goal_beside_the_ground_and_a_torn_file_are_named(tmp_path):
    beside = replace(Scenario(terrain="flat"), goal=(50.0, 0.0))
    with pytest.raises(ConfigError, match=r"`goal` = 50, 0 lies beside the ground"):
        ground_of(beside)
    (tmp_path / "torn.npz").write_bytes(b"PK\x03\x04 torn")
    (tmp_path / "s.toml").write_text("seed = 1\nterrain = 'torn.npz'")
    with pytest.raises(ConfigError, match=r"torn.npz: no field: not a whole .npz"):
        ground_of(load_scenario(tmp_path / "s.toml"))


def test_the_ground_of_a_run_can_be_driven_on_again(tmp_path):
    field = ground_of(Scenario(terrain="dead_end")).field
    (tmp_path / "field.npz").write_bytes(field_file.to_npz(field))
    (tmp_path / "s.toml").write_text("seed = 1\nterrain = 'field.npz'\ngoal = [4.0, 1.0]")
    again = ground_of(load_scenario(tmp_path / "s.toml")).field
    assert np.array_equal(again.soil_z, truth_height(field))
    assert (again.start, again.goal_m) == (field.start, (4.0, 1.0))
    assert again.gdem.grid.cell_m == 2.0


@pytest.mark.parametrize("path", OWN, ids=lambda p: p.stem)
def test_a_certificate_s_scenario_is_the_scenario(path):
    scenario = load_scenario(path)
    assert scenario_of(json.loads(json.dumps(asdict(scenario), default=dict))) == scenario


@pytest.mark.parametrize(("name", "target", "allowed"), [
    ("wheel_silent", 0, "1 to 4"), ("wheel_stuck", 5, "1 to 4"), ("can_corrupt", 0, "1 to 100"),
    ("node_foreign", 8, "0 to 7"),
])  # fmt: skip
@pytest.mark.parametrize("use", [Injector, causes])
def test_a_target_that_a_fault_cannot_have_is_named(use, name, target, allowed):
    with pytest.raises(ConfigError, match=f"faults.target = {target} of {name}: should be {allowed}"):
        use((Injection(name, target=target),))
