"""`make install` and `make deb`: what is where, what an upgrade leaves alone, a package that Debian's tools read."""

import ast
import compileall
import io
import os
import platform
import re
import shutil
import stat
import subprocess
import sys
import tarfile
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from onboard.config import load
from onboard.record import made_by
from tools.installation import install as installer
from tools.installation import make_deb
from tools.installation.extras import closure
from tools.installation.install import PYTHON, Place, install, uninstall

pytestmark = pytest.mark.tool

ROOT = Path(__file__).parents[2]
INTERPRETER = os.path.realpath(sys.executable)
ANALYZE, DPKG = shutil.which("systemd-analyze"), shutil.which("dpkg-deb")


@pytest.fixture
def small(monkeypatch):
    """An installation with click as its only Python package and nothing compiled: most tests need no more."""
    monkeypatch.setattr(installer, "closure", lambda: closure(["click"]))
    monkeypatch.setattr(compileall, "compile_dir", lambda *_, **__: True)


def place(destdir, version="1.0", prefix="/usr/local", python=INTERPRETER):
    return Place(Path(prefix), str(destdir), Path("/etc"), version, python)


def tree(root):
    """path -> content, where a link points, or None for a folder."""
    return {
        str(path.relative_to(root)): os.readlink(path)
        if path.is_symlink()
        else path.read_bytes()
        if path.is_file()
        else None
        for path in root.rglob("*")
    }


# -- install -----------------------------------------------------------------------------------------------------


def test_what_is_installed_lies_where_the_page_says_and_names_no_place_of_the_build(tmp_path, monkeypatch):
    monkeypatch.setattr(installer, "closure", lambda: closure(["click"]))
    install(place(tmp_path))
    home = tmp_path / "usr/local/lib/el-dorado"
    assert os.readlink(home / "current") == "1.0" and not list(home.glob(".*"))
    site = home / "current/lib" / PYTHON / "site-packages"
    assert {path.name for path in site.iterdir()} >= {"onboard", "protocol", "click"}
    assert len(list(site.glob("onboard/__pycache__/app.*.pyc"))) == 1 and not list(site.rglob("*.hpp"))
    assert (site / "protocol/rover.dbc").is_file()
    assert made_by.commit(site) == installer.commit() != "unknown"
    assert len(list((site / "onboard/native").glob("_kernels_*.so"))) == 3
    assert stat.S_IMODE((tmp_path / "usr/local/bin/onboard").stat().st_mode) == 0o755
    assert (tmp_path / "etc/el-dorado/rover.toml").read_text() == (
        tmp_path / "usr/local/share/el-dorado/rover.toml"
    ).read_text()
    ours = [path for path in tmp_path.rglob("*") if path.is_file() and path.suffix not in (".so", ".pyi")]
    for path in ours:
        data = path.read_bytes()
        assert str(tmp_path).encode() not in data and str(ROOT).encode() not in data, path


def test_the_installed_command_runs_from_any_folder_without_the_source_tree(tmp_path, small):
    """Its environment is its own: click comes from there, and numpy, which this one does not have, is missed."""
    prefix = tmp_path / "opt"
    install(Place(prefix, "", tmp_path / "etc", "1.0", sys.executable))
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    python = prefix / "lib/el-dorado/current/bin/python"
    told = subprocess.run(
        [python, "-P", "-c", "import click, onboard.config, sys; print(click.__file__, onboard.config.__file__)"],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert all(path.startswith(str(prefix / "lib/el-dorado")) for path in told.split())
    missed = subprocess.run([prefix / "bin/onboard"], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert "No module named 'numpy'" in missed.stderr


def test_an_upgrade_keeps_the_operators_configuration_and_the_old_version_to_go_back_to(tmp_path, small):
    install(place(tmp_path, "1.0"))
    mine = tmp_path / "etc/el-dorado/rover.toml"
    mine.write_text("# mine\n")
    install(place(tmp_path, "1.1"))
    home = tmp_path / "usr/local/lib/el-dorado"
    assert mine.read_text() == "# mine\n" and os.readlink(home / "current") == "1.1"
    assert sorted(path.name for path in home.iterdir()) == ["1.0", "1.1", "current"]
    installer.switch(place(tmp_path, "1.0"))
    assert os.readlink(home / "current") == "1.0"


def test_an_upgrade_that_breaks_off_leaves_the_old_version_in_force_and_the_next_one_mends_it(
    tmp_path, small, monkeypatch
):
    install(place(tmp_path, "1.0"))

    def cut(*_, **__):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken, pytest.raises(OSError, match="No space"):
        broken.setattr(shutil, "copytree", cut)
        install(place(tmp_path, "1.1"))
    home = tmp_path / "usr/local/lib/el-dorado"
    assert os.readlink(home / "current") == "1.0" and not (home / "1.1").exists()
    install(place(tmp_path, "1.1"))
    assert os.readlink(home / "current") == "1.1" and not list(home.glob(".*"))


def test_uninstall_takes_all_but_configuration(tmp_path, small):
    install(place(tmp_path, "1.0"))
    install(place(tmp_path, "1.1"))
    uninstall(place(tmp_path, "1.1"))
    left = [path for path in tmp_path.rglob("*") if not path.is_dir()]
    assert left == [tmp_path / "etc/el-dorado/rover.toml"]


OPTIONAL = {("onboard/bringup/ros2", "rosbags")}  # the command names its extra where the package is missing


def test_every_package_that_the_flight_program_imports_flies_with_it():
    owners, flown = packages_distributions(), closure()
    for path in (path for name in installer.PACKAGES for path in (ROOT / name).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = (
                [alias.name for alias in node.names]
                if isinstance(node, ast.Import)
                else ([node.module] if isinstance(node, ast.ImportFrom) and node.module and not node.level else [])
            )
            for top in {name.split(".")[0] for name in names} - set(sys.stdlib_module_names) - {*installer.PACKAGES}:
                optional = (str(path.parent.relative_to(ROOT)), top) in OPTIONAL
                if top in owners and not optional:  # not: annotations of the type checker
                    assert any(re.sub(r"[-_.]+", "-", o).lower() in flown for o in owners[top]), (path, top)


def test_later_versions_sort_after_earlier_ones():
    assert re.fullmatch(r"\d+\.\d+\.\d+(\+\d+\.g[0-9a-f]+(\.changed)?)?", installer.version())


def test_the_example_configuration_is_one_that_the_program_takes(tmp_path):
    path = tmp_path / "rover.toml"
    path.write_text(place("").filled("rover.toml"))
    config = load(path)
    assert config.realtime.fifo_priority == 50 and config.state.folder == "/var/lib/el-dorado/state"
    assert config.link.command_keys == "/etc/el-dorado/command.keys"


# -- the unit ----------------------------------------------------------------------------------------------------


def unit():
    rows = [
        line.split("=", 1)
        for line in place("").filled("el-dorado.service").splitlines()
        if "=" in line and not line.startswith("#")
    ]
    return {key: [value for name, value in rows if name == key] for key, _ in rows}


def test_the_unit_asks_for_what_the_daemon_gives_and_what_the_example_configuration_needs(tmp_path):
    rows = unit()
    assert rows["Type"] == ["notify"] and rows["WatchdogSec"] == ["5"] and rows["WantedBy"] == ["multi-user.target"]
    (tmp_path / "rover.toml").write_text(place("").filled("rover.toml"))
    config = load(tmp_path / "rover.toml")
    assert int(rows["LimitRTPRIO"][0]) >= config.realtime.fifo_priority and rows["LimitMEMLOCK"] == ["infinity"]
    assert rows["StateDirectory"] == ["el-dorado"] and config.mapping.folder.startswith("/var/lib/el-dorado/")
    assert rows["LogsDirectory"] == ["el-dorado"] and config.record.path.startswith("/var/log/el-dorado/")
    assert "AF_CAN" in rows["RestrictAddressFamilies"][0]


@pytest.mark.skipif(not ANALYZE, reason="systemd-analyze is not installed (package systemd)")
def test_systemd_finds_nothing_wrong_with_the_unit(tmp_path):
    """Verified with a command that is there, as the installed one is not; anything told is a fault of the unit."""
    path = tmp_path / "el-dorado.service"
    text = place("").filled("el-dorado.service").replace("file:/usr/local/share/el-dorado/service.md", f"file:{path}")
    path.write_text(text.replace("/usr/local/bin/onboard", "/bin/sh"))
    told = subprocess.run([ANALYZE, "verify", "--man=no", path], capture_output=True, text=True)
    assert (told.returncode, told.stdout + told.stderr) == (0, "")
    path.write_text(path.read_text().replace("WatchdogSec=5", "WatchdogSec=soon"))
    told = subprocess.run([ANALYZE, "verify", "--man=no", path], capture_output=True, text=True)
    assert "Failed to parse" in told.stderr  # it would have seen one


@pytest.mark.skipif(not ANALYZE, reason="systemd-analyze is not installed (package systemd)")
def test_the_units_exposure_is_at_most_two_and_a_half_of_ten(tmp_path):
    path = tmp_path / "el-dorado.service"
    path.write_text(place("").filled("el-dorado.service").replace("/usr/local/bin/onboard", sys.executable))
    told = subprocess.run(
        [ANALYZE, "security", "--offline=yes", "--threshold=25", "--no-pager", path], capture_output=True, text=True
    )
    if "unrecognized option" in told.stderr:
        pytest.skip("this systemd-analyze reads no unit files for `security`")
    assert told.returncode == 0, told.stdout[-600:] + told.stderr


# -- the package -------------------------------------------------------------------------------------------------


def members(deb):
    """An independent reader of ar(5): name -> data."""
    assert deb[:8] == b"!<arch>\n"
    at, found = 8, {}
    while at < len(deb):
        head = deb[at : at + 60]
        assert head[58:] == b"`\n" and at % 2 == 0
        size = int(head[48:58])
        found[head[:16].decode().strip()] = deb[at + 60 : at + 60 + size]
        at += 60 + size + size % 2
    return found


def entries(data):
    with tarfile.open(fileobj=io.BytesIO(data), mode="r:gz") as tar:
        return {row.name: (row, tar.extractfile(row).read() if row.isfile() else b"") for row in tar}


@pytest.fixture
def deb(tmp_path, small):
    install(place(tmp_path / "root", "1.0+7.gabc", "/usr", "/usr/bin/python3.11"))
    return make_deb.package(tmp_path / "root", "1.0+7.gabc", "amd64", 1_700_000_000)


def test_the_package_read_back_has_its_fields_scripts_conffiles_and_files(deb, tmp_path):
    parts = members(deb)
    assert list(parts) == ["debian-binary", "control.tar.gz", "data.tar.gz"] and parts["debian-binary"] == b"2.0\n"
    control, data = entries(parts["control.tar.gz"]), entries(parts["data.tar.gz"])
    fields = dict(line.split(": ", 1) for line in control["./control"][1].decode().splitlines() if line[0] != " ")
    assert (fields["Package"], fields["Version"], fields["Architecture"]) == ("el-dorado", "1.0+7.gabc", "amd64")
    assert "python3.11" in fields["Depends"] and int(fields["Installed-Size"]) > 1000
    assert control["./conffiles"][1] == b"/etc/el-dorado/rover.toml\n"
    for script in make_deb.SCRIPTS:
        row, text = control[f"./{script}"]
        assert row.mode == 0o755 and text.startswith(b"#!/bin/sh\n")
        subprocess.run(["sh", "-n"], input=text, check=True)
    assert data["./usr/bin/onboard"][0].mode == 0o755
    assert data["./usr/lib/systemd/system/el-dorado.service"][0].mode == 0o644
    assert data["./usr/lib/el-dorado/current"][0].linkname == "1.0+7.gabc"
    assert data[f"./usr/lib/el-dorado/1.0+7.gabc/bin/{PYTHON}"][0].linkname == "/usr/bin/python3.11"
    assert all(row.uid == row.gid == 0 and row.mtime == 1_700_000_000 for row, _ in (*control.values(), *data.values()))
    on_disk = {f"./{path}" for path in tree(tmp_path / "root")}
    assert set(data) == on_disk
    for line in control["./md5sums"][1].decode().splitlines():
        assert "./" + line.split("  ", 1)[1] in data


def test_the_same_tree_gives_the_same_package(deb, tmp_path):
    assert make_deb.package(tmp_path / "root", "1.0+7.gabc", "amd64", 1_700_000_000) == deb


def test_a_member_of_odd_length_is_padded():
    assert make_deb.ar({"a": b"x", "b": b"yz"}, 0).endswith(b"`\nyz") and len(make_deb.ar({"a": b"x"}, 0)) % 2 == 0


@pytest.mark.skipif(not DPKG, reason="dpkg-deb is not installed")
def test_dpkg_reads_the_package_and_unpacks_what_was_packed(deb, tmp_path):
    path = tmp_path / "el-dorado.deb"
    path.write_bytes(deb)
    asked = subprocess.run([DPKG, "--field", path, "Version"], capture_output=True, text=True, check=True)
    assert asked.stdout == "1.0+7.gabc\n"
    subprocess.run([DPKG, "--raw-extract", path, tmp_path / "out"], check=True)
    control = {name: text for name, text in tree(tmp_path / "out").items() if name.startswith("DEBIAN")}
    assert set(control) == {
        "DEBIAN",
        *(f"DEBIAN/{name}" for name in ("control", "conffiles", "md5sums", *make_deb.SCRIPTS)),
    }
    unpacked = {name: text for name, text in tree(tmp_path / "out").items() if not name.startswith("DEBIAN")}
    assert unpacked == tree(tmp_path / "root")


@pytest.mark.campaign
def test_the_whole_package_flies_from_where_it_was_unpacked(tmp_path):
    """With all Python packages: minutes. Its interpreter is the system's where that is of the same version."""
    python = f"/usr/bin/{PYTHON}" if Path(f"/usr/bin/{PYTHON}").exists() else sys.executable
    install(place(tmp_path / "root", "1.0", "/usr", python))
    (tmp_path / "a.deb").write_bytes(make_deb.package(tmp_path / "root", "1.0", platform.machine(), 0))
    shutil.rmtree(tmp_path / "root")
    for name, data in members((tmp_path / "a.deb").read_bytes()).items():
        if name == "data.tar.gz":
            with tarfile.open(fileobj=io.BytesIO(data), mode="r:gz") as tar:
                tar.extractall(tmp_path / "root")  # ours; its `filter` came with 3.11.4, Debian 12 has 3.11.2
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    flown = [tmp_path / "root/usr/lib/el-dorado/current/bin/python", "-P", "-m", "onboard"]
    told = subprocess.run(
        [*flown, "run", "--print-config"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120
    )
    assert told.returncode == 0 and told.stdout.startswith("[rover]"), told.stderr
    refused = subprocess.run(
        [*flown, "run", "--set=can.uri=virtual:a", "--set=lidar.address=tcp:127.0.0.1:1"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert refused.returncode == 78 and "link.command_keys" in refused.stderr  # every module was there
