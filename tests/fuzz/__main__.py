"""`python -m tests.fuzz [DOOR ...]`: hostile bytes at every input from outside.

Each door gets its time. A try ends with the door's result or with its documented error. Everything else is a finding:
an exception, a warning, a try of over 20 s, memory that grows. A finding is printed with the command that repeats it.

With atheris (`make fuzz` installs it, on x86-64) inputs that reach new code are stored in build/fuzz and damaged
further; --keep stores the shortest of them with the tests. Without it, or with --blind, inputs are made and damaged
from a seed.

Exit codes: 0 nothing found, 1 something found, 2 wrong usage, 130 Ctrl-C.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

from tests.fuzz import guided
from tests.fuzz.blind import feed, tries
from tests.fuzz.doors import DOORS

AT_ONCE = 50
GROWN_MB = 256


def blind(name: str, seconds: float, seed: int, first: int) -> int:
    """Try a door until its time is over; returns the number of tries. Raises AssertionError."""
    began, number, before_mb = time.monotonic(), first, _peak_mb()
    while number == first or time.monotonic() - began < seconds:
        tries(DOORS, name, seed, number, AT_ONCE)
        number += AT_ONCE
    assert _peak_mb() - before_mb < GROWN_MB, f"{name}: {_peak_mb() - before_mb:.0f} MB more"
    return number - first


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def hunt(name: str, asked: argparse.Namespace) -> bool:
    """Fuzz one door; returns whether nothing was found."""
    if asked.blind or not guided.available():
        try:
            print(f"{name}: {blind(name, asked.seconds, asked.seed, asked.first)} tries, nothing found", flush=True)
        except AssertionError as error:
            traceback.print_exception(error)
            return False
        return True
    ended = guided.run(name, round(asked.seconds), asked.seed, asked.out)
    if ended.found is not None:
        told = ended.said.partition("=== Uncaught")[2] or ended.said
        print(f"{name}: FOUND by {ended.found}\n{told[:3000]}\nagain: python -m tests.fuzz {name} --file {ended.found}")
        return False
    if not ended.tries:
        print(f"{name}: no try was made; see {asked.out / f'{name}.log'}")
        return False
    more = f", {guided.keep(name, asked.out)} put beside the tests" if asked.keep else ""
    print(
        f"{name}: {ended.tries} tries, {ended.kept} inputs in the corpus, {ended.peak_mb} MB at most, nothing found"
        + more,
        flush=True,
    )
    return True


def main(words: Sequence[str]) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("doors", nargs="*", metavar="DOOR", help=f"of {', '.join(DOORS)}; none: all")
    parser.add_argument("--seconds", type=float, default=120, help="of each door (120)")
    parser.add_argument("--in-all", type=float, help="seconds of all doors together, in place of --seconds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--blind", action="store_true", help="without looking at the code that is reached")
    parser.add_argument("--first", type=int, default=0, help="with --blind: the number of the first try")
    parser.add_argument("--file", type=Path, help="give the door these bytes, once")
    parser.add_argument("--keep", action="store_true", help="put the shortest inputs of the corpus beside the tests")
    parser.add_argument("--out", type=Path, default=Path("build/fuzz"), help="folder (build/fuzz)")
    asked = parser.parse_args(list(words))
    if unknown := set(asked.doors) - set(DOORS):
        parser.error(f"no door {', '.join(sorted(unknown))}: there are {', '.join(DOORS)}")
    if asked.file:
        if len(asked.doors) != 1 or not asked.file.is_file():
            parser.error("--file takes one DOOR and a file that is there")
        feed(DOORS[asked.doors[0]], asked.file.read_bytes())
        print(f"{asked.doors[0]}: takes or refuses {asked.file}")
        return 0
    doors = asked.doors or list(DOORS)
    asked.seconds = asked.seconds if asked.in_all is None else asked.in_all / len(doors)
    try:
        return 0 if all([hunt(name, asked) for name in doors]) else 1
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
