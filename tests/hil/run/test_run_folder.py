"""A scenario is a stranger's file: its run writes into its own folder, and removes only what a run made."""

import json
from dataclasses import asdict, replace

import pytest
from typer.testing import CliRunner

from hil.__main__ import app
from hil.run import options as flying
from hil.run import scenario_command as command
from hil.run.run import run as run_scenario
from hil.scenarios.model import Scenario, load_scenario, scenario_of
from onboard.config import ConfigError


def scenario_file(tmp_path, text):
    path = tmp_path / "s.toml"
    path.write_text(f"seed = 1\nterrain = 'flat'\n{text}")
    return path


@pytest.mark.parametrize("name", ["../../x", "/tmp/x", "a/b", "a\\\\b", "..", ".", "", " ", ".hidden", "a\\u0000b",
                                  "a\\nb", "-rf", "a" * 200])  # fmt: skip
def test_a_name_that_leads_out_of_the_folder_of_runs_is_refused(tmp_path, name):
    with pytest.raises(ConfigError, match="`name`") as raised:
        load_scenario(scenario_file(tmp_path, f'name = "{name}"'))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("name", ["mine", "wheel_stuck", "Lauf 3", "v1.2-b", "Düne"])
def test_a_name_may_have_letters_digits_spaces_and_dots(tmp_path, name):
    assert load_scenario(scenario_file(tmp_path, f'name = "{name}"')).name == name


def test_a_certificate_s_name_is_held_to_the_same(tmp_path):
    tree = json.loads(json.dumps(asdict(Scenario()), default=dict))
    with pytest.raises(ConfigError, match="`name`"):
        scenario_of(tree | {"name": "../x"})


@pytest.mark.parametrize("key", ["record.path", "mapping.folder", "state.folder", "mission.gdem", "link.command_keys",
                                 "link.downlink_key", "status.socket"])  # fmt: skip
@pytest.mark.parametrize("place", ["/tmp/x", "../x", "a/../../x", "~/x"])
def test_a_path_out_of_the_run_s_folder_is_refused_in_a_scenario(tmp_path, key, place):
    with pytest.raises(ConfigError, match=rf"`{key}` = '{place}'.*--set") as raised:
        load_scenario(scenario_file(tmp_path, f"[set]\n'{key}' = '{place}'"))
    assert str(tmp_path / "s.toml") in str(raised.value)


def test_a_path_within_the_folder_is_of_the_run_s_folder(tmp_path):
    from hil.run.run import paths_in

    scenario = load_scenario(scenario_file(tmp_path, "[set]\n'mapping.folder' = 'map'\n'status.socket' = 'off'"))
    assert paths_in(tmp_path / "run", scenario.set) == {
        "mapping.folder": str(tmp_path / "run" / "map"),
        "status.socket": "off",
    }
    assert paths_in(tmp_path / "run", {"state.folder": "/srv/state", "mission.guard": False}) == {
        "state.folder": "/srv/state",
        "mission.guard": False,
    }


def test_a_path_of_the_command_line_may_lead_anywhere(tmp_path, monkeypatch):
    flown = []

    def fly(scenario, out, onboard_python=None):
        flown.append(scenario)
        raise flying.fail(70, "enough")

    monkeypatch.setattr(command, "fly", fly)
    path = scenario_file(tmp_path, "[set]\n'mission.guard' = false")
    map_folder = tmp_path / "map"
    done = CliRunner().invoke(app, ["run", str(path), "--set", f"mapping.folder={map_folder}"])
    assert done.exit_code == 70
    assert flown[0].set == {"mission.guard": False, "mapping.folder": str(map_folder)}
    done = CliRunner().invoke(app, ["run", str(path), "--set", "mapping.foldr=x"])
    assert done.exit_code == 78 and "did you mean `mapping.folder`" in done.stderr


@pytest.mark.parametrize("strange", ["state/boots.json", "ground/counters", "mapping/a.tile", "onboard.mcap", "notes"])
def test_a_run_takes_no_folder_that_holds_what_no_run_made(tmp_path, strange):
    own = tmp_path / "rover" / strange
    own.parent.mkdir(parents=True)
    own.write_text("mine")
    with pytest.raises(ConfigError, match=r"no run made.*--out"):
        run_scenario(Scenario(terrain="flat"), own.parents[1] if "/" in strange else own.parent, lambda *_: None)
    assert own.read_text() == "mine"
    assert sorted(path.name for path in (tmp_path / "rover").iterdir()) == [strange.partition("/")[0]]


def test_the_command_says_so_with_its_exit_code(tmp_path):
    (tmp_path / "state").mkdir()
    done = CliRunner().invoke(app, ["run", "flat", "--out", str(tmp_path)])
    assert done.exit_code == 78 and str(tmp_path) in done.stderr and done.stderr.count("\n") == 1


def test_a_run_s_own_folder_is_taken_again_and_what_is_left_in_it_goes(tmp_path):
    from hil.run.folder import cleared

    folder = tmp_path / "run"
    cleared(folder)
    for name in ("state/boots.json", "ground/counters", "mapping/a.tile", "onboard-boot1.mcap", "notes"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("of the last run")
    cleared(folder)
    left = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert left == {".hil-run", "notes"}


def test_a_folder_of_a_run_of_before_there_were_marks_is_known_by_its_truth(tmp_path):
    from hil.run.folder import cleared

    (tmp_path / "truth.mcap").write_bytes(b"")
    (tmp_path / "state").mkdir()
    cleared(tmp_path)
    assert not (tmp_path / "state").exists() and (tmp_path / ".hil-run").exists()


def test_a_link_out_of_the_folder_is_not_followed(tmp_path):
    from hil.run.folder import cleared

    outside, folder = tmp_path / "outside", tmp_path / "run"
    outside.mkdir()
    (outside / "a.tile").write_text("mine")
    cleared(folder)
    (folder / "mapping").symlink_to(outside)
    (folder / "field.npz").symlink_to(outside / "a.tile")
    cleared(folder)
    assert (outside / "a.tile").read_text() == "mine"
    assert not (folder / "mapping").is_symlink() and not (folder / "field.npz").is_symlink()


@pytest.mark.parametrize("script", ["goto {x}", "goto {}", "goto {0}", "goto {goal_x.y}", "goto {goal_x!r}", "goto {",
                                    "goto }", "goto {goal_x:>999999999}"])  # fmt: skip
def test_a_script_that_asks_for_another_word_than_the_goal_is_refused(tmp_path, script):
    with pytest.raises(ConfigError, match=r"`script`.*\{goal_x\}.*\{goal_y\}") as raised:
        load_scenario(scenario_file(tmp_path, f'script = "at 2.0: {script}"'))
    assert "\n" not in str(raised.value)


def test_a_script_gets_the_goal():
    from hil.scenarios.model import script_of
    from hil.terrain.grounds import GROUNDS

    ground = replace(GROUNDS["flat"](1).field, goal_m=(3.0, -1.25))
    assert script_of(Scenario(script="at 1: goto {goal_x} {goal_y}"), ground) == "at 1: goto 3.000 -1.250"
