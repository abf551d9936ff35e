"""What feeds state, decisions and outputs computes the same on every processor: its sources are read for calls that do
not (docs/determinism.md). The same of a run: tests/onboard/native/test_portable_replay.py.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
FLIGHT = ("onboard/core", "onboard/devices", "onboard/perception", "onboard/planning", "onboard/motion",
          "onboard/kernel_calls", "onboard/native", "protocol")  # fmt: skip
MODULES = ("onboard/extrinsics.py", "onboard/records/__init__.py", "onboard/records/motion.py",
           "onboard/records/maps.py", "onboard/records/scan.py")  # fmt: skip
EXEMPT = {
    "onboard/perception/pose/registration.py": "its result is taken from the record (record/registrations.py)",
    "onboard/perception/pose/settling.py": "part of that",
    "onboard/perception/scan/tilt_lag.py": "of `onboard lidar lag` and `onboard calibrate`: nothing of it flies",
    "protocol/generated/eldorado_dialect.py": "generated, for ground stations",
}

LIBRARY = {  # the C library's, or CPython's own of another version
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "exp",
    "exp2", "expm1", "log", "log2", "log10", "log1p", "pow", "cbrt", "hypot", "dist", "sumprod", "gamma", "lgamma",
    "erf", "erfc",
}  # fmt: skip
VECTOR = LIBRARY | {  # numpy's: vector units, BLAS, or fused products
    "arcsin", "arccos", "arctan", "arctan2", "power", "float_power", "logaddexp", "matmul", "dot", "vdot", "inner",
    "vecdot", "einsum", "tensordot", "cov", "corrcoef", "polyfit", "polyval", "linalg", "fft", "logspace", "geomspace",
}  # fmt: skip
FOREIGN = {"scipy", "filterpy", "small_gicp", "statistics", "cmath"}

ALLOWED = {  # (file, call): why it is the same everywhere
    ("onboard/native/linear.py", "np.dot"): "its name, to put `product` in its place",
    ("onboard/native/linear.py", ".dot"): "`product` by that name",
    ("onboard/native/linear.py", "np.linalg"): "the name of an error",
    ("protocol/scip/block_reader.py", "np.dot"): "whole numbers of 18 bits, exact in float32 in any order",
    ("onboard/perception/pose/ekf.py", "from filterpy.kalman.EKF"):
        "its products are of `linear.Matrix`, and it inverts one number at a time",
    ("onboard/perception/map/cell_classes.py", "from statistics"): "rounded to 1e-9, none near a half (test_linear.py)",
    ("onboard/planning/cycle.py", "from scipy"): "ndimage: dilation and labels of whole numbers",
    ("onboard/planning/fenced.py", "from scipy"): "ndimage: dilation of whole numbers",
    ("onboard/planning/gdem_refresh.py", "from scipy"): "ndimage: dilation and labels of whole numbers",
    ("onboard/planning/local/poses.py", "from scipy"): "ndimage: maxima and minima, which round nothing",
    ("onboard/planning/guard/trust.py", "from scipy"): "ndimage: dilation of whole numbers",
    ("onboard/planning/sensing/visibility.py", "from scipy.ndimage"):
        "distances: the nearest by whole numbers, then squares, sums and roots of float64",
}  # fmt: skip
POWERS = {"(2 * reach + 1) ** 2", "64 ** k"}  # of whole numbers
WHOLE = {  # built-in sums: of whole numbers
    "sum((ticks for _, ticks in self._left_out))", "sum((row[k] for row in self._scans))",
    "sum((count for kind, count in self.refused.items() if kind != link.COPY))", "sum((h.tells_way for h in wheels))",
    "sum((kept.late for kept in self.kept.values()))", "sum(self._until_ns.values())", "sum(lateness)",
    "sum((s.duration_ns for s in self._segments))", "sum(self._begun_ns)", "sum(rover.pace.over_budget)",
    "sum((self.counts[kind] for kind in BAD))", "sum((kind.itemsize for kind in _DTYPES.values()))",
    "sum((t.tries for t in state.tried if (t.row, t.column) == (row, column)))", "sum(found.rejections.values())",
    "sum((s.duration_ns for s in segments(config.scanning, config.rover.lidar_z_m)))", "sum(t.acked)",
    "sum((halt.request_id for halt in self._newest.values()))", "sum(_HEAD.unpack_from(data)[-3:])", "sum(line)",
    "sum((field.bits for field in packet_table.fields_of(row)))",
}  # fmt: skip


def sources():
    """(name, tree) of every file that flies."""
    paths = [path for folder in FLIGHT for path in sorted((ROOT / folder).rglob("*.py"))]
    for path in [*paths, *(ROOT / name for name in MODULES)]:
        name = path.relative_to(ROOT).as_posix()
        if name not in EXEMPT:
            yield name, ast.parse(path.read_text())


def counts(node):
    """Whether a sum is of whole numbers by what it says itself."""
    element = node.elt if isinstance(node, ast.GeneratorExp) else node
    if isinstance(element, ast.Compare | ast.BoolOp):
        return True
    if isinstance(element, ast.BinOp):
        return isinstance(element.op, ast.LShift) or counts(element.left)
    return isinstance(element, ast.Call) and isinstance(element.func, ast.Name) and element.func.id in ("len", "int")


def of_attribute(node):
    """math.sin, np.exp, a.T.dot."""
    owner = node.value.id if isinstance(node.value, ast.Name) else ""
    if node.attr in {"math": LIBRARY, "np": VECTOR}.get(owner, {"dot"}):
        return f"{owner if owner in ('math', 'np') else ''}.{node.attr}"
    return ""


def of_operation(node):
    """Products of matrices, powers of what is not whole."""
    if isinstance(node.op, ast.Pow):
        whole = all(isinstance(n, ast.Constant) and isinstance(n.value, int) for n in (node.left, node.right))
        of_two = isinstance(node.left, ast.Constant) and node.left.value in (2, 2.0)
        return "" if whole or of_two or ast.unparse(node) in POWERS else "**"
    return "@" if isinstance(node.op, ast.MatMult) else ""


def of_call(node):
    """Built-in sums but those of whole numbers, powers, orders in which equal ones change places."""
    if isinstance(node.func, ast.Attribute) and node.func.attr in ("argsort", "argpartition"):
        return "" if "kind='stable'" in ast.unparse(node) else f"{node.func.attr} that is not stable"
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    whole = name == "sum" and (counts(node.args[0]) or ast.unparse(node) in WHOLE)
    return f"{name}()" if name in ("sum", "pow") and not whole else ""


def of_import(node):
    """Libraries that compute by themselves."""
    return next((f"import {a.name}" for a in node.names if a.name.split(".")[0] in FOREIGN), "")


def of_import_from(node):
    """The same; functions of math go by their module's name."""
    return f"from {node.module}" if (node.module or "").split(".")[0] in FOREIGN | {"math"} else ""


READ = {
    ast.Attribute: of_attribute, ast.BinOp: of_operation, ast.AugAssign: of_operation, ast.Call: of_call,
    ast.Import: of_import, ast.ImportFrom: of_import_from,
}  # fmt: skip


def forbidden(node):
    """What a node asks the processor, the C library or another version of Python; "" for nothing."""
    return READ[type(node)](node) if type(node) in READ else ""


def found_in(tree):
    """(line, what) of all that is forbidden, but for imports that only the type checker reads."""
    checked_only = {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    return [(n.lineno, what) for n in ast.walk(tree) if n not in checked_only and (what := forbidden(n))]


def test_what_flies_computes_by_ieee_operations_and_our_own_functions():
    broken = [
        f"{name}:{line} {what}: use onboard.native.elementary, each or linear, or say why it may in ALLOWED"
        for name, tree in sources()
        for line, what in found_in(tree)
        if (name, what) not in ALLOWED
    ]
    assert not broken


def test_every_permission_is_used():
    used = {(name, what) for name, tree in sources() for _, what in found_in(tree)}
    sums = {ast.unparse(n) for _, tree in sources() for n in ast.walk(tree) if isinstance(n, ast.Call)}
    assert not set(ALLOWED) - used
    assert not WHOLE - sums
    assert all((ROOT / name).exists() for name in EXEMPT)


@pytest.mark.parametrize(("text", "what"), [
    ("math.sin(x)", "math.sin"), ("np.exp(x)", "np.exp"), ("np.linalg.inv(a)", "np.linalg"), ("a @ b", "@"),
    ("x ** 2", "**"), ("10.0 ** x", "**"), ("sum(x for x in y)", "sum()"), ("a.T.dot(b)", ".dot"),
    ("from math import sin", "from math"), ("import scipy.linalg", "import scipy.linalg"),
    ("from scipy.ndimage import label", "from scipy.ndimage"), ("pow(x, 2)", "pow()"),
    ("np.argsort(x)", "argsort that is not stable"),
])  # fmt: skip
def test_a_call_that_depends_on_the_processor_is_refused(text, what):
    assert [found for _, found in found_in(ast.parse(text))] == [what]


@pytest.mark.parametrize("text", [
    "math.sqrt(x)", "np.sqrt(x)", "10 ** 9", "2.0 ** 21", "sum(a > b for a in c)", "sum(1 << k for k in c)",
    "math.remainder(x, y)", "x * x", "total(x for x in y)", "a.sum()", "np.abs(x)", "np.argsort(x, kind='stable')",
])  # fmt: skip
def test_what_ieee_fixes_is_let_through(text):
    assert not found_in(ast.parse(text))
