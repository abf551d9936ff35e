"""The command `hil` answers at once, and says what is wrong in one line."""

import fcntl
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

from hil.run.folder import MARKER
from hil.scenarios.library import FOLDER, names

ROOT = Path(__file__).parents[3]


def hil(*arguments):
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, cwd=ROOT, check=False)


def test_help_and_link_load_neither_the_engine_nor_the_bench():
    heavy = {"pybullet", "hil.run.bench", "hil.run.run", "viser", "PIL", "matplotlib"}
    code = f"import sys, hil.__main__; print(sorted({heavy} & set(sys.modules)))"
    assert hil("-c", code).stdout == "[]\n"


def test_the_engine_loads_without_a_word():
    done = hil("-c", "import hil.plant.engine; print(hil.plant.engine.pybullet.DIRECT)")
    assert (done.stdout, done.stderr) == ("2\n", "")


def test_a_missing_scenario_is_one_line_and_exit_66():
    done = hil("-m", "hil", "run", "missing.toml")
    assert done.returncode == 66
    assert done.stderr == "hil: no scenario missing.toml; the bench's own are in `hil list`\n"


def test_a_terrain_that_is_none_is_one_line_and_exit_64():
    done = hil("-m", "hil", "demo", "--terrain", "moon")
    assert done.returncode == 64
    assert done.stderr == "hil: --terrain 'moon' should be one of fbm, craters, flat, real\n"


def test_a_can_interface_that_is_not_there_is_named_with_its_cure_and_exit_69(tmp_path):
    scenario = "hil/scenarios/data/wheel_silent.toml"
    done = hil("-m", "hil", "run", scenario, "--can", "socketcan:vcan7", "--out", str(tmp_path))
    assert done.returncode == 69
    assert "hil: socketcan:vcan7 cannot be opened" in done.stderr
    assert "ip link add vcan7 type vcan" in done.stderr


def test_the_shell_completes_scenario_names_and_the_version_is_that_of_the_package():
    assert names("wheel_stu") == ["wheel_stuck"] and set(names()) == {path.stem for path in FOLDER.glob("*.toml")}
    done = hil("-m", "hil", "--version")
    assert (done.returncode, done.stdout.split()) == (0, ["hil", version("el-dorado")])


def test_a_wrong_option_is_a_usage_error_of_sysexits():
    assert hil("-m", "hil", "list", "--nonsense").returncode == 64


def test_a_folder_that_another_bench_flies_in_is_refused_and_left_as_it_is(tmp_path):
    (tmp_path / "ground.toml").write_text("the other's")
    (tmp_path / MARKER).touch()
    with (tmp_path / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        result = hil("-m", "hil", "sim", "--out", str(tmp_path))
    assert result.returncode == 69
    assert "is in use by another bench" in result.stderr and "--out" in result.stderr
    assert (tmp_path / "ground.toml").read_text() == "the other's"
