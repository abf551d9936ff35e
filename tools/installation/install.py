"""`make install` and `make uninstall`: the flight program with its packages, its unit and an example configuration.

    PREFIX/lib/el-dorado/VERSION/    a virtual environment: bin/python, and in its site-packages what flies
    PREFIX/lib/el-dorado/current     the version that runs; changed at once, so an upgrade is whole or not at all
    PREFIX/bin/onboard               the command
    PREFIX/lib/systemd/system, PREFIX/lib/sysusers.d, PREFIX/share/el-dorado
    PREFIX/share/doc/el-dorado       licences of what is not ours
    SYSCONFDIR/el-dorado/rover.toml  only where there is none

Nothing is fetched: the packages of the extra `onboard` are copied from the environment that runs this, so what was
tested there is what flies.
DESTDIR goes before every path that is written, and into none of the files.
"""

from __future__ import annotations

import argparse
import compileall
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError
from pathlib import Path
from py_compile import PycInvalidationMode

from onboard.record.made_by import COMMIT
from tools.installation.extras import closure

ROOT = Path(__file__).parents[2]
SERVICE = ROOT / "tools" / "installation" / "service"
PACKAGES = ("protocol", "transport", "onboard")
EXTENSIONS = ("_kernels_baseline", "_wakes")
OF_MACHINE = {"x86_64": ("_kernels_avx2", "_kernels_avx512")}  # CMakeLists.txt builds them there only
NOT_FLOWN = ("*.hpp", "*.cpp", "*.so", "__pycache__")
PYTHON = f"python{sys.version_info.major}.{sys.version_info.minor}"


@dataclass(frozen=True, slots=True)
class Place:
    """Installation paths.

    prefix, sysconfdir: as in make.
    destdir: precedes all paths that are written.
    version: version to install.
    python: interpreter at run time.
    """

    prefix: Path
    destdir: str
    sysconfdir: Path
    version: str
    python: str

    def at(self, path: Path) -> Path:
        """Path to write for a path of the running system."""
        return Path(f"{self.destdir}{path}") if self.destdir else path

    @property
    def versions(self) -> Path:
        """Folder of all versions, on the running system."""
        return self.prefix / "lib" / "el-dorado"

    @property
    def home(self) -> Path:
        """Environment of this version, on the running system."""
        return self.versions / self.version

    def filled(self, name: str) -> str:
        """Text of a file of tools/installation/service with the paths filled in."""
        text = (SERVICE / name).read_text()
        return text.replace("@PREFIX@", str(self.prefix)).replace("@SYSCONFDIR@", str(self.sysconfdir))


def version() -> str:
    """Version of pyproject with the number of commits and the newest: later versions sort after earlier ones."""
    base = str(tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"])
    try:
        count, short = _git("rev-list", "--count", "HEAD"), _git("rev-parse", "--short", "HEAD")
        return f"{base}+{count}.g{short}{'.changed' if _changed() else ''}"
    except (OSError, subprocess.CalledProcessError):
        return base


def commit() -> str:
    """Text that an installed program writes to its records: the full commit, and whether the sources were changed."""
    try:
        return f"{_git('rev-parse', 'HEAD')}{', changed' if _changed() else ''}"
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _git(*words: str) -> str:
    done = subprocess.run(
        ["git", "-c", "safe.directory=*", *words],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=True,
    )
    return done.stdout.strip()


def _changed() -> bool:
    return bool(_git("status", "--porcelain", "--untracked-files=no"))


def install(place: Place) -> None:
    """Install everything; the switch to this version is last. Raises OSError, PackageNotFoundError."""
    new = place.at(place.versions / f".{place.version}.new")
    site = new / "lib" / PYTHON / "site-packages"
    shutil.rmtree(new, ignore_errors=True)  # an interrupted copy
    site.mkdir(parents=True)
    _environment(place, new)
    for package in closure().values():
        _copy_distribution(package, site)
    for name in PACKAGES:
        shutil.copytree(ROOT / name, site / name, ignore=shutil.ignore_patterns(*NOT_FLOWN))
    _write(site / "onboard" / COMMIT, f"{commit()}\n", 0o644)
    for module in extensions():
        shutil.copy2(module, site / "onboard" / "native" / module.name)
    compileall.compile_dir(
        site,
        quiet=2,
        ddir=str(place.home / site.relative_to(new)),
        invalidation_mode=PycInvalidationMode.UNCHECKED_HASH,
    )
    for path, text, mode in texts(place):
        _write(place.at(path), text, mode)
    config = place.at(place.sysconfdir / "el-dorado" / "rover.toml")
    if not config.exists():
        _write(config, place.filled("rover.toml"), 0o644)
    _replace(place.at(place.home), new)
    switch(place)


def texts(place: Place) -> Iterator[tuple[Path, str, int]]:
    """Yield the small files: path on the running system, content, mode."""
    from tools.installation.licences import notice  # imported here, because it needs `closure`

    share = place.prefix / "share" / "el-dorado"
    yield place.prefix / "bin" / "onboard", place.filled("onboard.sh"), 0o755
    yield place.prefix / "lib" / "systemd" / "system" / "el-dorado.service", place.filled("el-dorado.service"), 0o644
    yield place.prefix / "lib" / "sysusers.d" / "el-dorado.conf", place.filled("sysusers.conf"), 0o644
    yield share / "rover.toml", place.filled("rover.toml"), 0o644
    yield place.prefix / "share" / "doc" / "el-dorado" / "copyright", notice(), 0o644
    yield share / "service.md", (ROOT / "docs" / "service.md").read_text(), 0o644


def switch(place: Place) -> None:
    """Point `current` to this version by a rename, so that at any time one of the two versions is there."""
    current = place.at(place.versions / "current")
    new = current.with_name(".current.new")
    new.unlink(missing_ok=True)
    new.symlink_to(place.version)
    new.replace(current)


def uninstall(place: Place) -> None:
    """Remove every version, the command and the unit. Configuration, state and records stay."""
    shutil.rmtree(place.at(place.versions), ignore_errors=True)
    for path, _, _ in texts(place):
        place.at(path).unlink(missing_ok=True)
    share = place.prefix / "share"
    for folder in (share / "el-dorado", share / "doc" / "el-dorado", place.prefix / "lib" / "sysusers.d"):
        if place.at(folder).is_dir() and not any(place.at(folder).iterdir()):
            place.at(folder).rmdir()


def extensions() -> list[Path]:
    """The compiled modules for this machine, of this environment. Raises FileNotFoundError where one is not built.

    In .venv, which is editable, Python finds them; in .rover the source tree hides the installed package.
    """
    found = []
    installed = Path(sysconfig.get_path("platlib")) / "onboard" / "native"
    for name in (*EXTENSIONS, *OF_MACHINE.get(platform.machine(), ())):
        spec = importlib.util.find_spec(f"onboard.native.{name}")
        places = [Path(spec.origin)] if spec and spec.origin else sorted(installed.glob(f"{name}.*.so"))
        if not places:
            raise FileNotFoundError(f"{name} is not built here: `make rover` or `make test` builds it")
        found.append(places[0])
    return found


def _replace(home: Path, new: Path) -> None:
    """Replace a folder of the same version by the new one."""
    old = home.with_name(f".{home.name}.old")
    shutil.rmtree(old, ignore_errors=True)
    if home.exists():
        home.rename(old)
    new.rename(home)
    shutil.rmtree(old, ignore_errors=True)


def _environment(place: Place, home: Path) -> None:
    """Files that make a folder a virtual environment (site, PEP 405): the interpreter, and its origin."""
    (home / "bin").mkdir()
    (home / "bin" / PYTHON).symlink_to(place.python)
    (home / "bin" / "python").symlink_to(PYTHON)
    settings = f"home = {Path(place.python).parent}\ninclude-system-site-packages = false\n"
    _write(home / "pyvenv.cfg", settings + f"version = {sys.version.split()[0]}\n", 0o644)


def _copy_distribution(package: Distribution, site: Path) -> None:
    """Copy the files listed in its RECORD, without commands and compiled Python files."""
    for file in package.files or ():
        if ".." in file.parts or "__pycache__" in file.parts or file.name == "direct_url.json":
            continue
        target = site / file
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(str(package.locate_file(file)), target)


def _write(path: Path, text: str, mode: int) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(mode)


def main() -> int:
    """Command line of the Makefile's targets."""
    parser = argparse.ArgumentParser(prog="tools.installation.install", description=__doc__)
    parser.add_argument("what", choices=("install", "uninstall", "version"))
    parser.add_argument("--prefix", type=Path, default=Path("/usr/local"))
    parser.add_argument("--destdir", default="")
    parser.add_argument("--sysconfdir", type=Path, default=Path("/etc"))
    parser.add_argument("--python", default=os.path.realpath(sys.executable))
    asked = parser.parse_args()
    if not (asked.prefix.is_absolute() and asked.sysconfdir.is_absolute()):
        parser.error("PREFIX and SYSCONFDIR are absolute paths")
    place = Place(asked.prefix, asked.destdir, asked.sysconfdir, version(), asked.python)
    if asked.what == "version":
        print(place.version)
        return 0
    try:
        (install if asked.what == "install" else uninstall)(place)
    except (OSError, PackageNotFoundError) as error:
        print(f"{asked.what}: {error}", file=sys.stderr)
        return 1
    if not place.destdir:
        print(_next_steps(place, asked.what))
    return 0


def _next_steps(place: Place, what: str) -> str:
    if what == "uninstall":
        return f"gone; {place.sysconfdir}/el-dorado, /var/lib/el-dorado and /var/log/el-dorado are left"
    return f"""{place.version} is in {place.home}. As root:
  systemd-sysusers                      # makes the user el-dorado
  systemctl daemon-reload
  systemctl enable --now el-dorado      # now and at every boot; docs/service.md"""


if __name__ == "__main__":
    sys.exit(main())
