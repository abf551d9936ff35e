"""The fuzz run has a row for every door, a short run of each finds nothing, and what is wrong is found."""

from __future__ import annotations

import importlib
import os
import pkgutil
import signal

import numpy as np
import pytest
from hypothesis import strategies as st

from onboard import kernel_calls, native
from tests.fuzz.kernels import check, hunt, smallest
from tests.fuzz.rows import ROWS, Row, arrays, together


def test_every_door_to_the_kernels_has_a_row() -> None:
    modules = [
        importlib.import_module(f"{package.__name__}.{m.name}")
        for package in (kernel_calls, native)
        for m in pkgutil.iter_modules(package.__path__)
        if not m.name.startswith("_")
    ]
    doors = {m.__name__ for m in modules if hasattr(m, "kernels")} - {"onboard.native.variant"}
    assert doors == {door.__name__ for row in ROWS.values() for door in row.doors}


@pytest.mark.parametrize("name", ROWS)
def test_odd_arguments_end_in_a_result_or_a_value_error_on_every_build(name: str) -> None:
    hunt(ROWS[name], 40, 1, check)


def _faulty(size: int, layer: object) -> tuple[np.ndarray, ...]:
    if size > 6 and isinstance(layer, np.ndarray):
        os.kill(os.getpid(), signal.SIGKILL)
    return (np.zeros(size),)


def test_a_call_that_ends_its_process_is_reported_with_its_smallest_arguments() -> None:
    row = Row((), together(size=st.integers(0, 40), layer=arrays((2,), np.float32)), _faulty)
    said = smallest(row, 100, 1)
    assert "ended with -9" in said and "size = 7\n" in said and "float32 (2,)" in said


def test_a_call_that_raises_something_else_is_reported() -> None:
    row = Row((), together(size=st.integers(0, 40)), lambda size: (np.zeros(3)[[size]],))
    said = smallest(row, 100, 1)
    assert "IndexError" in said and "size = 3\n" in said
