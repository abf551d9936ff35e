"""The house keeps its rules: one importer per library, no clock in the core, tables complete."""

import ast
import re
import subprocess
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from hil.faults.injection import INJECTIONS
from onboard.core.faults.monitors import MONITORS
from protocol.tables.faults import BY_NAME, FAULTS

ROOT = Path(__file__).parents[2]
PACKAGES = ("protocol", "transport", "onboard", "hil", "ground", "pictures")
GENERATED = {f"protocol/generated/{name}.py" for name in ("can_codec", "can_frames", "eldorado_dialect")}

ONE_IMPORTER = {
    "can": {f"onboard/drivers/can/{name}.py" for name in ("base", "bus", "log", "socketcan", "socketcand")},
    "zenoh": {"transport/zenoh_end.py", "hil/link/emulator.py"},
    "pybullet": {"hil/plant/engine.py"},
    "filterpy": {"onboard/perception/pose/ekf.py"},
    "viser": {f"hil/view/browser/{name}.py" for name in ("scene", "panel", "serve")},
    "rerun": {"hil/view/rrd.py"},
    "textual": {"ground/cli/watch/app.py"},
    "foxglove": {"ground/foxglove/server.py", "ground/foxglove/shapes.py"},
    "rosbags": {"onboard/bringup/ros2/bag.py", "onboard/bringup/ros2/types.py"},
    "rasterio": {"onboard/bringup/maps/dem_file.py"},
    "small_gicp": {"onboard/perception/pose/registration.py"},
    "pymap3d": {"ground/gateway/origin.py"},
    "pymavlink": {"ground/gateway/frames.py"},
}
PURE = (
    "protocol",
    "onboard/core",
    "onboard/devices",
    "onboard/perception",
    "onboard/planning",
    "onboard/motion",
    "docs/as_printed",
)
BANNED_IN_PURE = {"time", "socket", "threading", "random", "os", "subprocess", "select", "asyncio"}


@cache
def sources(*folders):
    """Name and syntax tree of each file that is not generated."""
    paths = [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]
    named = [(path.relative_to(ROOT).as_posix(), path) for path in paths]
    return [(name, tree(path)) for name, path in named if name not in GENERATED]


@cache
def tree(path):
    return ast.parse(path.read_text())


@cache
def importers(module):
    """Names of the files that import a top-level module."""
    return {name for name, tree in sources(*PACKAGES) if module in dict(imports(tree))}


@cache
def imports(tree):
    return tuple(_imports(tree))


def _imports(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name.split(".")[0], node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.split(".")[0], node.lineno


@pytest.mark.parametrize("library", ONE_IMPORTER)
def test_a_library_has_its_importers_and_no_others(library):
    assert importers(library) == ONE_IMPORTER[library]


def test_matplotlib_is_imported_in_pictures_only():
    assert all(name.startswith("pictures/") for name in importers("matplotlib"))


def test_nothing_that_flies_or_tests_the_rover_imports_the_equations_as_printed():
    broken = [
        f"{name}:{node.lineno}"
        for name, tree in sources(*PACKAGES)
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom) and "as_printed" in ast.unparse(node)
    ]
    assert not broken


def test_the_core_reads_no_clock_socket_or_environment_and_prints_nothing():
    broken = []
    for name, tree in sources(*PURE):
        broken += [f"{name}:{line} imports {module}" for module, line in imports(tree) if module in BANNED_IN_PURE]
        broken += [
            f"{name}:{node.lineno} prints"
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print"
        ]
    assert not broken


def test_no_file_is_over_500_lines():
    long = {name: n for name, _ in sources(*PACKAGES) if (n := len((ROOT / name).read_text().splitlines())) > 500}
    assert not long


MOST_FILES = 15
UNLIMITED = {"docs", "docs/pictures", "pictures", "hil/scenarios/data", "onboard/kernels", "tests/fuzz/corpus"}
AT_THE_ROOT = {  # where their tools look for them; pip's locks beside what they lock
    ".gitignore", "CHANGELOG.md", "CMakeLists.txt", "Makefile", "README.md", "pyproject.toml",
}  # fmt: skip


def crowded(paths):
    """Folders of these files with more files beside each other than a folder may have, and their numbers."""
    counts = Counter(Path(path).parent.as_posix() for path in paths)
    return {name: n for name, n in counts.items() if n > MOST_FILES and name not in UNLIMITED}


def test_no_folder_has_more_than_15_files_beside_each_other():
    files = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    locks = {name for name in files if re.fullmatch(r"requirements[\w-]*\.(lock|in)", name)}
    assert not crowded(name for name in files if name and name not in AT_THE_ROOT | locks)


def test_a_16th_file_in_a_folder_is_found():
    files = [f"onboard/core/file_{n}.py" for n in range(16)]
    assert crowded(files) == {"onboard/core": 16} and not crowded(files[1:])


def test_every_fault_has_a_monitor_and_every_monitor_a_fault():
    assert set(MONITORS) == set(BY_NAME)


def test_fault_numbers_and_names_are_never_used_twice():
    assert len({fault.number for fault in FAULTS}) == len({fault.name for fault in FAULTS}) == len(FAULTS)


def test_every_injection_says_what_it_does():
    assert all(cause.means for cause in INJECTIONS.values())


def test_no_two_test_files_share_a_name():
    """pytest imports them by name alone: the second would not be collected."""
    names = [path.name for path in (ROOT / "tests").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))
