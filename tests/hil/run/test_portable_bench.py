"""The bench computes the same on every processor. tests/onboard/native/test_portable_replay.py flies it."""

import ast
import math
from pathlib import Path

import pytest

from hil.native import _own_functions
from hil.own_functions import generator, give_to
from tests.onboard.native.test_portable_arithmetic import found_in

ROOT = Path(__file__).parents[3]
BENCH = ("devices", "faults", "link", "plant", "run", "scenarios", "terrain", "world")
MODULES = ("records.py",)
AFTER_A_RUN = ("run/demo.py", "run/folder.py", "run/options.py", "run/processes.py", "run/status.py")  # or round it
ALLOWED = {  # (file, call): why it is the same everywhere
    ("terrain/fractal.py", "from scipy"): "its transform has our sines (hil.own_functions)",
    ("terrain/real_ground.py", "from scipy"): "splines by sums in a fixed order, with our powers (hil.own_functions)",
    ("terrain/rock_sizes.py", "from scipy.special"): "one integral of our exponentials (hil.own_functions)",
}
WHOLE = {  # built-in sums: of whole numbers
    "devices/can/hub.py", "devices/lidar/light.py", "link/impairment.py", "link/record.py",
}  # fmt: skip
FOREIGN = {  # what each asks of the C library in a run
    "pybullet": {"sin", "cos", "sincos", "atan2", "acos", "asin", "tan", "exp", "log", "pow"},
    "scipy.fft._pocketfft.pypocketfft": {"sincos"},
    "numpy.random._generator": {"exp", "log", "log1p", "expm1", "pow"},
    "scipy.special._ufuncs": {"exp", "log", "pow"},
    "scipy.ndimage._nd_image": {"pow"},
}


@pytest.mark.parametrize("module", FOREIGN)
def test_a_foreign_library_has_our_functions(module):
    assert give_to(module) >= FOREIGN[module]


def test_a_library_that_is_not_loaded_is_named():
    with pytest.raises(RuntimeError, match="nowhere"):
        _own_functions.give("/nowhere.so")


def test_a_library_without_any_of_the_functions_is_named():
    with pytest.raises(RuntimeError, match="_own_functions: its import tables have none"):
        give_to("hil.native._own_functions")


def test_the_engine_computes_with_our_sine():
    from hil.plant.engine import pybullet
    from onboard.native import elementary

    for angle in [0.1 * k for k in range(-30, 31)]:
        *_, z, w = pybullet.getQuaternionFromEuler((0.0, 0.0, angle))
        assert abs(z - elementary.sin(angle / 2)) < 1e-15 and abs(w - elementary.cos(angle / 2)) < 1e-15


@pytest.mark.parametrize(("ours", "exact"), [
    (_own_functions.log1p, math.log1p), (_own_functions.expm1, math.expm1),
])  # fmt: skip
@pytest.mark.parametrize("x", [-0.9, -0.3, -1e-5, -1e-17, 0.0, 1e-300, 1e-9, 0.2, 3.0, 50.0])
def test_a_function_near_its_zero_loses_no_digits(ours, exact, x):
    assert ours(x) == pytest.approx(exact(x), rel=1e-15, abs=0.0)


@pytest.mark.parametrize(("x", "y"), [
    (2.5, 0.3), (1e-3, -1.01), (7.0, 1.014), (-0.26, 7.0), (-2.0, -3.0), (0.0, 0.5), (0.0, 0.0), (1.0, 1e300),
    (4.0, -0.5), (3.0, 2.0),
])  # fmt: skip
def test_a_power_is_right_to_a_few_units_in_the_last_place(x, y):
    assert _own_functions.pow(x, y) == pytest.approx(x**y, rel=4e-15, abs=0.0)


def test_a_power_without_a_value_is_no_number():
    assert math.isnan(_own_functions.pow(-2.0, 0.5)) and _own_functions.pow(0.0, -0.5) == math.inf


def test_a_generator_of_a_seed_draws_the_same_again():
    assert generator([3, 1]).standard_normal(50).tolist() == generator([3, 1]).standard_normal(50).tolist()


def sources():
    """(name, text) of what a run of the bench computes with."""
    paths = [path for folder in BENCH for path in sorted((ROOT / "hil" / folder).rglob("*.py"))]
    for path in [*paths, *(ROOT / "hil" / name for name in MODULES)]:
        if (name := path.relative_to(ROOT / "hil").as_posix()) not in AFTER_A_RUN:
            yield name, path.read_text()


def test_the_bench_computes_by_ieee_operations_and_our_own_functions():
    broken = [
        f"hil/{name}:{line} {what}: use onboard.native.elementary, each or linear, or say why it may in ALLOWED"
        for name, text in sources()
        for line, what in found_in(ast.parse(text))
        if (name, what) not in ALLOWED and not (what == "sum()" and name in WHOLE)
    ]
    assert not broken


def test_the_bench_draws_by_generators_with_our_logarithms():
    assert not [name for name, text in sources() if "default_rng(" in text]
