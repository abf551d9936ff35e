"""Foreign libraries of the bench call our elementary functions in place of the C library's (native/own_functions.hpp).

The engine, scipy's transforms and numpy's generators ask the C library for sines, exponentials and logarithms, whose
last bits differ by the processor. None of them can be told otherwise, so each gets our functions once it is loaded
(docs/determinism.md).
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

import numpy as np

from hil.native import _own_functions

Seed = int | list[int] | tuple[int, ...] | np.random.SeedSequence


@cache
def give_to(module: str) -> frozenset[str]:
    """Names of the functions that a compiled module now has from us. Raises RuntimeError where it cannot be written."""
    path = import_module(module).__file__
    if path is None:
        raise RuntimeError(f"{module}: it is not of a file")
    return frozenset(_own_functions.give(path))


def generator(seed: Seed) -> np.random.Generator:
    """numpy's generator of a seed: its normal and exponential numbers take logarithms."""
    give_to("numpy.random._generator")
    return np.random.default_rng(seed)
