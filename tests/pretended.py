"""Pretended processors: environment variables under which libraries compute as on another machine.

ROWS by name, OLDEST all of it at once. BLAS built for what a machine lacks would end the process: those rows are left
out there.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from onboard.native.variant import FORCED_BY, available

PLAIN_LIBRARY = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA"}
NO_AVX512 = {"NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}
NO_AVX2 = {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"}
NEEDS = {"Prescott": "baseline", "Sandybridge": "baseline", "Haswell": "avx2", "SkylakeX": "avx512"}
CORES = tuple(core for core, variant in NEEDS.items() if variant in available())
TWO_THREADS = {"OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"}
ROWS: Mapping[str, Mapping[str, str]] = {
    "numpy with all features": {},
    "numpy without AVX-512": NO_AVX512,
    "numpy without AVX2": NO_AVX2,
    **{f"BLAS for {core}": {"OPENBLAS_CORETYPE": core} for core in CORES},
    "C library without FMA and AVX2": PLAIN_LIBRARY,
    **{f"kernels for {variant}": {FORCED_BY: variant} for variant in available()},
    "BLAS with one thread": {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    "BLAS with two threads": TWO_THREADS,
    "another hash seed": {"PYTHONHASHSEED": "4242"},
}
OLDEST = {
    **PLAIN_LIBRARY, **NO_AVX2, **TWO_THREADS, "OPENBLAS_CORETYPE": "Prescott", "PYTHONHASHSEED": "4242",
    FORCED_BY: "baseline",
}  # fmt: skip
OWN = {name for row in (*ROWS.values(), OLDEST) for name in row}


def environment(row: Mapping[str, str]) -> dict[str, str]:
    """This process's, with these variables and none of the other rows'."""
    return {**{name: text for name, text in os.environ.items() if name not in OWN}, **row}
