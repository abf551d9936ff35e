"""Selection of the kernel build: the widest instruction set of this machine.

x86-64 has three builds; other processors have the baseline only, which on ARM64 uses NEON.
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


def built() -> tuple[str, ...]:
    """The builds that exist for this machine's architecture, narrow to wide; the baseline always does."""
    found = importlib.util.find_spec
    return VARIANTS[:1] + tuple(name for name in VARIANTS[1:] if found(f"onboard.native._kernels_{name}") is not None)


def available() -> tuple[str, ...]:
    """Builds that exist and that this machine can run, narrow to wide."""
    width = int(load("baseline").simd_width())
    return tuple(name for name in built() if VARIANTS.index(name) <= width)


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
