"""A machine without what the project needs is told so, with the command that installs it."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "tools" / "check_system.sh"


def check(python, path):
    return subprocess.run(
        ["/bin/sh", str(SCRIPT), python], env={"PATH": str(path)}, capture_output=True, text=True, check=False
    )


def test_missing_packages_are_named_with_the_command_that_installs_them(tmp_path):
    done = check("", tmp_path)
    assert done.returncode == 1
    assert "sudo apt-get install -y g++ git python3 python3-venv python3-dev" in done.stderr


def test_another_python_is_named_with_the_way_to_choose_one(tmp_path):
    other = tmp_path / "python3"
    other.write_text('#!/bin/sh\n[ "$1" = -V ] && echo "Python 3.13.1" && exit 0\nexit 1\n')
    other.chmod(0o755)
    done = check(str(other), tmp_path)
    assert done.returncode == 1
    assert "Python 3.11 is needed" in done.stderr
    assert "Python 3.13.1" in done.stderr
    assert "make PYTHON=" in done.stderr


def test_a_machine_with_all_of_it_passes_in_silence(tmp_path):
    for tool in ("g++", "git"):
        (tmp_path / tool).symlink_to("/bin/true")
    done = check(sys.executable, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
