"""Licences of what is not ours: the page (kept current by test_docs.py), the notice, nothing without a name."""

import subprocess
from pathlib import Path

import pytest

from tools.installation.extras import LOCK, closure
from tools.installation.install import Place, install
from tools.installation.licences import licence, licence_texts, locked, notice, page

ROOT = Path(__file__).parents[2]


def test_the_page_names_every_package_of_the_lock_file_once():
    rows = [line.split(" | ")[0].removeprefix("| ") for line in page().splitlines() if line.startswith("| ")]
    named = [row for row in rows if row not in ("package", "---")]
    assert sorted(named) == sorted({name.lower().replace("_", "-") for name in locked(LOCK.read_text())})


@pytest.mark.parametrize(("name", "words"), [
    ("python-can", ("LGPL",)), ("pymavlink", ("LGPL",)), ("eclipse-zenoh", ("Apache", "Eclipse Public")),
    ("matplotlib", ("Python Software Foundation",)), ("numpy", ("BSD-3-Clause",)),
])  # fmt: skip
def test_a_licence_is_what_the_packages_metadata_say(name, words):
    found = licence(closure([name])[name])
    assert all(word in found for word in words) and "\n" not in found


def test_the_notice_has_every_package_and_the_licence_texts_that_they_bring():
    text = notice()
    for package in closure().values():
        assert f"\n{package.metadata['Name']} {package.version}: {licence(package)}" in text
    assert "GNU LESSER GENERAL PUBLIC LICENSE" in text and "Eclipse Public License - v 2.0" in text
    assert "libgeos" in text
    without = {name for name, package in closure().items() if not licence_texts(package)}
    assert without == {"mcap"}


def test_the_notice_is_installed_where_debian_looks_for_it(tmp_path, monkeypatch):
    monkeypatch.setattr("tools.installation.install.closure", lambda: closure(["click"]))
    monkeypatch.setattr("compileall.compile_dir", lambda *_, **__: True)
    install(Place(Path("/usr"), str(tmp_path), Path("/etc"), "1.0", "/usr/bin/python3.11"))
    assert (tmp_path / "usr/share/doc/el-dorado/copyright").read_text() == notice()


def test_a_demo_builds_no_package_from_its_source():
    said = subprocess.run(
        ["make", "--dry-run", "--always-make", "demo"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    assert "requirements.lock" in said and "--only-binary" in said and "requirements-source" not in said
