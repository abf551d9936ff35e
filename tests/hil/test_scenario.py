"""A scenario file is right, or refused with file, key and help."""

from pathlib import Path

import pytest

from hil.injection import Injector
from hil.scenario import load_scenario
from onboard.config import ConfigError

OWN = sorted((Path(__file__).parents[2] / "hil" / "scenarios").glob("*.toml"))


@pytest.mark.parametrize("path", OWN, ids=lambda p: p.stem)
def test_the_benchs_own_scenarios_are_named_as_their_files_and_their_faults_exist(path):
    scenario = load_scenario(path)
    assert scenario.name == path.stem
    Injector(scenario.faults)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("terain = 'flat'", r"unknown key `terain`; did you mean `terrain`\?"),
        ("terrain = 'mud'", r"should be one of fbm, craters, real, flat"),
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
    path.write_text("[[faults]]\nfault = 'rain'")
    with pytest.raises(ConfigError, match="lidar_unplugged"):
        Injector(load_scenario(path).faults)


@pytest.mark.parametrize("text", ["[set]\nmapping.folder = 'a b'", "[set]\n'mapping.folder' = 'a b'",
                                  "[set.mapping]\nfolder = 'a b'"])
def test_a_setting_may_be_written_in_each_way_of_toml(tmp_path, text):
    path = tmp_path / "s.toml"
    path.write_text(text)
    assert load_scenario(path).set == {"mapping.folder": "a b"}
