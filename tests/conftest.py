"""EL_DORADO_KERNELS=FOLDER runs the tests on the native modules of FOLDER (make test-sanitize) in place of ours.

No test is judged by how fast this machine is today: hypothesis has neither its deadline nor its check of slowness.
Its profile `fast` (make test) tries each law with at most FEW examples, `nightly` (all else) with its own number.
"""

from __future__ import annotations

import gc
import importlib.util
import os
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# how a module's file begins: its package
HOMES = {"_kernels": "onboard.native", "_wakes": "onboard.native", "_soil": "hil.native"}
FOLDER = "EL_DORADO_KERNELS"
FEW = 25


class KernelsOf:
    """Finds the native modules of one folder before those beside the sources. Loads none unasked."""

    def __init__(self, folder: Path) -> None:
        """Raises FileNotFoundError for a folder without native modules."""
        stems = {path.name.split(".")[0]: path for path in folder.glob("_*.so")}
        self.paths = {
            f"{home}.{stem}": path
            for stem, path in stems.items()
            for word, home in HOMES.items()
            if stem.startswith(word)
        }
        if not self.paths:
            raise FileNotFoundError(f"{FOLDER}={folder}: no native module there")

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """The module of this folder, if it has one of the name."""
        return importlib.util.spec_from_file_location(name, self.paths[name]) if name in self.paths else None


if os.environ.get(FOLDER):
    sys.meta_path.insert(0, KernelsOf(Path(os.environ[FOLDER]).resolve()))

pytest_plugins = ["tests.copies"]
collect_ignore = [] if importlib.util.find_spec("playwright") else ["page"]  # make test-page installs it and runs that

settings.register_profile("nightly", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("fast", settings.get_profile("nightly"), max_examples=FEW)
settings.load_profile("nightly")


def pytest_itemcollected(item: pytest.Item) -> None:
    """A law's own number of examples goes before the profile's: in the profile `fast` it is cut here."""
    law = getattr(item, "obj", None)
    own = getattr(law, "_hypothesis_internal_use_settings", None)
    if own and own.max_examples > FEW and settings.get_current_profile_name() == "fast":
        law._hypothesis_internal_use_settings = settings(own, max_examples=FEW)


def pytest_collection_finish() -> None:
    """Eight thousand items live to the end: no collection of garbage looks at them, and no copy of the process does."""
    gc.collect()
    gc.freeze()


def pytest_sessionfinish() -> None:
    """They are let go, so that the native modules do not report them as leaked."""
    gc.unfreeze()
