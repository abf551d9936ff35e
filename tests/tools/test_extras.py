"""Each extra installs all that its modules import; a rover gets nothing of the bench; the locks have all parts."""

import ast
import json
import re
import shutil
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from tools.installation import extras

pytestmark = pytest.mark.tool

ROOT = Path(__file__).parents[2]
OURS = ("protocol", "transport", "onboard", "ground", "hil", "pictures")
BENCH = {"pybullet", "viser", "embreex", "trimesh", "matplotlib", "pillow", "duckdb", "pydantic", "pytest"}
OF_A_BUSY_COMPUTER = {"drift", "time", "gaps"}  # findings of `lidar check` that depend on when a process runs
OWN_EXTRA = {"embreex", "rerun-sdk", "rosbags", "foxglove-sdk"}  # asked for by name: extras of pyproject.toml


def imports(path):
    """Dotted names that a file imports, anywhere in it but for the type checker."""
    tree = ast.parse(path.read_text())
    branches = [node for node in ast.walk(tree) if isinstance(node, ast.If)]
    checked = [node for node in branches if ast.unparse(node.test) == "TYPE_CHECKING"]
    unseen = {inner for node in checked for part in node.body for inner in ast.walk(part)}
    for node in ast.walk(tree):
        if node in unseen:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and re.fullmatch(r"[\w.]+:\w+", node.value):
            yield node.value.partition(":")[0]  # loaded by name: a job, a command


def file_of(module):
    """The file of a module of ours; None for a name in one."""
    base = ROOT / module.replace(".", "/")
    return next((path for path in (base.with_suffix(".py"), base / "__init__.py") if path.is_file()), None)


def foreign(packages):
    """Top names of what is not ours that these packages import, themselves or through modules of ours."""
    waiting = [path for package in packages for path in (ROOT / package).rglob("*.py")]
    seen, found = set(waiting), set()
    while waiting:
        for name in imports(waiting.pop()):
            if name.partition(".")[0] not in OURS:
                found.add(name.partition(".")[0])
            elif (path := file_of(name)) and path not in seen:
                seen.add(path)
                waiting.append(path)
    return found - set(sys.stdlib_module_names)


@pytest.mark.parametrize(("extra", "packages"), [
    ("onboard", ("protocol", "transport", "onboard")), ("ground", ("protocol", "transport", "ground")), ("hil", OURS),
])  # fmt: skip
def test_an_extra_has_every_package_that_its_modules_import_themselves_or_through_others(extra, packages):
    owners, installed = packages_distributions(), extras.closure(extras.roots(extra))
    wanted = {plain for top in foreign(packages) for plain in map(extras.plain, owners.get(top, ()))}
    assert len(wanted) > 8 and not wanted - set(installed) - OWN_EXTRA


def test_a_rover_gets_nothing_of_bench_or_station():
    assert not BENCH & set(extras.closure(extras.roots("onboard")))
    assert {"pybullet", "viser", "duckdb"} <= set(extras.closure(extras.roots("hil")))
    assert not {"pybullet", "viser"} & set(extras.closure(extras.roots("ground")))


def test_a_package_that_is_never_imported_stays_away_however_it_is_named_and_only_there(monkeypatch):
    assert "matplotlib" not in extras.closure(["filterpy"]) and "matplotlib" in extras.closure(["matplotlib"])
    monkeypatch.setattr(extras, "NEVER_IMPORTED", set())
    assert "matplotlib" in extras.closure(["filterpy"])  # its metadata do ask for it


def test_the_parts_of_the_lock_are_current():
    stale = [path.name for path, text in extras.parts().items() if not path.is_file() or path.read_text() != text]
    assert not stale, f"run `make locks`: {stale}"


def test_a_part_has_the_pins_and_hashes_of_the_whole_lock_for_its_packages():
    whole = (ROOT / "requirements.lock").read_text()
    part = extras.part("onboard", whole)
    assert set(extras.blocks(part)) == set(extras.closure(extras.roots("onboard")))
    assert all(block in whole and "--hash=sha256:" in block for block in extras.blocks(part).values())


def test_a_package_that_the_lock_lacks_is_named():
    with pytest.raises(KeyError, match="numpy"):
        extras.part("onboard", (ROOT / "requirements.lock").read_text().replace("\nnumpy==", "\nnumpi=="))


def test_the_size_of_packages_is_that_of_their_files_without_byte_code():
    click = extras.closure(["click"])
    folder = Path(str(click["click"].locate_file("click")))
    sources = sum(path.stat().st_size for path in folder.glob("*.py"))
    assert sources < extras.size_bytes(click) < 2 * sources


@pytest.mark.campaign
def test_a_fresh_environment_with_the_extra_onboard_alone_flies_replays_and_checks_a_scanner(tmp_path):
    """Made as docs/service.md says, in minutes; the emulated scanner and the record are of the environment here."""
    environment, record = tmp_path / "rover", tmp_path / "flat"
    made = ["make", "rover", f"ROVER={environment}", f"PYTHON={sys.executable}"]
    subprocess.run(made, cwd=ROOT, check=True, capture_output=True, text=True, timeout=1800)
    here = Path(sys.executable).parent

    def onboard(*words):
        return subprocess.run(
            [environment / "bin/onboard", *words], cwd=tmp_path, capture_output=True, text=True, timeout=600
        )

    listed = subprocess.run(
        [environment / "bin/python", "-m", "pip", "list", "--format=freeze"], check=True, capture_output=True, text=True
    ).stdout
    names = {extras.plain(line.partition("==")[0]) for line in listed.split()}
    assert not BENCH & names and set(extras.closure()) <= names
    assert onboard("run", "--print-config").stdout.startswith("[rover]")
    subprocess.run([here / "hil", "demo", "--out", record], check=True, capture_output=True, timeout=1800)
    replayed = onboard("replay", str(record / "onboard.mcap"))
    assert replayed.returncode == 0 and "identical" in replayed.stdout, replayed.stdout + replayed.stderr
    emulator = subprocess.Popen([here / "hil", "lidar", "--tcp", "0", "--json"], stdout=subprocess.PIPE, text=True)
    try:
        address = json.loads(emulator.stdout.readline())["addresses"][0]
        checked = onboard("lidar", "check", address, "--json")
        report = json.loads(checked.stdout)
        assert report["info"]["PROD"] and report["scans"] and not report["damaged"], checked.stdout + checked.stderr
        assert {finding["name"] for finding in report["findings"]} <= OF_A_BUSY_COMPUTER, checked.stdout
    finally:
        emulator.terminate()
        emulator.wait()
    shutil.rmtree(environment)
