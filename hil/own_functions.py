"""The project's elementary functions for foreign libraries of the bench, in place of the C library's.

The physics engine, scipy and numpy's generators call the C library for sines, exponentials and logarithms. The last
bits of these depend on the processor, and no library has a setting for it (docs/determinism.md). `give_to` replaces
the addresses in the import tables of a loaded library (native/own_functions.hpp). It changes the memory of this
process, no file. It needs ELF libraries, so Linux. The flight program and the ground station never do this.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module

import numpy as np

from hil.native import _own_functions

Seed = int | list[int] | tuple[int, ...] | np.random.SeedSequence


@cache
def give_to(module: str) -> frozenset[str]:
    """Replace the elementary functions that a compiled module calls; return their names.

    Raises RuntimeError if the module is no shared library, its tables have none of the functions or are not writable.
    """
    path = import_module(module).__file__
    if path is None:
        raise RuntimeError(f"{module}: no shared library")
    given = frozenset(_own_functions.give(path))
    if not given:
        raise RuntimeError(f"{module}: its import tables have none of the functions to replace")
    return given


def generator(seed: Seed) -> np.random.Generator:
    """numpy's generator of a seed; its normal and exponential numbers use our logarithm."""
    give_to("numpy.random._generator")
    return np.random.default_rng(seed)
