"""The rows of `make bench` are those of the performance design, each with one measurement or listed as missing."""

import pytest

from tests.bench import __main__ as bench
from tests.bench import flight, jitter
from tests.bench.goals import GOALS, MISSING, Measured

pytestmark = pytest.mark.tool

DESIGN = [
    "visibility-total", "visibility-numpy", "visibility-limit", "nsp-cycle", "pose-field", "cell-classes",
    "scan-to-map", "local-cycle", "distance-200", "distance-2000", "distance-maze", "distance-mcp", "global-50",
    "global-500", "global-2000", "rasterise-200k", "rasterise-scan", "fbm-1024", "registration-100k",
    "scip-decode", "scip-poll", "can-codec", "tick-cost", "tick-jitter", "hil-rtf", "hil-rtf-memory",
    "hil-rtf-scan", "replay-rtf", "link-codec", "start", "memory",
]  # fmt: skip
KEYS = ["name", "ratio", "goal", "holds", "ours_s", "reference_s", "reference", "note"]


def test_the_rows_are_those_of_the_design_in_its_order():
    assert list(GOALS) == DESIGN


def test_every_measurement_belongs_to_a_row():
    assert {*bench.CORE_ROWS, *flight.ROWS, *jitter.ROWS, "start"} <= set(GOALS)


def test_a_missing_row_has_a_number_and_does_not_hold():
    for name in GOALS:
        row = MISSING.row(name)
        assert list(row) == KEYS and row["ratio"] == 0.0 and row["holds"] is False
        assert row["note"] == "missing: part not built"


def test_a_row_holds_on_the_right_side_of_its_limit_and_only_with_what_else_is_asked():
    assert Measured(12.0, 1.0, 12.0, "").row("pose-field")["holds"]
    assert not Measured(11.9, 1.0, 11.9, "").row("pose-field")["holds"]
    assert Measured(1.3, 1.3, 1.0, "").row("registration-100k")["holds"]
    assert not Measured(1.31, 1.31, 1.0, "").row("registration-100k")["holds"]
    assert not Measured(1.0, 1.0, 1.0, "", also=False).row("registration-100k")["holds"]


def jitter_run(p50, p999, granted=True, kind="bare loop"):
    reference = {"kind": kind, "late_us": {"p50": 50.0, "p999": 100.0}}
    return {
        "late_us": {"p50": p50, "p999": p999},
        "reference": reference,
        "real_time": [{"option": "fifo_priority", "granted": granted, "text": ""}],
    }


def test_jitter_is_judged_by_both_shares_with_fifo_and_by_the_median_alone_without():
    assert jitter.judged([jitter_run(100.0, 300.0)]).row("tick-jitter")["holds"]
    assert not jitter.judged([jitter_run(126.0, 100.0)]).row("tick-jitter")["holds"]
    assert not jitter.judged([jitter_run(100.0, 301.0)]).row("tick-jitter")["holds"]
    without = jitter.judged([jitter_run(100.0, 9000.0, granted=False)]).row("tick-jitter")
    assert without["holds"] and "FIFO is not allowed here" in without["note"]


def test_jitter_says_when_the_bare_loop_stands_for_cyclictest():
    assert "not installed" in jitter.judged([jitter_run(100.0, 300.0)]).note
    assert "not installed" not in jitter.judged([jitter_run(100.0, 300.0, kind="cyclictest")]).note
