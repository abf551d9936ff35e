"""Every row of the fault table is run, timed and held to its steps: the measure, and that no row goes without."""

from types import SimpleNamespace

import pytest

from hil.run.answers import Spans, Watcher
from hil.run.evidence import SHOWS, Sight
from hil.run.judged import Twins, fly
from hil.scenarios.library import find, scenarios
from hil.scenarios.model import load_scenario
from hil.scenarios.verdicts import FaultResponse
from onboard.core.faults.monitors import MONITORS
from onboard.core.telemetry import Packer, TelemetryInputs
from onboard.motion.wheel_health import SOUND
from onboard.records import Event, Frame, Inputs, LinkMessage, Outputs
from protocol.can.guard import Sender
from protocol.link.datagrams import DatagramKind
from protocol.tables.commands import Telecommand, encode
from protocol.tables.faults import BY_NAME, ResponseStep
from protocol.tables.modes import Mode, Phase
from tests.scenarios.registry import CAMPAIGNS

TICK_NS = 10_000_000


def test_every_row_of_the_fault_table_is_judged_by_a_scenario_or_a_campaign():
    flown = {row for scenario in scenarios() for row in scenario.expect.detects}
    flown |= {row for campaign in CAMPAIGNS.values() for row in getattr(campaign, "DETECTS", ())}
    assert flown == set(BY_NAME)


def test_a_scenario_raises_what_it_detects_where_that_is_reported():
    for scenario in scenarios():
        told = {row for row in scenario.expect.detects if ResponseStep.REPORT in BY_NAME[row].response}
        assert told <= set(scenario.expect.raises), scenario.name


def test_a_span_is_found_where_it_begins_and_where_it_already_holds():
    spans = Spans()
    for tick, holds in enumerate([False, True, True, False, True], 1):
        spans.note(tick, holds)
    assert [spans.began(t) for t in (1, 2, 3, 5, 6)] == [2, 2, 5, 5, None]
    assert [spans.held(t) for t in (1, 3, 4, 9)] == [2, 3, 5, 9]
    assert Spans().began(1) is Spans().held(1) is None


# -- a flight of a few ticks by hand -------------------------------------------------------------------------------


def core(active=(), mode=Mode.AUTONOMOUS, phase=Phase.DRIVING, bad=0):
    """What the watcher looks at of the flight program."""
    return SimpleNamespace(
        executive=SimpleNamespace(active=active, mode=mode, phase=phase, in_mission=True),
        wheels=SOUND,
        nodes=SimpleNamespace(bad_frames=bad, watch=SimpleNamespace(babbling=())),
        lidar=SimpleNamespace(bad=0),
        localisation=SimpleNamespace(yaw_rate_radps=0.0),
    )


SENDER = Sender()


def orders(rate_radps):
    return tuple(Frame(0x100 + n, SENDER.encode(0x100 + n, 1, 0.0, rate_radps)) for n in (1, 2, 3, 4))


def told(row):
    return (Event(0, "warning", "FAULT", f"{row}: a reason"),)


def answer(row, ticks, traced_s=0.02):
    """ticks: (core, outputs) of tick 1, 2, ..."""
    watcher = Watcher([row])
    for tick, (rover, outputs) in enumerate(ticks, 1):
        watcher.observe(tick, Inputs(tick, tick * TICK_NS), outputs, rover, None)
    return watcher.answers(traced_s)[0]


DRIVES = (core(), Outputs(can_frames=orders(1.0)))
SILENT = ("WHEEL_SILENT",)
ACTIVE = core(SILENT, Mode.SAFE)


def test_an_answer_counts_from_the_first_trace_to_the_tick_whose_outputs_hold_its_last_step():
    ticks = [DRIVES, DRIVES, DRIVES, (ACTIVE, Outputs(events=told("WHEEL_SILENT"))), (ACTIVE, Outputs(orders(0.0)))]
    found = answer("WHEEL_SILENT", ticks)
    assert found == FaultResponse("WHEEL_SILENT", 0.02, 0.04, 0.05, ())
    assert found.in_time


@pytest.mark.parametrize(
    ("after", "missing"),
    [
        ((core(SILENT, Mode.SAFE), Outputs(events=told("WHEEL_SILENT"))), (ResponseStep.STOP,)),
        ((core(SILENT), Outputs(orders(0.0), events=told("WHEEL_SILENT"))), (ResponseStep.SAFE,)),
        ((core(SILENT, Mode.SAFE), Outputs(orders(0.0), events=told("WHEEL_STALE"))), (ResponseStep.REPORT,)),
        ((core((), Mode.SAFE), Outputs(orders(0.0), events=told("WHEEL_SILENT"))),
         (ResponseStep.STOP, ResponseStep.SAFE, ResponseStep.REPORT)),
    ],
)  # fmt: skip
def test_a_step_that_is_not_taken_is_missing_and_a_row_that_is_not_active_takes_none(after, missing):
    found = answer("WHEEL_SILENT", [DRIVES, DRIVES, after])
    assert found.missing == missing
    assert not found.in_time


def test_an_answer_before_the_first_bad_sample_is_none():
    was_so = (ACTIVE, Outputs(orders(0.0), events=told("WHEEL_SILENT")))
    assert answer("WHEEL_SILENT", [was_so, was_so, was_so], traced_s=0.03).raised_s == -1.0
    assert answer("WHEEL_SILENT", [DRIVES, was_so], traced_s=-1.0).since_s == -1.0


def test_an_answer_one_tick_after_the_row_s_time_is_late():
    limit_ticks = round(BY_NAME["WHEEL_STALE"].detect_s * 100)
    stops = (core(("WHEEL_STALE",)), Outputs(orders(0.0)))
    assert answer("WHEEL_STALE", [DRIVES] * (1 + limit_ticks) + [stops]).in_time
    assert not answer("WHEEL_STALE", [DRIVES] * (2 + limit_ticks) + [stops]).in_time


@pytest.mark.parametrize(("idle_ticks", "in_time"), [(0, True), (1, True), (2, False)])
def test_the_operator_s_word_counts_from_the_tick_that_hears_it_to_that_of_standing_orders(idle_ticks, in_time):
    order = LinkMessage(0, True, "ok", 1, DatagramKind.TELECOMMAND, encode(Telecommand(1, 0, 0, "safe", {})))
    refused = order._replace(accepted=False, payload=b"")
    watcher = Watcher(["OPERATOR"])
    heard = (core(("OPERATOR",), Mode.SAFE), Outputs(orders(1.0), events=told("OPERATOR")))
    stands = (core(("OPERATOR",), Mode.SAFE), Outputs(orders(0.0), events=told("OPERATOR")))
    for tick, (messages, ran) in enumerate(
        [
            ((refused,), DRIVES),
            ((order,), heard if idle_ticks else stands),
            *[((), heard)] * (idle_ticks - 1),
            ((), stands),
        ],
        1,
    ):
        rover, outputs = ran
        watcher.observe(tick, Inputs(tick, tick * TICK_NS, link_messages=messages), outputs, rover, None)
    (found,) = watcher.answers(-1.0)
    assert (found.since_s, found.raised_s, found.missing) == (0.02, 0.02, ())
    assert found.answered_s == pytest.approx(0.02 + 0.01 * idle_ticks) and found.in_time == in_time


def test_what_can_wait_is_shed_where_no_housekeeping_has_left_for_a_second():
    packer = Packer()
    beat, word = (packer.message(name, TelemetryInputs(), 0)[0] for name in ("HEARTBEAT", "ROVER_STATE"))
    for every, shed in ((50, False), (102, True), (500, True)):
        sight = Sight()
        seen = set()
        for tick in range(1, 1000):
            data = beat + (word if tick % every == 0 else b"")
            sight.update(
                Inputs(tick, tick * TICK_NS), Outputs(link_payloads=((DatagramKind.MAVLINK, data),)), core(), None
            )
            seen.add(tick > every and SHOWS[ResponseStep.SHED](sight))
        assert (True in seen) == shed, every


# -- a short scenario as it is ---------------------------------------------------------------------------------------


def broken_promises():
    twins = Twins()
    flown = fly(load_scenario(find("wheel_stale")), twins)
    twins.free()
    return [verdict.promise for verdict in flown.verdicts if not verdict.holds]


def test_a_scenario_turns_red_when_the_monitor_of_its_row_is_dead(monkeypatch):
    assert broken_promises() == []
    monkeypatch.setitem(MONITORS, "WHEEL_STALE", lambda watched: False)
    assert broken_promises() == ["answers WHEEL_STALE within 0.04 s by STOP"]
