"""Repair symbols against linear algebra over GF(2) done by numpy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError
from protocol.link import repair


def rank(rows: np.ndarray) -> int:
    """Over GF(2), by plain elimination."""
    rows, found = rows.copy() % 2, 0
    for column in range(rows.shape[1]):
        at = next((r for r in range(found, len(rows)) if rows[r, column]), None)
        if at is None:
            continue
        rows[[found, at]] = rows[[at, found]]
        others = [r for r in range(len(rows)) if r != found and rows[r, column]]
        rows[others] ^= rows[found]
        found += 1
    return found


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.integers(0, 300), st.integers(1, 40), st.data())
def test_all_chunks_are_known_exactly_when_the_symbols_and_chunks_that_came_span_them(object_id, base, span, data):
    rng = np.random.default_rng(data.draw(st.integers(0, 99)))
    chunks = {base + n: rng.bytes(20) for n in range(span)}
    solver, known, vectors = repair.Solver(), {}, []
    plan = data.draw(st.lists(st.integers(-span, 80), max_size=60))
    for step in plan:
        if step < 0:
            index = base - step - 1
            if index not in known:
                known[index] = chunks[index]
                known |= solver.learn(index, chunks[index])
            vectors.append([int(base + n == index) for n in range(span)])
        else:
            symbol = repair.decode(repair.encode(object_id, step, base, span, chunks.__getitem__, 20))
            mask = repair.members(object_id, step, base, span)
            known |= solver.add(mask, symbol, known)
            vectors.append([mask >> n & 1 for n in range(span)])
        assert all(chunks[index] == got for index, got in known.items())
    complete = bool(vectors) and rank(np.array(vectors, np.uint8)) == span
    assert (len(known) == span) == complete
    assert len(solver) + len(known) <= span


def test_two_symbols_more_than_were_lost_are_enough_in_three_of_four_cases():
    enough = 0
    for trial in range(400):
        rng = np.random.default_rng(trial)
        lost = rng.choice(30, 8, replace=False)
        masks = [repair.members(trial, 100 + n, 0, 30) for n in range(10)]
        enough += rank(np.array([[m >> int(i) & 1 for i in lost] for m in masks], np.uint8)) == 8
    assert enough / 400 >= 0.70  # a random matrix of 10 by 8 over GF(2): 0.7722


@pytest.mark.parametrize("span", [1, 2, 255])
def test_a_symbol_is_never_empty_and_holds_only_chunks_of_its_span(span):
    masks = [repair.members(9, serial, 7, span) for serial in range(200)]
    assert all(0 < mask < 1 << span for mask in masks)


@pytest.mark.parametrize("body", [b"", bytes(3), bytes(8)])
def test_what_is_no_symbol_is_a_wire_error(body):
    with pytest.raises(WireError):
        repair.decode(body)
