"""Selection of the kernel build: the widest instruction set of this machine.

`EL_DORADO_SIMD=baseline|avx2|avx512` forces one (tests compare them bit by bit); on board it stays unset. All builds
come from the same sources and give the same bits: the compiler may not contract or reorder floating-point arithmetic.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
from types import ModuleType
from typing import TYPE_CHECKING

FORCED_BY = "EL_DORADO_SIMD"
VARIANTS = ("baseline", "avx2", "avx512")  # narrow to wide


def load(name: str) -> ModuleType:
    """Load one build by name. Raises ImportError if it was not built."""
    return importlib.import_module(f"onboard.native._kernels_{name}")


def available() -> tuple[str, ...]:
    """Builds that exist and that this machine can run, narrow to wide."""
    width = int(load("baseline").simd_width())
    built = [importlib.util.find_spec(f"onboard.native._kernels_{name}") is not None for name in VARIANTS]
    return tuple(name for k, name in enumerate(VARIANTS) if k <= width and built[k])


def chosen(forced: str = "") -> str:
    """Name of the build to use. Raises ImportError for a forced one that is not available."""
    names = available()
    if forced and forced not in names:
        raise ImportError(f"{FORCED_BY}={forced}: expected one of {', '.join(names)} on this machine")
    return forced or names[-1]


if TYPE_CHECKING:
    from onboard.native import _kernels

    kernels = _kernels
else:
    kernels = load(chosen(os.environ.get(FORCED_BY, "")))
