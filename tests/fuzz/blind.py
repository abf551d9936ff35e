"""Tries at a door from a seed: bytes from the door's generator, most of them damaged. Equal seeds give equal tries."""

from __future__ import annotations

import warnings

import numpy as np

from tests.fuzz.damage import damaged
from tests.fuzz.door import Door

SOUND_RATIO = 0.2  # of the tries: not damaged


def example(door: Door, seed: int, number: int) -> bytes:
    """Return the bytes of a try."""
    rng = np.random.default_rng((seed, number))
    made = door.make(rng)
    return made if rng.random() < SOUND_RATIO else damaged(made, rng)


def feed(door: Door, data: bytes) -> None:
    """Run one try. A warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        door.feed(data)


def tries(doors: dict[str, Door], name: str, seed: int, first: int, count: int) -> None:
    """Run `count` tries of a door. Raises AssertionError that names the first that failed."""
    for number in range(first, first + count):
        try:
            feed(doors[name], example(doors[name], seed, number))
        except Exception as error:
            again = f"python -m tests.fuzz {name} --blind --seed {seed} --first {number}"
            raise AssertionError(f"{name}: {type(error).__name__}: {error}; again: {again}") from error
