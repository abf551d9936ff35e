"""Physics engine: the only import of pybullet; suppresses the banner that its C code prints to standard error.

The engine computes with our elementary functions (hil.own_functions).
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator

from hil.own_functions import give_to


@contextlib.contextmanager
def _quiet_stderr() -> Iterator[None]:
    """Redirect file descriptor 2 to the null device inside the block. Exceptions pass and are printed after it."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


with _quiet_stderr():
    import pybullet
give_to("pybullet")

SOIL, ROCK, BODY, WHEEL = 1, 2, 4, 8  # collision groups

__all__ = ["BODY", "ROCK", "SOIL", "WHEEL", "pybullet"]
