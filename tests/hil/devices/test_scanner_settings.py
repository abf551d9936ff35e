"""The scanner of a run is the one that scenario and command line ask for, and the summary tells the one that flew."""

import json
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from hil.__main__ import _real, app
from hil.devices.lidar import errors as lidar_errors
from hil.devices.lidar.command import _profile as sensor_of
from hil.devices.lidar.errors import IDEAL, REAL, SETS, LidarErrors, lidar_table, plain
from hil.devices.lidar.profile import PROFILES
from hil.run import demo
from hil.run.in_process import InMemory
from hil.scenarios.library import explain
from hil.scenarios.model import Scenario, load_scenario, scanner_of, scenario_of
from hil.world.equipment import equipment
from onboard.config import ConfigError

FLAT = Scenario(terrain="flat", link="lan", end_s=0.5)


def write(folder, text):
    path = folder / "scenario.toml"
    path.write_text(f'seed = 1\nterrain = "flat"\nlink = "lan"\n{text}')
    return path


def test_each_profile_of_the_emulator_has_a_set_and_ideal_changes_nothing_of_its_profile():
    assert set(SETS) == set(PROFILES) and lidar_errors.DEFAULT in SETS.values()
    assert all(plain(name).applied() == PROFILES[name] for name in PROFILES)
    assert IDEAL.applied() == PROFILES["ideal"]


def test_a_key_changes_the_set_that_its_profile_names(tmp_path):
    given = load_scenario(write(tmp_path, '[lidar]\nprofile = "utm-30lx"\nlost_ratio = 0.05\n'))
    assert scanner_of(given.lidar) == replace(REAL, lost_ratio=0.05)
    patched = load_scenario(write(tmp_path, '[lidar]\nprofile = "ideal"\ndark_patches_m = [[1, 2, 0.5]]\n'))
    assert scanner_of(patched.lidar) == LidarErrors(dark_patches_m=((1.0, 2.0, 0.5),))
    assert scanner_of({}) == lidar_errors.DEFAULT
    assert scanner_of({"jitter_s": 0.002}) == replace(lidar_errors.DEFAULT, jitter_s=0.002)


@pytest.mark.parametrize(("text", "told"), [
    ("lost_rate = 0.1", "unknown key `lidar.lost_rate`; did you mean `lidar.lost_ratio`"),
    ("lost_ratio = 1.5", "`lidar.lost_ratio` = 1.5 is out of range 0 to 1"),
    ('profile = "utm-30"', "did you mean 'utm-30lx'"),
    ("dark_patches_m = [1.0, 2.0, 3.0]", r"`lidar.dark_patches_m` should be a list of \[x, y, radius\]"),
    ("dark_patches_m = [[1.0, 2.0, 0.0]]", "radius should be over 0"),
    ("clump_least_beams = 40", "clump_least_beams = 40 is more than"),
    ('lost_ratio = "much"', "`lidar.lost_ratio` should be float"),
])  # fmt: skip
def test_a_wrong_key_or_value_is_told_with_file_and_name(tmp_path, text, told):
    with pytest.raises(ConfigError, match=told):
        load_scenario(write(tmp_path, f"[lidar]\n{text}\n"))


def test_a_table_that_is_none_and_a_soil_that_does_not_exist_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="`lidar` should be a table"):
        load_scenario(write(tmp_path, 'lidar = "ideal"\n'))
    with pytest.raises(ConfigError, match="did you mean 'powder'"):
        load_scenario(write(tmp_path, 'soil = "powdr"\n'))


def test_the_command_line_s_words_come_over_the_scenario_s_table_and_a_profile_replaces_it():
    table = {"profile": "utm-30lx", "lost_ratio": 0.05}
    assert lidar_table([], table) == table
    assert lidar_table(["jitter_s=1e-3", "speck_ratio = 0.1"], table) == {**table, "jitter_s": 1e-3, "speck_ratio": 0.1}
    assert lidar_table(["ideal"], table) == {"profile": "ideal"}
    assert lidar_table(["profile=utm-30lx-ew", "dark_patches_m=[[1,2,0.5]]"], table) == {
        "profile": "utm-30lx-ew",
        "dark_patches_m": [[1, 2, 0.5]],
    }
    with pytest.raises(ConfigError, match=r"--lidar.*did you mean 'ideal'"):
        lidar_table(["idea"], {})


def test_the_emulator_on_a_cable_takes_the_keys_over_its_profile_alone():
    made = sensor_of("utm-30lx", ["lost_ratio=0.02", "latency_s=0.003"], -1.0, 40.0)
    usual = PROFILES["utm-30lx"]
    assert made == replace(usual, dropout_ratio=0.02, latency_ns=3_000_000, rate_error=40e-6, start_ms=2**24 - 1)
    for words in (["dark_rocks_ratio=0.1"], ["ideal"]):
        refused = CliRunner().invoke(app, ["lidar", "--tcp", "0", *(f"--lidar={word}" for word in words)])
        assert refused.exit_code == 64 and "not here" in refused.stderr


def test_sim_tells_a_real_scanner_from_keys_of_the_emulated_one():
    assert _real(["tty:/dev/ttyACM0"]) == ("tty:/dev/ttyACM0", [])
    assert _real(["tcp:192.168.0.10:10940"]) == ("tcp:192.168.0.10:10940", [])
    assert _real(["ideal", "lost_ratio=0.1"]) == ("", ["ideal", "lost_ratio=0.1"])
    refused = CliRunner().invoke(app, ["sim", "--lidar", "tty:/dev/x", "--lidar", "lost_ratio=0.1"])
    assert refused.exit_code == 64 and "one real scanner" in refused.stderr


@pytest.mark.parametrize("words", [("demo",), ("sim",), ("run", "flat")])
def test_a_wrong_word_ends_each_command_with_one_line_before_anything_starts(words):
    refused = CliRunner().invoke(app, [*words, "--lidar", "lost_ratio=2"])
    assert refused.exit_code == 78
    assert refused.stderr.count("\n") == 1 and "`lidar.lost_ratio` = 2.0 is out of range 0 to 1" in refused.stderr


def test_explain_names_the_scanner_and_a_soil_that_is_not_the_usual():
    told = "\n".join(explain(replace(FLAT, soil="firm", lidar={"profile": "utm-30lx", "lost_ratio": 0.02})))
    assert "soil       firm" in told and "scanner    utm-30lx: lost_ratio = 0.02" in told


LOOK = {"scanning.start_rad": 1.05, "scanning.end_rad": 0.2, "scanning.spacing_m": 0.3, "scanning.floor_rad": 0.02,
        "scanning.cap_rad": 0.05, "scanning.range_m": 3.0, "scanning.sector_rad": 0.8}  # fmt: skip


def test_the_scanner_flies_as_told_and_the_run_tells_what_it_lost():
    lidar = {
        "profile": "utm-30lx",
        "lost_ratio": 0.1,
        "clump_ratio": 0.0,
        "outlier_ratio": 0.01,
        "rate_error_ppm": 40.0,
    }
    flight = InMemory(replace(FLAT, end_s=4.0, set=LOOK, lidar=lidar, soil="firm", script="at 0.5: goto 2 0\n")).run()
    told = flight.equipment
    assert (told["soil"], told["scanner"]["profile"], told["scanner"]["rate_error_ppm"]) == ("firm", "utm-30lx", 40.0)
    assert told["scanner"]["lost_by"]["random"] == pytest.approx(0.1, abs=0.01)
    assert told["scanner"]["lost_ratio"] == pytest.approx(sum(told["scanner"]["lost_by"].values()), abs=1e-5)
    assert told["scanner"]["outlier_ratio"] == pytest.approx(0.01, abs=0.003)
    assert told["scanner"]["turns"] > 20 and told["scanner"]["motor_jitter_s"] == 3e-5
    assert "LIDAR 20 mm to 10 m, 30 mm beyond; steering pots 0.0005 rad" in told["sensor_noise"]


def test_the_beams_meet_the_ground_as_it_is_after_it_has_changed():
    bench = InMemory(replace(FLAT, lidar={"profile": "utm-30lx"}), ())
    times_ns = np.zeros(1081, np.int64)
    bench._cast(times_ns)
    level = bench._look().sine[540]
    x_m = (np.arange(bench.field.grid.columns) * bench.field.grid.cell_m + bench.field.grid.x0_m).clip(min=2.0) - 2.0
    bench.plant.reshape((bench.field.soil_z + 0.3 * x_m).astype(np.float32))
    ranges_m = bench._cast(times_ns)
    tilted = bench._look().sine[540]
    bench.free()
    assert np.isfinite(ranges_m[540]) and tilted > 0.2 and level in (1.0, pytest.approx(0.0, abs=0.1))


def test_noise_and_soil_are_told_from_what_flew_and_the_ideal_scanner_loses_nothing():
    quiet = replace(FLAT, lidar={"profile": "ideal"}, sensors={"imu": {"gyro_noise_radps": 0.5}})
    bench = InMemory(quiet, ())
    bench.plant.patches.lay((1.0, 0.0), 0.5, "soft")
    told = equipment(bench)
    bench.free()
    assert told["scanner"]["lost_ratio"] == 0.0 and told["scanner"]["profile"] == "ideal"
    assert "gyro 0.5 rad/s" in told["sensor_noise"] and told["soil"].startswith("nominal, changed")


def test_a_certificate_holds_the_whole_scanner_and_flies_it_again_whatever_the_default_becomes(monkeypatch):
    scenario = replace(FLAT, lidar={"profile": "utm-30lx", "dark_patches_m": [[1, 2, 0.5]]}, soil="soft")
    bare = SimpleNamespace(link={}, streams={}, states=0, states_sha256="")
    written = json.loads(json.dumps(demo.certificate(scenario, bare)))
    again = scenario_of(written["flight"])
    assert scanner_of(again.lidar) == replace(REAL, dark_patches_m=((1.0, 2.0, 0.5),)) and again.soil == "soft"
    usual = json.loads(json.dumps(demo.certificate(FLAT, bare)))
    flown = lidar_errors.DEFAULT
    monkeypatch.setattr(lidar_errors, "DEFAULT", replace(REAL, lost_ratio=0.5))
    assert scanner_of(scenario_of(usual["flight"]).lidar) == flown
    assert json.loads(json.dumps(demo.certificate(scenario_of(usual["flight"]), bare))) == usual


def test_a_certificate_from_before_there_was_a_table_flies_the_ideal_scanner():
    old = {key: item for key, item in asdict(FLAT).items() if key not in ("lidar", "soil")}
    read = scenario_of(json.loads(json.dumps(old)))
    assert scanner_of(read.lidar) == IDEAL and read.soil == "nominal"


def test_the_tally_names_scanner_and_loss_and_takes_a_summary_from_before():
    assert demo.scanner_line({"profile": "utm-30lx", "lost_ratio": 0.0312}) == "utm-30lx, 3.12 % lost"
    assert demo.scanner_line({}) == ""
