"""Sine to logarithm by IEEE operations alone: how far from exact, at the borders, the same bits from every build."""

import math
import struct
from decimal import Decimal, localcontext

import numpy as np
import pytest

from onboard.native import each, elementary
from onboard.native.variant import available, load

DIGITS = 60
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211706798")
ULPS = {"sin": 1.0, "cos": 1.0, "tan": 2.2, "asin": 2.2, "acos": 2.2, "atan2": 1.0, "exp": 1.0, "log": 1.0}
NAN, INF = math.nan, math.inf
NAMES = ("sin", "cos", "tan", "asin", "acos", "exp", "log")


def exact_sine(x):
    """Of a Decimal, by its series after reduction to pi/4: 50 digits."""
    quarter = (x / (PI / 2)).to_integral_value()
    r = x - quarter * (PI / 2)
    sine, cosine, term = Decimal(0), Decimal(0), Decimal(1)
    for k in range(60):
        parts = (term, Decimal(0)) if k % 2 == 0 else (Decimal(0), term)
        sign = -1 if k % 4 > 1 else 1
        cosine, sine = cosine + sign * parts[0], sine + sign * parts[1]
        term = term * r / (k + 1)
    return (sine, cosine, -sine, -cosine)[int(quarter) % 4]


def exact_angle(y, x, guess):
    """The angle of (x, y) near `guess`: Newton's step on sin(angle) x - cos(angle) y, cubic."""
    angle = Decimal(guess)
    for _ in range(2):
        s, c = exact_sine(angle), exact_sine(angle + PI / 2)
        angle -= (s * x - c * y) / (c * x + s * y)
    return angle


EXACT = {
    "sin": exact_sine,
    "cos": lambda x: exact_sine(x + PI / 2),
    "tan": lambda x: exact_sine(x) / exact_sine(x + PI / 2),
    "asin": lambda x: exact_angle(x, (1 - x * x).sqrt(), math.asin(x)),
    "acos": lambda x: exact_angle((1 - x * x).sqrt(), x, math.acos(x)),
    "exp": lambda x: x.exp(),
    "log": lambda x: x.ln(),
}  # fmt: skip


def drawn(name, count=400):
    random = np.random.default_rng(3)
    if name in ("asin", "acos"):
        return np.concatenate([random.uniform(-1.0, 1.0, count), 1.0 - 10.0 ** random.uniform(-15, -1, 50)])
    if name == "exp":
        return np.concatenate([random.uniform(-700.0, 700.0, count), random.uniform(-1.0, 1.0, count)])
    if name == "log":
        return np.concatenate([10.0 ** random.uniform(-300, 300, count), random.uniform(0.5, 2.0, count)])
    multiples = np.arange(-40, 41) * (math.pi / 2)  # as near to an axis as a float64 comes
    small = 10.0 ** random.uniform(-18, -1, 50)
    return np.concatenate([random.uniform(-10.0, 10.0, count), random.uniform(-1e6, 1e6, count), multiples, small])


def ulps(value, exact):
    return abs(Decimal(value) - exact) / Decimal(math.ulp(float(exact)))


@pytest.mark.parametrize("name", NAMES)
def test_a_function_is_within_its_bound_of_the_exact_value(name):
    with localcontext() as context:
        context.prec = DIGITS
        worst = max(ulps(getattr(elementary, name)(x), EXACT[name](Decimal(x))) for x in drawn(name).tolist())
    assert worst <= ULPS[name]


def test_the_angle_of_a_place_is_within_its_bound_of_the_exact_value():
    random = np.random.default_rng(4)
    places = (random.normal(size=(400, 2)) * 10.0 ** random.uniform(-8, 8, (400, 2))).tolist()
    with localcontext() as context:
        context.prec = DIGITS
        worst = max(
            ulps(elementary.atan2(y, x), exact_angle(Decimal(y), Decimal(x), math.atan2(y, x))) for y, x in places
        )
    assert worst <= ULPS["atan2"]


def bits(value):
    return struct.pack("<d", value)


def same(a, b):
    return (math.isnan(a) and math.isnan(b)) or bits(a) == bits(b)


@pytest.mark.parametrize(("name", "x", "value"), [
    ("sin", 0.0, 0.0), ("sin", -0.0, -0.0), ("sin", INF, NAN), ("sin", NAN, NAN), ("sin", 5e-324, 5e-324),
    ("cos", 0.0, 1.0), ("cos", -INF, NAN), ("cos", NAN, NAN), ("cos", 5e-324, 1.0),
    ("tan", -0.0, -0.0), ("tan", INF, NAN), ("tan", -5e-324, -5e-324),
    ("asin", -0.0, -0.0), ("asin", 1.0, math.pi / 2), ("asin", -1.0, -math.pi / 2), ("asin", 1.0 + 1e-15, NAN),
    ("acos", 1.0, 0.0), ("acos", -1.0, math.pi), ("acos", 0.0, math.pi / 2), ("acos", -1.1, NAN),
    ("exp", 0.0, 1.0), ("exp", -0.0, 1.0), ("exp", INF, INF), ("exp", -INF, 0.0), ("exp", 710.0, INF),
    ("exp", -746.0, 0.0), ("exp", -745.0, 5e-324), ("exp", NAN, NAN),
    ("log", 1.0, 0.0), ("log", 0.0, -INF), ("log", -0.0, -INF), ("log", -1.0, NAN), ("log", INF, INF),
    ("log", 5e-324, math.log(5e-324)), ("log", NAN, NAN),
])  # fmt: skip
def test_at_its_borders_a_function_is_what_ieee_says(name, x, value):
    assert same(getattr(elementary, name)(x), value)


@pytest.mark.parametrize("y", [0.0, -0.0, 1.0, -1.0, 5e-324, INF, -INF, NAN, 1e308])
@pytest.mark.parametrize("x", [0.0, -0.0, 1.0, -1.0, 5e-324, INF, -INF, NAN, -1e308])
def test_the_angle_at_zeros_and_infinities_is_the_standard_one(y, x):
    assert same(elementary.atan2(y, x), math.atan2(y, x))


def test_functions_are_odd_and_even_to_the_bit():
    for x in drawn("sin").tolist():
        assert same(elementary.sin(-x), -elementary.sin(x)) and same(elementary.cos(-x), elementary.cos(x))
        assert same(elementary.tan(-x), -elementary.tan(x))
    for x in drawn("asin").tolist():
        assert same(elementary.asin(-x), -elementary.asin(x))


def test_the_angle_lies_in_the_quadrant_of_its_place():
    random = np.random.default_rng(5)
    for y, x in random.normal(size=(500, 2)).tolist():
        angle = elementary.atan2(y, x)
        assert (angle > 0.0) == (y > 0.0) and (abs(angle) < math.pi / 2) == (x > 0.0)
        assert same(elementary.atan2(-y, x), -angle)
        assert abs(elementary.hypot(x, y) * elementary.cos(angle) - x) < 1e-14


def test_squares_of_sine_and_cosine_add_up_to_one_also_of_huge_angles():
    for x in [*drawn("sin").tolist(), 1e7, 1e15, 1e22, 1e300, -1.7e308]:
        s, c = elementary.sin(x), elementary.cos(x)
        assert abs(s * s + c * c - 1.0) < 5e-16


def values(kernels, name, x):
    out = np.empty_like(x)
    getattr(kernels, f"{name}_into")(x, out)
    return out


@pytest.mark.parametrize("name", NAMES)
def test_every_build_gives_the_same_bits_of_one_number_and_of_each(name):
    x = np.concatenate([drawn(name), [0.0, -0.0, NAN, INF, -INF, 5e-324, 1e22, -1e300]])
    one = [getattr(elementary, name)(number) for number in x.tolist()]
    made = getattr(each, name)(x)
    assert all(same(a, b) for a, b in zip(one, made.tolist(), strict=True))
    for variant in available():
        assert values(load(variant), name, x).tobytes() == made.tobytes()


def test_every_build_gives_the_same_angles_of_one_place_and_of_each():
    y, x = np.random.default_rng(6).normal(size=(2, 1000))
    made = each.atan2(y, x)
    assert made.tolist() == [elementary.atan2(b, a) for a, b in zip(x.tolist(), y.tolist())]
    for variant in available():
        out = np.empty(len(x))
        load(variant).atan2_into(y, x, out)
        assert out.tobytes() == made.tobytes()


def test_arrays_keep_their_shape_and_views_are_read_as_they_lie():
    x = np.linspace(-3.0, 3.0, 24).reshape(4, 6)
    assert each.sin(x[::2, 1:]).tolist() == each.sin(x)[::2, 1:].tolist()
    assert each.atan2(x, x[:, :1]).shape == (4, 6) and each.cos(np.empty((0, 3))).shape == (0, 3)


def test_distances_and_sums_go_from_first_to_last():
    assert elementary.dist((0.0, 0.0, 0.0), (2.0, 3.0, 6.0)) == 7.0
    assert elementary.total([1e16, 1.0, -1e16]) == 0.0  # a compensated sum says 1
    with pytest.raises(ValueError, match="shorter"):
        elementary.dist((0.0, 0.0), (1.0,))
