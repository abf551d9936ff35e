"""filterpy's ExtendedKalmanFilter, from the one file that holds it.

`import filterpy` loads the whole library, and `filterpy.stats` all of scipy.stats: 35 MiB, and half of the processor
time of a start of the flight program. EKF.py needs two helpers of `filterpy.common` only, and `filterpy.stats.logpdf`
for a likelihood that is not used here. So the `__init__` of filterpy's packages does not run while EKF.py is imported,
and `logpdf` loads the real function when it is called. Afterwards `sys.modules` is restored: `import filterpy` loads
the whole library.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec, module_from_spec
from types import ModuleType
from typing import Any

FOLDERS = ("filterpy", "filterpy.kalman")
STATS = "filterpy.stats"


@contextmanager
def folders_alone() -> Iterator[None]:
    """Within the block, FOLDERS are packages whose `__init__` does not run. Raises ImportError without filterpy."""
    before = _filterpy()
    for name in before:
        del sys.modules[name]
    try:
        for name in FOLDERS:
            spec = find_spec(name)
            if spec is None:
                raise ImportError("filterpy is not installed: install the packages of requirements.lock", name=name)
            sys.modules[name] = module_from_spec(spec)
        sys.modules[STATS] = ModuleType(STATS)
        sys.modules[STATS].__dict__["logpdf"] = _logpdf
        yield
    finally:
        for name in _filterpy():
            del sys.modules[name]
        sys.modules.update(before)


def _filterpy() -> dict[str, ModuleType]:
    return {name: module for name, module in sys.modules.items() if name.partition(".")[0] == "filterpy"}


def _logpdf(*arguments: Any, **named: Any) -> Any:
    return importlib.import_module(STATS).logpdf(*arguments, **named)


with folders_alone():
    from filterpy.kalman.EKF import ExtendedKalmanFilter as ExtendedKalmanFilter
