"""Products and equations with a fixed order of every sum."""

from fractions import Fraction

import numpy as np
import pytest

from onboard.native.linear import chain, decorrelated, inner, matrix, norm, product, solve
from onboard.native.variant import available, load
from onboard.perception.map import cell_classes


def in_order(a, b):
    """a @ b, each sum from its first term to its last."""
    out = np.zeros((len(a), b.shape[1]))
    for i, j in np.ndindex(out.shape):
        total = a[i, 0] * b[0, j]
        for k in range(1, a.shape[1]):
            total = total + a[i, k] * b[k, j]
        out[i, j] = total
    return out


@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 3, 3), (500, 3, 3), (13, 13, 13), (4, 13, 4), (7, 49, 9), (2, 5, 1)])
def test_each_sum_of_a_product_goes_from_its_first_term_to_its_last_in_every_build(shape):
    n, k, m = shape
    random = np.random.default_rng(n + k)
    a, b = random.normal(size=(n, k)), random.normal(size=(k, m))
    made = product(a, b)
    assert made.tobytes() == in_order(a, b).tobytes()
    for variant in available():
        out = np.empty((n, m))
        load(variant).product_into(a, b, out)
        assert out.tobytes() == made.tobytes()


def test_vectors_views_and_float32_multiply_as_arrays_do():
    random = np.random.default_rng(1)
    a, v = random.normal(size=(6, 4)), random.normal(size=4)
    for left, right in ((a, v), (v, a.T), (v, v), (a[::2, 1:], a[:3].T[1:]), (a.astype(np.float32), v)):
        assert np.shape(product(left, right)) == np.shape(left @ right)
        assert np.allclose(product(left, right), left @ right, rtol=1e-12)
    assert inner(v, v) == float(product(v, v)) and norm(np.array([2.0, 3.0, 6.0])) == 7.0
    assert np.allclose(chain(a, a.T, a), a @ a.T @ a)
    assert product(np.empty((0, 3)), np.eye(3)).shape == (0, 3)
    with pytest.raises(ValueError, match="inner sides differ"):
        product(a, a)


def test_equations_are_solved_to_the_last_digits_and_the_same_in_every_build():
    random = np.random.default_rng(2)
    for n in range(1, 7):
        a, x = random.normal(size=(n, n)), random.normal(size=(n, 3))
        found = solve(a, a @ x)
        assert np.allclose(found, x, rtol=1e-9, atol=1e-9)
        for variant in available():
            used, out = a.copy()[None], (a @ x)[None].copy()
            assert load(variant).solve_into(used, out)
            assert out[0].tobytes() == found.tobytes()
    exact = solve(np.array([[2.0, 1.0], [1.0, 3.0]]), np.array([3.0, 5.0]))
    assert [Fraction(v).limit_denominator(100) for v in exact.tolist()] == [Fraction(4, 5), Fraction(7, 5)]


def test_many_equations_at_once_are_each_as_alone():
    random = np.random.default_rng(3)
    a, b = random.normal(size=(20, 3, 3)), random.normal(size=(20, 3))
    assert solve(a, b).tobytes() == np.array([solve(one, right) for one, right in zip(a, b)]).tobytes()
    assert solve(np.empty((0, 3, 3)), np.empty((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("a", [np.zeros((2, 2)), np.array([[1.0, 2.0], [2.0, 4.0]]), np.full((2, 2), np.nan)])
def test_a_singular_matrix_is_an_error(a):
    with pytest.raises(np.linalg.LinAlgError):
        solve(a, np.ones(2))


def test_a_pivot_of_zero_is_no_singular_matrix():
    assert solve(np.array([[0.0, 2.0], [4.0, 0.0]]), np.array([2.0, 8.0])).tolist() == [2.0, 1.0]


def test_correlated_measurements_taken_apart_tell_the_same_as_together():
    random = np.random.default_rng(4)
    root, rows, off = random.normal(size=(4, 4)), random.normal(size=(4, 6)), random.normal(size=4)
    noise = root @ root.T
    variances, (apart, rest) = decorrelated(noise, rows, off)
    together = rows.T @ np.linalg.solve(noise, np.column_stack([rows, off]))
    told = (apart / np.array(variances)[:, None]).T @ np.column_stack([apart, rest])
    assert np.allclose(told, together)
    assert decorrelated(np.zeros((2, 2)), rows[:2], off[:2])[0] == [0.0, 0.0]


def test_foreign_code_multiplies_a_matrix_in_our_order():
    random = np.random.default_rng(5)
    a, b = random.normal(size=(13, 13)), random.normal(size=(13, 13))
    want = in_order(a, b).tobytes()
    m = matrix(a)
    assert np.dot(m, b).tobytes() == m.dot(b).tobytes() == (m @ b).tobytes() == (a @ matrix(b)).tobytes() == want
    assert isinstance(np.dot(m, b) + b, type(m)) and type(np.asarray(m)) is np.ndarray


def test_rounded_tables_are_far_from_where_rounding_turns():
    scaled = np.abs(cell_classes.SPREAD) * 1e9
    assert (np.abs(scaled - np.floor(scaled) - 0.5) > 1e-5).all()  # the C libraries differ by 1e-15, scaled 1e-6
