"""The aarch64 wheels of what `onboard`, `protocol`, `ground` and the tests need: versions and hashes of the lock."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterable

from tests.arm64.python import Emulated
from tools.installation.extras import LOCK, blocks, closure, plain, roots

TESTS = ("pytest", "hypothesis", "cantools")
LIBRARY = range(17, 37)  # the C library of a wheel: 2.17 to Debian 12's 2.36
_MADE = ".wheels"


def entries(names: Iterable[str], lock: str) -> str:
    """Return the lock's own entries of these packages. Raises LookupError for one that is not in the lock."""
    found = blocks(lock)
    if absent := [name for name in names if plain(name) not in found]:
        raise LookupError(f"requirements.lock has no {', '.join(absent)}")
    return "".join(found[plain(name)] for name in names)


def install(emulated: Emulated) -> int:
    """Put the wheels where the emulated Python finds them, once for each state of the lock; how many they are."""
    names = closure((*roots("onboard"), *roots("ground"), *TESTS))
    text, made = entries(names, LOCK.read_text()), emulated.site / _MADE
    if made.exists() and made.read_text() == text:
        return len(names)
    shutil.rmtree(emulated.site, ignore_errors=True)
    emulated.site.mkdir(parents=True)
    wanted = emulated.site.parent / "requirements.txt"
    wanted.write_text(text)
    platforms = [f"--platform=manylinux_2_{minor}_aarch64" for minor in reversed(LIBRARY)]
    subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--no-deps",
            "--only-binary=:all:",
            "--require-hashes",
            "--no-compile",
            f"--python-version={emulated.version}",
            *platforms,
            "--platform=manylinux2014_aarch64",
            f"--target={emulated.site}",
            "-r",
            wanted,
        ],
        check=True,
    )
    made.write_text(text)
    return len(names)
