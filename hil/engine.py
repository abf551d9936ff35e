"""The physics engine: the only import of pybullet, whose C code greets on file descriptor 1; here nobody hears it."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def _quiet_stdout() -> Iterator[None]:
    """File descriptor 1 leads to nowhere inside the block; what Python and C keep in buffers is written in time."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        ctypes.CDLL(None).fflush(None)
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


with _quiet_stdout():
    import pybullet

__all__ = ["pybullet"]
