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
