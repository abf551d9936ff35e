"""The parts of make test-arm64 that need no emulation: the lock's entries, the emulated Python's script, the root."""

import os
import subprocess

import pytest

from tests.arm64 import root, same_bits, wheels
from tests.arm64.python import Emulated
from tools.installation.extras import LOCK, ROOT, closure, roots

pytestmark = pytest.mark.tool

LOCKED = """# a comment
click==8.5.1 \\
    --hash=sha256:aa \\
    --hash=sha256:bb
click-plugins==1.1 \\
    --hash=sha256:cc
small-gicp==1.0.1 \\
    --hash=sha256:dd
"""


def program(folder, name, script):
    folder.mkdir(exist_ok=True)
    path = folder / name
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return path


@pytest.fixture
def first_on_path(tmp_path, monkeypatch):
    """A folder whose programs stand in for the machine's."""
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{os.environ['PATH']}")
    return tmp_path / "bin"


def test_an_entry_of_the_lock_is_taken_whole_and_by_its_exact_name():
    assert wheels.entries(["small_gicp", "click"], LOCKED) == (
        "small-gicp==1.0.1 \\\n    --hash=sha256:dd\nclick==8.5.1 \\\n    --hash=sha256:aa \\\n    --hash=sha256:bb\n"
    )


def test_a_package_that_the_lock_has_not_is_named():
    with pytest.raises(LookupError, match="has no numpy"):
        wheels.entries(["click", "numpy"], LOCKED)


def test_what_flies_and_the_station_are_in_the_lock_and_the_engine_is_not_asked_for():
    names = closure((*roots("onboard"), *roots("ground"), *wheels.TESTS))
    text = wheels.entries(names, LOCK.read_text())
    assert text.count("==") == len(names) and "--hash=" in text
    assert not {"pybullet", "viser", "trimesh", "embreex"} & set(names)


def test_the_emulated_python_is_a_script_that_names_root_and_itself(tmp_path, first_on_path):
    program(first_on_path, "qemu-aarch64", 'for word in "$@"; do echo "$word"; done')
    made = tmp_path / "a root"
    (made / "usr").mkdir(parents=True)
    program(made / "usr/bin", "python3.11", "")
    (made / "usr/bin/python3").symlink_to("python3.11")
    emulated = Emulated(tmp_path / "the venv", made)
    said = subprocess.run([emulated.python, "-m", "x", "two words"], capture_output=True, text=True, check=True).stdout
    interpreter = str(made / "usr/bin/python3.11")
    assert said.splitlines() == ["-L", str(made), "-0", str(emulated.python), interpreter, "-m", "x", "two words"]
    assert f"home = {made}/usr/bin\n" in (tmp_path / "the venv/pyvenv.cfg").read_text()
    assert (emulated.version, emulated.tag) == ("3.11", "311")


def test_a_root_is_made_once(tmp_path, first_on_path):
    program(first_on_path, "apt-get", f'case "$*" in *install*) touch {tmp_path}/apt/archives/one.deb;; esac')
    program(first_on_path, "dpkg-deb", f'mkdir -p "$3/usr" && echo "$2" >> {tmp_path}/unpacked')
    assert (root.make(tmp_path) / "usr").is_dir()
    assert root.make(tmp_path) == tmp_path / "root"
    assert (tmp_path / "unpacked").read_text().splitlines() == [f"{tmp_path}/apt/archives/one.deb"]


def test_what_apt_says_is_in_the_error_and_no_root_is_left(tmp_path, first_on_path):
    program(first_on_path, "apt-get", "echo 'E: no such release' >&2; exit 100")
    with pytest.raises(root.RootError, match=r"(?s)apt-get update for arm64 failed.*E: no such release"):
        root.make(tmp_path)
    assert not (tmp_path / "root").exists()


def test_the_comparison_of_bits_compiles_by_the_flags_of_the_kernels():
    text = (ROOT / "CMakeLists.txt").read_text()
    flags = next(line for line in text.splitlines() if line.startswith("add_compile_options"))
    assert set(same_bits.FLAGS) - {"-std=gnu++17"} <= set(flags.removesuffix(")").partition("(")[2].split())


def test_a_line_of_other_bits_is_named():
    here = ["sin of any bits: 01", "exp of any bits: 02"]
    assert same_bits.difference(here, here) == ""
    assert same_bits.difference(here, [here[0], "exp of any bits: 03"]) == "exp of any bits: 02 here, 03 there"
    assert same_bits.difference(here, here[:1]) == "2 lines here, 1 there"
    assert same_bits.difference([], []) != ""
