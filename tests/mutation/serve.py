"""In a process of its own: tests run against a module whose source is another. No file of the tree is touched.

import onboard.motion.kinematics   ->   Served: its name and path, the mutated source, no bytecode kept
"""

from __future__ import annotations

import sys
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import spec_from_file_location
from types import CodeType

import pytest
from hypothesis import HealthCheck, settings

PROFILE = "mutation"
RED = (pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.INTERRUPTED)  # interrupted: a file could not be imported


class _Loader(SourceFileLoader):
    """The module's own loader, with another source."""

    def __init__(self, name: str, path: str, source: str) -> None:
        super().__init__(name, path)
        self._source = source

    def get_code(self, fullname: str) -> CodeType:
        """Neither from the file nor from its bytecode."""
        return compile(self._source, self.path, "exec", dont_inherit=True)


class Served:
    """Finds one module before all others do."""

    def __init__(self, module: str, source: str) -> None:
        self._module, self._source = module, source

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """The module with the other source, if it is the one."""
        if name != self._module:
            return None
        found = PathFinder.find_spec(name, path)
        if found is None or found.origin is None:
            return None
        return spec_from_file_location(name, found.origin, loader=_Loader(name, found.origin, self._source))


class _Witness:
    """The first test that fails."""

    def __init__(self) -> None:
        self.failed = ""

    def _note(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid

    pytest_runtest_logreport = pytest_collectreport = _note


def red(module: str, source: str, tests: tuple[str, ...]) -> str:
    """The first test that fails with this source as the module; "" where all hold.

    Examples of hypothesis are the same each time and none is kept. Raises RuntimeError where the tests say nothing:
    none was found, none imports the module, or it was there before.
    """
    if module in sys.modules:
        raise RuntimeError(f"{module} was imported before it could be another")
    settings.register_profile(
        PROFILE, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck)
    )
    sys.meta_path.insert(0, Served(module, source))
    witness = _Witness()
    code = pytest.main(["-x", "-q", "-p", "no:cacheprovider", f"--hypothesis-profile={PROFILE}", *tests], [witness])
    if code in RED and witness.failed:
        return witness.failed
    if code != pytest.ExitCode.OK or module not in sys.modules:
        imported = "imported" if module in sys.modules else "never imported"
        raise RuntimeError(f"pytest ended with {code!r}, {module} was {imported}")
    return ""
