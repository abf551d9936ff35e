"""make test-arm64: the flight program for aarch64, under qemu-user, on this machine.

Debian's aarch64 Python                                       build/arm64, made once
the kernels' arithmetic as a program of C++                   there and here: the same bits
the lock's wheels, our own wheel                              build/arm64, each made once
kernel tests and a part of the suite                          there, under emulation
a short drive, all of it here                                 the reference
the same drive, the flight program under emulation            bench, link and ground here, over sockets
both compared, both records replayed on both                  here (tests/arm64/test_flight.py)
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from tests.arm64 import build, root, same_bits, wheels
from tests.arm64.python import QEMU, Emulated
from tests.vcan import needs
from tools.installation.install import ROOT

BUILD = ROOT / "build/arm64"
WORK, TREE = BUILD / "work", BUILD / "tree"
PROGRAMS = {QEMU: "qemu-user", "aarch64-linux-gnu-g++": "g++-aarch64-linux-gnu", "apt-get": "apt", "dpkg-deb": "dpkg"}
PLAIN_PYTEST = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # plugins that these tests do not use take long to load
UNAVAILABLE, SOFTWARE, INTERRUPTED = 69, 70, 130


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Say what begins, and how long it took."""
    print(f"arm64: {what} ...", flush=True)
    began = time.monotonic()
    yield
    print(f"arm64: {what}: {time.monotonic() - began:.0f} s", flush=True)


class DifferenceError(RuntimeError):
    """The two processors compute different bits; the text says where first."""


def python() -> Emulated:
    """Debian's Python for aarch64, and the kernels' arithmetic compared. Raises RootError, DifferenceError."""
    BUILD.mkdir(parents=True, exist_ok=True)
    with timed("Debian's aarch64 Python"):
        emulated = Emulated(BUILD / "venv", root.make(BUILD))
    with timed("the kernels' arithmetic, there and here"):
        if difference := same_bits.check(BUILD, emulated.root):
            raise DifferenceError(difference)
    return emulated


def packages(emulated: Emulated) -> None:
    """The lock's wheels and ours. Raises CalledProcessError."""
    with timed("wheels of the lock"):
        print(f"arm64: {wheels.install(emulated)} packages, every hash as in requirements.lock", flush=True)
    with timed("our wheel, by the cross compiler"):
        build.install(BUILD, emulated)


def suite(emulated: Emulated, files: Sequence[str]) -> int:
    """The exit code of pytest under emulation, in a tree that has the tests, their tools, and not the sources."""
    shutil.rmtree(TREE, ignore_errors=True)
    for folder in ("tests", "tools"):
        shutil.copytree(ROOT / folder, TREE / folder, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy2(ROOT / "pyproject.toml", TREE)
    command = [emulated.python, "-m", "pytest", "-v", "--tb=short", "--color=no", *files]
    return subprocess.run(command, cwd=TREE, env={**os.environ, **PLAIN_PYTEST}, check=False).returncode


def drive(folder: Path, *onboard_python: str) -> int:
    """The exit code of tests.vcan.drive over the bench's hub; the run is in `folder`."""
    command = [sys.executable, "-m", "tests.vcan.drive", "hub", str(folder), *onboard_python]
    return subprocess.run(command, cwd=ROOT, check=False).returncode


def compare() -> int:
    """The exit code of pytest over what both drives left."""
    command = [sys.executable, "-m", "pytest", "-vv", "--tb=short", "--color=no", "tests/arm64/test_flight.py"]
    environment = {**os.environ, **PLAIN_PYTEST, "EL_DORADO_ARM64": str(BUILD)}
    return subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode


def arithmetic() -> int:
    """0 where the bits are the same. Raises RootError, DifferenceError."""
    python()
    return 0


def run(files: Sequence[str]) -> int:
    """All parts, also after one that failed; the exit code of the first that did."""
    emulated = python()
    packages(emulated)
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir()
    codes = list[int]()
    if files:
        with timed(f"{len(files)} files of tests under emulation"):
            codes.append(suite(emulated, files))
    with timed("drive, all of it here"):
        codes.append(drive(WORK / "here"))
    with timed("drive, the flight program under emulation"):
        codes.append(drive(WORK / "there", str(emulated.python)))
    with timed("comparison and replays"):
        codes.append(compare())
    return next((code for code in codes if code), 0)


def main() -> int:
    """Exit codes: 0 all passed, 69 not installed, 70 other bits or nothing to test could be made, else pytest's."""
    parser = argparse.ArgumentParser(prog="python -m tests.arm64", description="The flight program on emulated ARM64.")
    parser.add_argument("files", nargs="*", help="tests to run under emulation before the drives")
    parser.add_argument("--arithmetic", action="store_true", help="only compare the kernels' arithmetic, in C++")
    parser.add_argument("--check", action="store_true", help="only say what is missing on this machine")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    if packages := needs.missing(PROGRAMS):
        print(needs.install(packages), file=sys.stderr)
        return UNAVAILABLE
    if options.check:
        return 0
    began = time.monotonic()
    try:
        code = arithmetic() if options.arithmetic else run(options.files)
    except (root.RootError, DifferenceError, subprocess.CalledProcessError, OSError, LookupError) as error:
        print(f"arm64: {error}", file=sys.stderr)
        code = SOFTWARE
    except KeyboardInterrupt:
        print("arm64: ended by Ctrl-C", file=sys.stderr)
        return INTERRUPTED
    print(f"arm64: {'passed' if code == 0 else 'failed'} in {time.monotonic() - began:.0f} s")
    return code


if __name__ == "__main__":
    sys.exit(main())
