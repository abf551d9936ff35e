"""TABLE of what is mutated and which tests must notice; TABLE of mutants that no test can notice, with the reason.

To add a module: a row in TARGETS with its own test files, fastest first. A survivor is a missing test; only what
behaves the same for every input is equivalent, and then the reason says why.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from protocol.tables.modes import TRANSITIONS, Mode
from tests.mutation.flips import Flip, flips
from tests.mutation.serve import red
from tests.mutation.trials import Trial

LIMIT_S = 60


class Target(NamedTuple):
    """A module and the tests that are its own."""

    module: str
    tests: tuple[str, ...]


TARGETS = (
    Target(
        "onboard.motion.kinematics",
        ("tests/onboard/motion/test_kinematics.py", "tests/onboard/motion/test_degraded.py"),
    ),
    Target("onboard.bus_guard.rules", ("tests/onboard/app/test_bus_guard.py",)),
    Target("onboard.bus_guard.command", ("tests/onboard/app/test_bus_guard.py",)),
    Target("protocol.link.datagrams", ("tests/protocol/link/test_link.py", "tests/protocol/link/test_security.py")),
    Target("protocol.link.direct", ("tests/protocol/link/test_direct.py",)),
    Target(
        "protocol.link.keyring",
        ("tests/protocol/link/test_link.py", "tests/protocol/link/test_security.py", "tests/docs/test_wire_page.py"),
    ),
    Target("transport.key_file", ("tests/onboard/drivers/test_link_port.py",)),
    Target(
        "onboard.drivers.link.port",
        ("tests/onboard/drivers/test_link_port.py", "tests/protocol/link/test_security.py"),
    ),
    Target("onboard.drivers.link.saved_state", ("tests/protocol/link/test_security.py",)),
    Target("onboard.core.modes.lease", ("tests/onboard/core/test_lease.py",)),
    Target("protocol.tables.modes", ("tests/protocol/tables/test_transitions.py",)),
)

EQUIVALENT: Mapping[str, str] = {
    "protocol.link.keyring hkdf: len(out) < length -> len(out) <= length": "a block more, cut off at the end",
    "protocol.link.datagrams Opener._count: ahead < self._size -> ahead <= self._size": (
        "shifted by its whole size the window is as empty as a new one"
    ),
}


def control(target: Target) -> Trial:
    """The tests on the module as it is: they must hold, or a kill means nothing."""
    return Trial(f"{target.module} as it is", red, (target.module, source_of(target.module), target.tests), LIMIT_S)


def mutants(target: Target) -> Iterator[Trial]:
    """Every mutant of a module, in the order of its source."""
    source = source_of(target.module)
    changed = [*flips(source), *(_transitions(source) if target.module == Mode.__module__ else ())]
    for flip in changed:
        name = f"{target.module} {flip.name}"
        yield Trial(name, red, (target.module, flip.source, target.tests), LIMIT_S)


def source_of(module: str) -> str:
    """Its file's text."""
    found = find_spec(module)
    if found is None or found.origin is None:
        raise ModuleNotFoundError(module)
    return Path(found.origin).read_text()


def _transitions(source: str) -> Iterator[Flip]:
    """The table of transitions without one row, and with another next mode in it."""
    for k, row in enumerate(TRANSITIONS):
        other = Mode((row.next + 1) % len(Mode))
        cut, rest = f"TRANSITIONS[:{k}]", f"TRANSITIONS[{k + 1}:]"
        name = f"{row.state.name} {row.event} -> {row.next.name}"
        yield Flip(f"{name} removed", f"{source}\nTRANSITIONS = {cut} + {rest}\n")
        changed = f"(TRANSITIONS[{k}]._replace(next=Mode.{other.name}),)"
        yield Flip(f"{name} leads to {other.name}", f"{source}\nTRANSITIONS = {cut} + {changed} + {rest}\n")
