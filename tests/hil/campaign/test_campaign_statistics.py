"""Statistics, comparison and report of campaigns, against figures worked out by hand or by another way."""

import json
import math
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner

from hil.__main__ import app
from hil.campaign.compare import FIGURES, compare, junit
from hil.campaign.plan import plan_of
from hil.campaign.report import page
from hil.campaign.statistics import HEADLINES, by_class, classes, failures, knobs_of, share, spread
from hil.campaign.table import read_parquet, read_table, write_parquet


def row(number, **changes):
    """A row of an arrival."""
    made = {
        "case_number": number, "seed": 100 + number, "outcome": "arrived", "reason": "", "reachable": True,
        "distance_to_goal_m": 0.02, "way_m": 10.0, "way_ratio": 1.1, "s_per_m": 20.0, "position_error_m": 0.02,
        "max_position_error_m": 0.05, "sigma_m": 0.02, "max_error_sigmas": 1.0, "nees": 3.0, "contacts": 0,
        "first_contact": "", "faults_raised": 0, "max_tilt_deg": 5.0, "version": "v",
    }  # fmt: skip
    return {**made, **changes}


def wilson(k, n, z=1.959963984540054):
    """Wilson's interval, from its formula (Wilson, J. Am. Stat. Assoc. 22 (1927) 209)."""
    p = k / n
    middle, half = (p + z * z / (2 * n)), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)


@pytest.mark.parametrize(("k", "n"), [(0, 10), (10, 10), (3, 7), (990, 1000)])
def test_a_share_has_wilsons_interval(k, n):
    found = share(k, n)
    assert (found.low, found.high) == pytest.approx(wilson(k, n), abs=1e-9)
    assert found.ratio == k / n and str(k) in str(found)


def test_a_share_of_nothing_says_nothing():
    assert str(share(0, 0)) == "-" and share(0, 0).ratio == 0.0


def test_arrivals_are_counted_of_all_and_of_the_goals_within_reach():
    rows = [row(1), row(2, outcome="stopped"), row(3, outcome="stopped", reachable=False), row(4, outcome="silent")]
    found = {name: (of(rows).count, of(rows).total) for name, of in HEADLINES.items()}
    assert found["at the goal, of all"] == (1, 4) and found["at the goal, of the reachable ones"] == (1, 3)
    assert found["stopped with a reason, of those out of reach"] == (1, 1)
    assert found["reported an arrival that was none"] == (1, 4)


def test_a_flight_that_the_bench_could_not_make_counts_as_a_reachable_goal_missed():
    found = HEADLINES["at the goal, of the reachable ones"]([row(1), {"case_number": 2, "seed": 2, "outcome": "error"}])
    assert (found.count, found.total) == (1, 2)


def not_flown(number, outcome="error", **more):
    return {"case_number": number, "seed": 100 + number, "outcome": outcome, "reason": "x", "version": "v", **more}


@pytest.mark.parametrize("nothing", [{}, {"contacts": None, "faults_raised": None}])  # of a folder, of Parquet
def test_what_was_not_flown_has_neither_contacts_nor_faults(nothing):
    rows = [row(1, contacts=2, faults_raised=1, **{"k": 1}), row(2, **{"k": 2}), not_flown(3, k=1, **nothing)]
    found = {name: (of(rows).count, of(rows).total) for name, of in HEADLINES.items()}
    assert found["a contact, of the flights"] == found["a fault raised, of the flights"] == (1, 2)
    assert [(of.contacts.count, of.contacts.total) for of in by_class(rows, "k")] == [(1, 1), (0, 1)]


@pytest.mark.parametrize("outcome", ["error", "aborted"])
def test_a_contact_or_a_fault_is_not_better_if_the_later_campaign_did_not_fly(outcome):
    old = [row(k, contacts=1, faults_raised=1) for k in range(1, 21)]
    found = compare(old, [not_flown(k, outcome) for k in range(1, 21)])
    for name in ("contact", "fault"):
        assert (change_of(found, name).verdict, change_of(found, name).pairs) == ("same", 0)
    assert change_of(found, "aborted").verdict == "worse"
    assert FIGURES["aborted"].means == "ended by the bench, or not flown"


def test_a_knob_of_many_numbers_has_four_classes_that_hold_every_case_once():
    rows = [row(k, **{"lidar.lost_ratio": k / 100}) for k in range(1, 21)]
    found = classes(rows, "lidar.lost_ratio")
    assert len(found) == 4 and sorted(r["case_number"] for _, of in found for r in of) == list(range(1, 21))


def test_a_knob_of_a_few_values_has_a_class_for_each_and_one_for_none():
    rows = [row(1, **{"faults.1.fault": "b"}), row(2, **{"faults.1.fault": "a"}), row(3)]
    assert [(name, len(of)) for name, of in classes(rows, "faults.1.fault")] == [("a", 1), ("b", 1), ("none", 1)]


def test_only_knobs_that_differ_are_classes_and_their_shares_are_of_reachable_goals():
    rows = [row(k, **{"mission.soil": "soft" if k % 2 else "firm", "mission.edges": True}) for k in range(1, 9)]
    rows[0] |= {"outcome": "stopped", "contacts": 1}
    rows[2] |= {"outcome": "stopped", "reachable": False}
    assert knobs_of(rows) == ["mission.soil"]
    firm, soft = by_class(rows, "mission.soil")
    assert (firm.name, firm.arrivals.count, firm.arrivals.total) == ("firm", 4, 4)
    assert (soft.arrivals.count, soft.arrivals.total, soft.contacts.count) == (2, 3, 1)


def test_failures_are_grouped_by_their_reason_without_numbers_the_most_frequent_first():
    rows = [
        row(1), row(2, outcome="stopped", reason="no way within 2.5 m"), row(3, contacts=1, first_contact="7 s: body"),
        row(4, outcome="stopped", reason="no way within 3.0 m"), row(5, outcome="aborted", reason="tipped"),
    ]  # fmt: skip
    found = [(group.outcome, group.example, group.cases) for group in failures(rows)]
    assert found[0] == ("stopped", "no way within 2.5 m", (2, 4))
    assert set(found[1:]) == {("contact", "7 s: body", (3,)), ("aborted", "tipped", (5,))}


def test_a_spread_is_median_nine_of_ten_and_largest():
    assert spread([row(k, way_m=float(k)) for k in range(1, 11)], "way_m") == (5.5, 9.0, 10.0)
    assert spread([row(1, way_m=None)], "way_m") is None


def change_of(comparison, name):
    return next(change for change in comparison.changes if change.name == name)


def test_a_table_against_itself_is_the_same_in_every_figure():
    rows = [row(k) for k in range(1, 31)]
    found = compare(rows, rows)
    assert {change.verdict for change in found.changes} == {"same"} and not found.worse
    assert found.pairs == 30 and [change.name for change in found.changes] == list(FIGURES)


@pytest.mark.parametrize(
    ("lost", "gained", "verdict"), [(12, 0, "worse"), (0, 12, "better"), (6, 6, "same"), (4, 0, "same")]
)
def test_arrivals_are_compared_by_mcnemars_exact_test(lost, gained, verdict):
    old = [row(k, outcome="stopped" if k <= gained else "arrived") for k in range(1, 41)]
    new = [row(k, outcome="stopped" if 40 - lost < k else "arrived") for k in range(1, 41)]
    change = change_of(compare(old, new), "not_arrived")
    assert change.verdict == verdict
    assert (change.better, change.worse) == (tuple(range(1, gained + 1)), tuple(range(41 - lost, 41)))
    n, less = lost + gained, min(lost, gained)
    tail = sum(math.comb(n, k) for k in range(less + 1)) / 2**n
    assert change.p == pytest.approx(min(1.0, 2 * tail))  # two-sided, of a fair coin


def test_a_number_that_rises_in_nearly_every_case_is_worse_by_the_sign_test_however_little():
    rng = np.random.default_rng(4)
    old = [row(k, s_per_m=20.0 + rng.normal()) for k in range(1, 31)]
    new = [{**r, "s_per_m": r["s_per_m"] + (0.02 if r["case_number"] > 2 else -0.02)} for r in old]
    change = change_of(compare(old, new), "s_per_m")
    assert change.verdict == "worse" and len(change.better) == 2 and len(change.worse) == 28


def test_a_difference_below_the_figures_least_is_none():
    old = [row(k) for k in range(1, 31)]
    new = [row(k, s_per_m=20.005) for k in range(1, 31)]
    assert change_of(compare(old, new), "s_per_m").worse == ()


def test_cases_are_paired_by_number_and_seed_and_the_others_are_counted():
    old, new = [row(1), row(2), row(3)], [row(2), row(3, seed=7), row(4)]
    found = compare(old, new)
    assert (found.pairs, found.unpaired) == (1, 4)


def test_chance_alone_is_rarely_taken_for_a_change():
    """By Holm's rule the verdicts are all right with a probability of 95 % at least: 3.5 sigma over 5 % of 200."""
    rng, wrong = np.random.default_rng(8), 0
    for _ in range(200):
        old, new = (
            [row(k, **{n: float(rng.normal()) for n in FIGURES if n in row(1)}) for k in range(60)] for _ in "ab"
        )
        wrong += any(change.verdict != "same" for change in compare(old, new).changes)
    assert wrong <= 10 + 3.5 * math.sqrt(200 * 0.05 * 0.95)


def test_junit_has_a_test_for_each_figure_and_fails_what_is_worse():
    old = [row(k) for k in range(1, 21)]
    new = [row(k, contacts=1) for k in range(1, 21)]
    suite = ElementTree.fromstring(junit(compare(old, new), "a to b"))
    failed = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failed == ["contact"] and suite.get("failures") == "1"
    assert suite.get("tests") == str(len(FIGURES)) == str(len(list(suite)))


@pytest.fixture
def tables(tmp_path):
    """Two Parquet files: the second one has contacts in all cases."""
    write_parquet(tmp_path / "a.parquet", [row(k) for k in range(1, 21)])
    write_parquet(tmp_path / "b.parquet", [row(k, contacts=1) for k in range(1, 21)])
    return tmp_path


def test_the_command_ends_with_1_if_a_figure_is_worse_and_names_the_cases(tables):
    a, b = str(tables / "a.parquet"), str(tables / "b.parquet")
    done = CliRunner().invoke(app, ["compare", a, b, "--junit", str(tables / "c.xml")])
    assert done.exit_code == 1 and "had a contact, in B only: cases 1, 2, 3" in done.stdout
    assert ElementTree.parse(tables / "c.xml").getroot().get("failures") == "1"
    back = CliRunner().invoke(app, ["compare", b, a, "--json"])
    told = json.loads(back.stdout)
    assert back.exit_code == 0 and told["pairs"] == 20
    assert next(c["verdict"] for c in told["changes"] if c["name"] == "contact") == "better"


@pytest.mark.parametrize(("what", "code", "said"), [
    ("nothing.parquet", 66, "no such campaign"), (".", 66, "no campaign"), ("broken.parquet", 66, "no Parquet"),
    ("foreign.parquet", 66, "case_number"), ("others.parquet", 65, "no case"),
])  # fmt: skip
def test_what_is_no_campaign_is_named(tables, what, code, said):
    import duckdb

    (tables / "broken.parquet").write_bytes(b"PAR1 and no more")
    duckdb.sql("select 1 as x").write_parquet(str(tables / "foreign.parquet"))
    write_parquet(tables / "others.parquet", [row(k, seed=k) for k in range(1, 4)])
    done = CliRunner().invoke(app, ["compare", str(tables / "a.parquet"), str(tables / what)])
    assert done.exit_code == code and said in done.stderr and len(done.stderr.splitlines()) == 1


def test_the_table_keeps_types_nulls_and_order(tmp_path):
    rows = [
        row(2, way_ratio=None, **{"mission.edges": True, "x.whole": 3}),
        row(1, **{"x.whole": None, "x.list": [1, 2]}),
    ]
    found = read_parquet(write_parquet(tmp_path / "t.parquet", rows))
    assert [r["case_number"] for r in found] == [1, 2] and found[1]["way_ratio"] is None
    assert found[1]["mission.edges"] is True and found[1]["x.whole"] == 3 and found[0]["x.list"] == "[1, 2]"
    assert read_table(tmp_path / "t.parquet") == found


def test_the_page_has_outcomes_failures_with_their_commands_classes_and_pictures():
    plan = plan_of({"name": "p", "about": "One <b>.", "cases": 12, "lidar": {"lost_ratio": {"uniform": [0, 0.1]}}}, "p")
    rows = [row(k, **{"lidar.lost_ratio": k / 100}) for k in range(1, 13)]
    rows[4] |= {"outcome": "stopped", "reason": "goto: <script>"}
    text = page(plan, rows, "hil case p.toml")
    assert "One &lt;b&gt;." in text and "goto: &lt;script&gt;" in text and "<script>" not in text
    assert "<code>hil case p.toml 5</code>" in text and "11 of 12" in text and "<code>lidar.lost_ratio</code>" in text
    assert text.count("data:image/png;base64,") == 4 and page(plan, rows, "hil case p.toml") == text


def test_the_page_of_a_campaign_without_any_arrival_is_made_as_well():
    plan = plan_of({"name": "p", "cases": 2}, "p")
    rows = [{"case_number": k, "seed": k, "outcome": "error", "reason": "x", "version": "v"} for k in (1, 2)]
    assert "0 of 2" in page(plan, rows, "hil case p.toml")
