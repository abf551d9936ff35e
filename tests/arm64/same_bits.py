"""The kernels' arithmetic by itself: one C++ program, compiled here and for aarch64, must print the same lines.

It needs the cross compiler, qemu and the root's C++ library; neither Python nor wheels. Seconds of processor time.
"""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

from tests.arm64.python import QEMU
from tools.installation.install import ROOT

SOURCE = Path(__file__).parent / "same_bits.cpp"
FLAGS = ("-std=gnu++17", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")  # as in CMakeLists.txt


def lines(folder: Path, compiler: str, flags: Sequence[str] = FLAGS, runner: Sequence[str] = ()) -> list[str]:
    """Output of the program built by this compiler. Raises CalledProcessError."""
    program = folder / f"same_bits_{compiler}"
    subprocess.run([compiler, *flags, SOURCE, "-o", program], cwd=ROOT, check=True)
    return subprocess.run([*runner, program], check=True, capture_output=True, text=True).stdout.splitlines()


def difference(here: Sequence[str], there: Sequence[str]) -> str:
    """The first line that is another there, in words; "" where there is none."""
    if len(here) != len(there) or not here:
        return f"{len(here)} lines here, {len(there)} there"
    return next((f"{a} here, {b.rpartition(': ')[2]} there" for a, b in zip(here, there, strict=True) if a != b), "")


def check(folder: Path, root: Path) -> str:
    """The first difference between this processor and an emulated aarch64. Raises CalledProcessError."""
    emulated = lines(folder, "aarch64-linux-gnu-g++", runner=(QEMU, "-L", str(root)))
    return difference(lines(folder, "g++"), emulated)
