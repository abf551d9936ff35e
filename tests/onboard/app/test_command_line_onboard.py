"""The command `onboard` says what is wrong in one line, with an exit code, never with a traceback."""

import re
from importlib.metadata import version

import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner

from onboard.__main__ import app
from onboard.config import load


def onboard(*arguments):
    return CliRunner().invoke(app, arguments)


def complaint(result, code):
    """The one line on standard error of a command that ended with `code`."""
    assert result.exit_code == code
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == "" and result.stderr.count("\n") == 1 and "Traceback" not in result.stderr
    return result.stderr


def test_a_missing_configuration_exits_66_and_says_how_to_make_one(tmp_path):
    path = tmp_path / "missing.toml"
    said = complaint(onboard("run", "--config", str(path)), 66)
    assert said == f"onboard: no configuration file {path}; `onboard run --print-config > {path}` makes one\n"


def test_a_folder_as_configuration_exits_66(tmp_path):
    assert "is a folder" in complaint(onboard("run", "--config", str(tmp_path)), 66)


def test_a_misspelt_key_exits_78_with_file_key_and_what_was_meant(tmp_path):
    path = tmp_path / "rover.toml"
    path.write_text("[motion]\ncruise_mp = 0.1\n")
    said = complaint(onboard("run", "--config", str(path)), 78)
    assert str(path) in said and "`motion.cruise_mp`" in said and "did you mean `motion.cruise_mps`?" in said


@pytest.mark.parametrize(
    ("setting", "named"),
    [
        ("motion.cruise_mps=20.0", "out of range 0.005 to 2"),
        ("motion.cruise_mps", "section.key=value"),
        ("clock.barrier=nowhere", "clock.barrier: `nowhere` should be tcp:HOST:PORT"),
    ],
)
def test_a_wrong_setting_exits_78_and_is_named(setting, named):
    assert named in complaint(onboard("run", "--set", "clock.mode=lockstep", "--set", setting), 78)


def test_a_misspelt_command_is_answered_by_the_one_most_like_it():
    assert "Did you mean 'status'?" in onboard("stauts").output
    assert "Did you mean" not in onboard("qqqq").output


def test_the_shell_completes_commands_and_their_options():
    found = ShellComplete(app, {}, "onboard", "_ONBOARD_COMPLETE")
    assert [item.value for item in found.get_completions([], "stat")] == ["status"]
    assert "--config" in [item.value for item in found.get_completions(["run"], "--c")]


def test_the_version_is_that_of_the_package():
    assert onboard("--version").output.split() == ["onboard", version("el-dorado")]


def test_the_printed_configuration_reads_back(tmp_path):
    result = onboard("run", "--print-config", "--set", "motion.cruise_mps=0.05")
    assert result.exit_code == 0 and result.stderr == ""
    path = tmp_path / "rover.toml"
    path.write_text(result.stdout)
    assert load(path) == load(None, {"motion.cruise_mps": 0.05})


def test_a_record_that_is_none_exits_65_and_one_that_is_not_there_66(tmp_path):
    path = tmp_path / "onboard.mcap"
    assert "no record" in complaint(onboard("replay", str(path)), 66)
    path.write_bytes(b"not a record")
    assert re.search(r"is damaged: .* tick 0", complaint(onboard("replay", str(path)), 65))
