"""`python -m tests.fuzz_doors [DOOR ...] [--seconds S] [--seed N]`: hostile bytes at the station's doors.

Each try has a seed of its own; a try that ends with anything but a documented error is told with the command that
repeats it.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable

import numpy as np

from tests.doors import archive, link, products

DOORS: dict[str, Callable[[np.random.Generator], None]] = {
    "products": products.one, "datagrams": link.datagrams, "forged": link.forged, "gateway": link.gateway,
    "archive": archive.one,
}  # fmt: skip
AT_ONCE = 50


def tries(door: str, seed: int, first: int, count: int) -> None:
    """So many tries of a door. Raises AssertionError that names the first that failed."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for number in range(first, first + count):
            try:
                DOORS[door](np.random.default_rng((seed, number)))
            except Exception as error:
                again = f"python -m tests.fuzz_doors {door} --seed {seed} --first {number}"
                raise AssertionError(f"{door}: {type(error).__name__}: {error}; again: {again}") from error


def main() -> None:
    """Tries of each door in turn until the time is over."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("doors", nargs="*", metavar="DOOR", help=f"of {', '.join(DOORS)}; none: all")
    parser.add_argument("--seconds", type=float, default=120)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="the number of the first try")
    asked = parser.parse_args()
    if unknown := set(asked.doors) - set(DOORS):
        parser.error(f"no door {', '.join(unknown)}: there are {', '.join(DOORS)}")
    began, number = time.monotonic(), asked.first
    while time.monotonic() - began < asked.seconds:
        for door in asked.doors or DOORS:
            tries(door, asked.seed, number, AT_ONCE)
        number += AT_ONCE
    print(f"{number - asked.first} tries at each of {', '.join(asked.doors or DOORS)}: documented errors alone")


if __name__ == "__main__":
    main()
