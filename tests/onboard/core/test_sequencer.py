"""Sequences as the rover runs them: order, waits, conditions, what a failure does, what ends them."""

import pytest

from protocol.link import bulk
from protocol.link.datagrams import DatagramKind, payload_limit
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode
from tests.onboard.core_bench import CoreBench, first_map

FORWARD = "drive 0.1 0 0 20 0.1"

pytestmark = pytest.mark.copied


@pytest.fixture(scope="module")
def known():
    return first_map()


@pytest.fixture(scope="module")
def rover(known):
    made = CoreBench(memory=known)
    made.settle()
    return made


def upload(rover, *lines, name="day"):
    asked = [rover.order("sequence_upload", sequence=name, number=n, line=line) for n, line in enumerate(lines, 1)]
    rover.run(0.05)
    return asked


def run(rover, *lines):
    upload(rover, *lines)
    request = rover.order("sequence_run", sequence="day")
    rover.run(0.02)
    return request


def progress(rover, request):
    told = {r.serial: r.text for _, r in rover.reports if r.request_id == request and r.state is RequestState.PROGRESS}
    return [told[serial] for serial in sorted(told)]


def test_steps_are_done_in_their_order_in_the_mode_sequence_and_each_is_told(rover):
    request = run(rover, FORWARD, "turn 45", "time")
    assert rover.mode is Mode.SEQUENCE
    assert rover.until_final(request) is RequestState.COMPLETED and rover.mode is Mode.STANDBY
    assert [text[:24] for text in progress(rover, request)] == ["step 1 of 3 completed: 0", "step 2 of 3 completed: h"]
    assert rover.pose[0] > 0.09 and rover.pose[2] == pytest.approx(0.785, abs=0.06)


def test_a_mission_of_a_step_ends_the_step_and_not_the_mode(rover):
    request = run(rover, "scan", "after 1")
    rover.until(lambda: bool(progress(rover, request)), 60.0)
    assert rover.mode is Mode.SEQUENCE and rover.told("SCANNED")
    assert rover.until_final(request) is RequestState.COMPLETED and rover.mode is Mode.STANDBY


def test_a_wait_counts_from_the_completion_of_the_step_before(rover):
    request = run(rover, FORWARD, "after 3 turn 20")
    rover.until(lambda: bool(progress(rover, request)), 30.0)
    first_s = rover.now_ns / 1e9
    rover.until(lambda: rover.rover.twist.yaw_radps != 0.0, 10.0)
    assert rover.now_ns / 1e9 - first_s == pytest.approx(3.0, abs=0.1)


def test_a_step_waits_for_its_condition(rover):
    request = run(rover, "until charge_ratio < 0.5 within 60 turn 20")
    rover.run(5.0)
    assert rover.rates == [0.0] * 4 and rover.mode is Mode.SEQUENCE
    rover.nodes.power.charge_ratio = 0.4
    assert rover.until_final(request, 30.0) is RequestState.COMPLETED


@pytest.mark.parametrize(
    ("policy", "state", "mode"),
    [
        ("stop", RequestState.FAILED, Mode.STANDBY),
        ("continue", RequestState.COMPLETED, Mode.STANDBY),
        ("safe", RequestState.FAILED, Mode.SAFE),
    ],
)
def test_a_condition_that_does_not_come_fails_the_step_and_its_policy_says_what_then(rover, policy, state, mode):
    request = run(rover, f"until charge_ratio > 2 within 1 or {policy} scan", "after 1")
    assert rover.until_final(request, 10.0) is state and rover.mode is mode
    texts = [r.text for _, r in rover.reports if r.request_id == request]
    assert any(text.startswith("step 1 of 2 failed: charge_ratio is ") for text in texts)


def test_a_step_that_is_refused_as_things_are_has_failed(rover):
    rover.order("fence_add", fence="site", kind="goal", corners_m=(-1, -1, 1, -1, 1, 1))
    request = run(rover, "goto 5 5")
    assert rover.until_final(request) is RequestState.FAILED
    assert rover.text(request).startswith("step 1 of 1 failed") and "goal fence (site)" in rover.text(request)


@pytest.mark.parametrize(
    ("order", "mode"),
    [
        ("sequence_abort", Mode.STANDBY),
        ("stop", Mode.STANDBY),
        ("safe", Mode.SAFE),
        ("emergency_stop", Mode.ESTOP),
    ],
)
def test_what_the_operator_ends_it_with_stops_the_wheels_and_no_step_follows(rover, order, mode):
    request = run(rover, "drive 0.1 0 0 30 3", "turn 90")
    rover.run(2.0)
    rover.order(order)
    rover.run(0.1)
    assert rover.mode is mode and rover.rates == [0.0] * 4
    assert rover.states(request)[-1] is RequestState.CANCELLED
    rover.run(2.0)
    assert rover.mode is mode and rover.rates == [0.0] * 4


def test_a_fault_that_leads_to_safe_ends_the_sequence(rover):
    request = run(rover, "after 60")
    rover.nodes.power.silent = True
    assert rover.until_final(request, 5.0) is RequestState.CANCELLED and rover.mode is Mode.SAFE


def test_a_sequence_with_a_missing_step_or_an_unknown_name_is_not_run(rover):
    rover.order("sequence_upload", sequence="day", number=1, line="scan")
    rover.order("sequence_upload", sequence="day", number=3, line="scan")
    missing, unknown = rover.order("sequence_run", sequence="day"), rover.order("sequence_run", sequence="dog")
    rover.run(0.05)
    assert "missing: 2" in rover.text(missing)
    assert "`dog`" in rover.text(unknown) and "day" in rover.text(unknown) and rover.mode is Mode.STANDBY


def test_a_malformed_step_is_refused_when_it_is_uploaded_and_changes_nothing(rover):
    (good,) = upload(rover, "scan")
    bad = rover.order("sequence_upload", sequence="day", number=1, line="gogo")
    rover.run(0.05)
    assert rover.states(good) == [RequestState.COMPLETED] and rover.states(bad) == [RequestState.FAILED]
    assert rover.rover.executive.sequencer._kept["day"][1].name == "scan"


def test_a_dry_run_says_what_each_step_would_do_or_why_it_would_be_refused(rover):
    rover.order("fence_add", fence="site", kind="goal", corners_m=(-1, -1, 1, -1, 1, 1))
    upload(rover, "after 5 or continue goto 5 5", "until voltage_v > 24 within 9", "turn 90")
    request = rover.order("sequence_check", sequence="day")
    ground, found = bulk.Receiver(payload_limit(256e3)), None
    while found is None:
        for kind, payload in rover.step().link_payloads:
            if kind == DatagramKind.BULK_CHUNK:
                found = ground.receive(payload, rover.now_ns) or found
    assert found.data.decode().splitlines() == [
        "1: after 5 s; goto x_m 5.0 y_m 5.0; if it fails: continue; "
        "refused now: (5.0, 5.0) is outside the goal fence (site)",
        "2: once voltage_v > 24, within 9 s; only waits; if it fails: stop",
        "3: turn heading_rad 1.5707963267948966; if it fails: stop",
    ]
    rover.run(0.05)
    assert rover.text(request) == "3 steps" and rover.mode is Mode.STANDBY
