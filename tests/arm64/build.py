"""The project's wheel for aarch64, built here by GCC's cross compiler: quicker than a compiler under emulation."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

from tests.arm64.python import Emulated
from tools.installation.install import ROOT

TOOLCHAIN = Path(__file__).parent / "toolchain.cmake"
_MADE = ".sources"


def sources() -> Iterator[Path]:
    """All that goes into the wheel or says how to build it."""
    yield from (ROOT / "CMakeLists.txt", ROOT / "pyproject.toml", TOOLCHAIN)
    for package in ("protocol", "transport", "onboard", "hil", "ground", "pictures"):
        for path in sorted((ROOT / package).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                yield path


def digest() -> str:
    """SHA-256 of the sources, names and contents."""
    whole = hashlib.sha256()
    for path in sources():
        whole.update(f"{path.relative_to(ROOT)}\0".encode() + path.read_bytes())
    return whole.hexdigest()


def install(folder: Path, emulated: Emulated) -> bool:
    """Build it and put it where the emulated Python finds it; whether that was needed."""
    project, new = folder / "project", digest()
    (emulated.site / "el_dorado.pth").write_text(f"{project}\n")
    if (project / _MADE).exists() and (project / _MADE).read_text() == new:
        return False
    shutil.rmtree(project, ignore_errors=True)
    with zipfile.ZipFile(wheel(folder, emulated)) as packed:
        packed.extractall(project)
    (project / _MADE).write_text(new)
    return True


def wheel(folder: Path, emulated: Emulated) -> Path:
    """The wheel, in FOLDER/dist; what was compiled before stays in FOLDER/cmake. Raises CalledProcessError."""
    dist, log = folder / "dist", folder / "build.log"
    shutil.rmtree(dist, ignore_errors=True)
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "_PYTHON_HOST_PLATFORM": "linux-aarch64",  # read by sysconfig: the wheel's tag
        "SETUPTOOLS_EXT_SUFFIX": f".cpython-{emulated.tag}-aarch64-linux-gnu.so",
        "CMAKE_TOOLCHAIN_FILE": str(TOOLCHAIN),
        "CXXFLAGS": f"-isystem {headers(folder, emulated)}",
    }
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-v",
        "--disable-pip-version-check",
        "--no-build-isolation",
        "--no-deps",
        "-w",
        str(dist),
        "-C",
        f"build-dir={folder / 'cmake'}",
        "-C",
        f"cmake.define.Python_INCLUDE_DIR={emulated.root}/usr/include/python{emulated.version}",
        str(ROOT),
    ]
    with log.open("wb") as file:
        done = subprocess.run(command, env=environment, stdout=file, stderr=subprocess.STDOUT, check=False)
    if done.returncode:
        print("\n".join(log.read_text().splitlines()[-20:]), file=sys.stderr)
        done.check_returncode()
    return next(dist.glob("*_aarch64.whl"))


def headers(folder: Path, emulated: Emulated) -> Path:
    """A folder with Python's architecture-dependent header alone: the C library's is the compiler's own."""
    name = f"aarch64-linux-gnu/python{emulated.version}"
    link = folder / "include" / name
    link.parent.mkdir(parents=True, exist_ok=True)
    link.unlink(missing_ok=True)
    link.symlink_to(emulated.root / "usr/include" / name)
    return folder / "include"
