"""`pytestmark = pytest.mark.copied`: each test of the module runs in a copy of the process, made by fork.

A fixture of the module may then drive a rover once, however many tests go on from there: no test sees what another
has done to it. The copy gives back its outcome; what it changes in memory ends with it.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable
from typing import Any

import pytest


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run the test's function in a copy and report its failure or skip here; None: not marked, pytest runs it."""
    if pyfuncitem.get_closest_marker("copied") is None:
        return None
    names = pyfuncitem._fixtureinfo.argnames
    kind, text = in_copy(lambda: pyfuncitem.obj(**{name: pyfuncitem.funcargs[name] for name in names}), pyfuncitem)
    if kind == "skipped":
        pytest.skip(text)
    if kind != "passed":
        pytest.fail(text, pytrace=False)
    return True


def in_copy(work: Callable[[], Any], item: pytest.Function) -> tuple[str, str]:
    """Return ("passed", "skipped" or "failed", the reason) of `work` in a child process."""
    sys.stdout.flush()
    sys.stderr.flush()
    come, go = os.pipe()
    child = os.fork()
    if child == 0:
        try:  # whatever happens, no copy goes on with pytest's session
            os.close(come)
            with os.fdopen(go, "wb") as pipe:
                pickle.dump(_outcome(work, item), pipe)
        finally:
            os._exit(0)
    os.close(go)
    with os.fdopen(come, "rb") as pipe:
        answer = pipe.read()
    _, status = os.waitpid(child, 0)
    if not answer:
        return "failed", f"the copy of the process ended with status {os.waitstatus_to_exitcode(status)}"
    found: tuple[str, str] = pickle.loads(answer)
    return found


def _outcome(work: Callable[[], Any], item: pytest.Function) -> tuple[str, str]:
    try:
        work()
    except pytest.skip.Exception as skipped:
        return "skipped", str(skipped)
    except BaseException:  # noqa: BLE001  whatever ends the test is its outcome
        return "failed", str(item.repr_failure(pytest.ExceptionInfo.from_current()))
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
    return "passed", ""
