"""`python -m tests.fuzz.kernels [--seconds S] [--seed N] [ROW ...]`: odd arguments through every door to the kernels.

A call ends in a result, the same bits from every build of this machine, or in a ValueError. `make test-sanitize` runs
this on a build in which an access outside an array or undefined arithmetic ends the process. The hunt therefore runs in
a child. If the child dies, the same examples run again, each in a child of its own, and hypothesis finds the smallest
that kills it. The seeds are fixed; the seconds only limit the time.
"""

from __future__ import annotations

import argparse
import copy
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterable
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, note, seed, settings

import tests.conftest  # noqa: F401  the builds of EL_DORADO_KERNELS
from onboard.native import variant
from tests.fuzz.rows import ROWS, Row

EXAMPLES = 200  # of a row at a time
PATIENCE_S = 20  # a call that takes longer hangs
Check = Callable[[Row, dict[str, Any]], None]


def outcome(row: Row, arguments: dict[str, Any]) -> bytes | str:
    """Return the bits of the result, every NaN alike, or the text of the ValueError."""
    signal.alarm(PATIENCE_S)
    try:
        arrays = row.call(**copy.deepcopy(arguments))
    except ValueError as refused:
        return str(refused)
    finally:
        signal.alarm(0)
    return b"".join(np.where(a != a, np.nan, a).astype(a.dtype).tobytes() for a in arrays)


def check(row: Row, arguments: dict[str, Any]) -> None:
    """Raise AssertionError if a build differs from the baseline; any other exception of a door passes through."""
    before = {door: door.kernels for door in row.doors}
    try:
        found = {}
        for name in variant.available() if row.doors else ("baseline",):
            for door in row.doors:
                door.kernels = variant.load(name)
            found[name] = outcome(row, arguments)
        assert len(set(found.values())) == 1, f"the builds differ: {found}"
    finally:
        for door, kernels in before.items():
            door.kernels = kernels


def check_apart(row: Row, arguments: dict[str, Any]) -> None:
    """Do the same in a child; raises AssertionError if it dies."""
    said = in_child(lambda: check(row, arguments))
    assert not said, said


def in_child(work: Callable[[], None]) -> str:
    """Run `work` in a copy of this process; returns its error output if it failed or died, else ""."""
    with TemporaryFile() as words:
        child = os.fork()
        if child == 0:
            code = 1
            try:
                os.dup2(words.fileno(), 2)
                work()
                code = 0
            except BaseException:  # noqa: BLE001  the child tells whatever it was, and ends
                os.write(2, traceback.format_exc().encode())
            finally:
                os._exit(code)
        _, status = os.waitpid(child, 0)
        words.seek(0)
        said = words.read().decode(errors="replace").partition("SUMMARY: ")[0]  # behind it the sanitizer dumps bytes
    code = os.waitstatus_to_exitcode(status)
    return f"{said}\nended with {code}" if code else ""


def hunt(row: Row, examples: int, number: int, each: Check) -> None:
    """Try `examples` examples of a row's arguments; raises like `each`, with the smallest example noted."""

    @seed(number)
    @settings(
        max_examples=examples, database=None, deadline=None, phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(row.arguments)
    def one(arguments: dict[str, Any]) -> None:
        for name, value in arguments.items():
            note(f"{name} = {described(value)}")
        each(row, arguments)

    one()


def described(value: Any) -> str:
    """Describe arrays with the layout and alignment that numpy's repr leaves out."""
    if isinstance(value, list | tuple) and any(isinstance(v, np.ndarray) for v in value):
        return f"({', '.join(map(described, value))})"
    if not isinstance(value, np.ndarray):
        return repr(value)
    odd = "" if value.flags.carray else f" strides {value.strides}, aligned {value.flags.aligned}"
    return f"{value!r} {value.dtype} {value.shape}{odd}"


def smallest(row: Row, examples: int, number: int) -> str:
    """Return '' if the hunt finds nothing, else the finding with its smallest example."""
    found = in_child(lambda: hunt(row, examples, number, check))
    if found:
        try:
            hunt(row, examples, number, check_apart)
        except AssertionError:
            found = traceback.format_exc(limit=0)
    return found


def main(words: Iterable[str]) -> int:
    """Hunt row after row until the time is up; returns 1 if something was found."""
    asked = argparse.ArgumentParser(prog="tests.fuzz.kernels", description=__doc__)
    asked.add_argument("--seconds", type=float, default=120.0)
    asked.add_argument("--seed", type=int, default=1)
    asked.add_argument("rows", nargs="*", default=list(ROWS), metavar="ROW", help=", ".join(ROWS))
    options = asked.parse_args(list(words))
    began, done = time.monotonic(), 0
    while True:
        for name in options.rows:
            if time.monotonic() - began >= options.seconds:
                print(f"fuzz: {done * EXAMPLES} examples over {len(options.rows)} doors: nothing found")
                return 0
            number = options.seed * 1_000_000 + done
            found = smallest(ROWS[name], EXAMPLES, number)
            if found:
                print(f"fuzz: {name}, seed {number}\n{found}")
                return 1
            done += 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
