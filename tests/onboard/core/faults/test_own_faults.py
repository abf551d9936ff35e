"""Faults of the rover's own: battery, computer, mission rule, and the operator's word. Found, answered, ended."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Computer, Config, Mission, Safety
from onboard.core.faults.computer import LATE_NS, LOOKS, ComputerWatch, strained
from onboard.core.faults.power import PowerWatch
from onboard.core.faults.retry_limit import Spells
from onboard.planning import cycle
from onboard.records import Inputs, Machine, PowerState, Timing
from protocol.conventions import TICK_NS
from protocol.generated import eldorado_dialect as mavlink
from protocol.link.datagrams import DatagramKind
from protocol.link.transactions import RequestState
from protocol.tables.faults import BY_NAME
from protocol.tables.modes import Mode, Phase
from tests.onboard.core_bench import CoreBench, first_map, quick

S = 1_000_000_000
WELL = Machine(0.3, 0.2, 200e6, 2e9, 50.0, 20e9)
pytestmark = pytest.mark.copied


@pytest.fixture(scope="module")
def known():
    return first_map()


@pytest.fixture(scope="module")
def driving(known):
    rover = CoreBench(memory=known)
    rover.settle()
    rover.request = rover.goto(3.0, 0.5)
    rover.until_driving()
    return rover


def standing(rover):
    return rover.rates == [0.0] * 4


def rows_told(rover):
    return [text.partition(":")[0] for _, text in rover.told("FAULT")]


# -- the battery ---------------------------------------------------------------------------------------------------


def test_in_a_brown_out_the_wheels_rest_within_half_a_second_and_drive_on_when_the_voltage_is_back(driving):
    driving.nodes.power.sag_v = 9.0
    assert driving.until(lambda: standing(driving), 1.0) <= BY_NAME["BROWN_OUT"].detect_s
    assert rows_told(driving) == ["BROWN_OUT"]  # and not that the battery is low
    driving.run(1.0)
    assert standing(driving)
    driving.nodes.power.sag_v = 0.0
    assert driving.until(lambda: not standing(driving), 1.0) <= 0.25
    assert driving.told("FAULT_CLEARED")[0][1] == "BROWN_OUT"
    assert driving.mode is Mode.AUTONOMOUS


def test_the_power_nodes_own_word_of_a_brown_out_is_enough():
    watch = PowerWatch()
    for now_ns in (S, 2 * S):
        watch.update(PowerState(24.0, 2.0, 0.9, 20.0, 0, brown_out=True), now_ns, Safety())
    assert set(watch.found) == {"BROWN_OUT"}


def test_the_fourth_brown_out_in_a_mission_leads_to_safe_and_so_does_one_that_does_not_end(driving):
    for _ in range(3):
        driving.nodes.power.sag_v = 9.0
        driving.run(0.6)
        driving.nodes.power.sag_v = 0.0
        driving.run(0.4)
        assert driving.mode is Mode.AUTONOMOUS
    driving.nodes.power.sag_v = 9.0
    driving.until(lambda: driving.mode is Mode.SAFE, 0.6)
    assert driving.until_final(driving.request, 1.0) is RequestState.FAILED
    watch = PowerWatch()
    lasting = [k for k in range(1, 40) if (watch.update(word(19.0), k * S // 5, Safety()), watch.used_up)[1]]
    assert lasting[0] == 2 + 5 * 5 + 1  # found at the second word, for over 5 s at the first after them


def test_an_empty_battery_leads_to_safe_within_half_a_second_and_only_a_mask_lets_the_operator_drive_on(driving):
    driving.nodes.power.charge_ratio = 0.05
    assert driving.until(lambda: driving.mode is Mode.SAFE, 1.0) <= BY_NAME["POWER_LOW"].detect_s
    driving.step()
    assert standing(driving) and rows_told(driving) == ["POWER_LOW"]
    assert "% of the charge)" in driving.told("FAULT")[0][1]
    refused = driving.order("resume")
    assert driving.until_final(refused, 1.0) is RequestState.FAILED
    assert driving.text(refused) == "still active: POWER_LOW"
    driving.order("faults_mask", fault="POWER_LOW", lasting_s=60.0)
    driving.run(0.02)
    assert driving.until_final(driving.order("resume"), 1.0) is RequestState.COMPLETED
    assert driving.mode is Mode.STANDBY


def word(voltage_v, charge_ratio=0.9):
    return PowerState(voltage_v, 2.0, charge_ratio, 20.0, 0)


@given(st.lists(st.sampled_from([28.0, 21.0, 19.0]), max_size=40))
@settings(deadline=None, derandomize=True)
def test_a_single_word_of_the_power_node_finds_nothing_and_two_in_a_row_always_do(volts):
    watch, before = PowerWatch(), math.inf
    for k, volt_v in enumerate(volts, 1):
        for age_ns in (0, S // 10):  # the same word again is no second one
            watch.update(word(volt_v)._replace(age_ns=age_ns), k * S + age_ns, Safety())
        assert ("BROWN_OUT" in watch.found) == (volt_v < 20.0 and before < 20.0)
        assert ("POWER_LOW" in watch.found) == (volt_v < 22.0 and before < 22.0)
        before = volt_v


def test_a_voltage_at_its_limit_does_not_flicker():
    watch, found = PowerWatch(), []
    for k, volt_v in enumerate((21.9, 21.9, 22.1, 21.9, 22.4, 22.6), 1):
        watch.update(word(volt_v), k * S, Safety())
        found.append("POWER_LOW" in watch.found)
    assert found == [False, True, True, True, True, False]


# -- the computer --------------------------------------------------------------------------------------------------


def frames(outputs, kind):
    parser = mavlink.MAVLink(None)
    data = b"".join(payload for k, payload in outputs.link_payloads if k == DatagramKind.MAVLINK)
    return sum(message.get_type() == kind for message in parser.parse_buffer(data) or ())


def heard(rover, seconds, slow=False):
    """ROVER_STATE and HEARTBEAT messages of so many seconds; slow: of ten ticks one is left out."""
    states = beats = 0
    for _ in range(round(10 * seconds)):
        if slow:
            rover.leave_out(1)
        for _ in range(9 if slow else 10):
            outputs = rover.step()
            states, beats = states + frames(outputs, "ROVER_STATE"), beats + frames(outputs, "HEARTBEAT")
    return states, beats


def test_a_computer_that_leaves_out_ticks_says_so_within_a_second_and_sheds_what_can_wait(driving):
    assert heard(driving, 5.0) == (10, 5)
    begun_s = driving.now_ns / S
    states, beats = heard(driving, 10.0, slow=True)
    assert states <= 4 and beats == 10  # in place of 20
    assert rows_told(driving) == ["TICK_LATE"]
    assert driving.told("FAULT")[0][0] - begun_s <= BY_NAME["TICK_LATE"].detect_s
    assert driving.mode is Mode.AUTONOMOUS and not standing(driving)
    driving.run(1.1)
    assert driving.told("FAULT_CLEARED")[0][1] == "TICK_LATE"
    driving.run(5.0)  # what was put off comes
    assert heard(driving, 5.0) == (10, 5)


def test_no_product_goes_while_it_sheds(driving):
    driving.order("get", product="ldem")
    driving.run(0.1)
    while not any(kind == DatagramKind.BULK_CHUNK for kind, _ in driving.step().link_payloads):
        assert driving.tick < 10_000
    driving.leave_out(5)
    chunks = [sum(kind == DatagramKind.BULK_CHUNK for kind, _ in driving.step().link_payloads) for _ in range(300)]
    assert sum(chunks[:99]) == 0 and sum(chunks[110:]) > 0


def test_orders_over_50_ms_late_stop_the_wheels_in_their_tick_and_after_a_second_the_rover_drives_on(driving):
    driving.leave_out(5)  # 50 ms are not over 50 ms
    driving.step()
    assert driving.rover.twist != (0.0, 0.0, 0.0) and rows_told(driving) == ["TICK_LATE"]
    driving.run(1.1)
    driving.leave_out(6)
    driving.step()
    assert driving.rover.twist == (0.0, 0.0, 0.0) and rows_told(driving) == ["TICK_LATE", "CONTROL_LATE"]
    driving.run(0.98)
    assert standing(driving)
    driving.run(0.1)
    assert not standing(driving) and driving.mode is Mode.AUTONOMOUS


def test_a_tick_that_begins_late_counts_as_one_that_was_left_out(driving):
    driving.timing = Timing(late_ns=LATE_NS + 1)
    driving.step()
    driving.timing = Timing()
    assert driving.rover.twist == (0.0, 0.0, 0.0) and "(50 ms)" in driving.told("FAULT")[-1][1]


def test_the_fourth_late_order_within_a_minute_leads_to_safe(driving):
    for k in range(4):
        assert driving.mode is Mode.AUTONOMOUS, k
        driving.leave_out(7)
        driving.run(1.2)
    assert driving.mode is Mode.SAFE


def test_a_computer_that_is_late_for_a_minute_has_had_its_chances_and_one_that_mends_has_not():
    for lasting_s, used_up in ((59, False), (62, True)):
        watch = ComputerWatch()
        for number in (n for n in range(100 * lasting_s) if n % 10):
            watch.update(Inputs(number, number * TICK_NS), Computer())
        assert ("TICK_LATE" in watch.used_up) == used_up and "TICK_LATE" in watch.found
        watch.forget("TICK_LATE")
        assert not watch.used_up


def test_a_computer_that_keeps_its_ticks_finds_nothing():
    watch = ComputerWatch()
    for number in range(1, 1000):
        watch.update(Inputs(number, number * TICK_NS, timing=Timing(late_ns=9_000_000)), Computer())
    assert not watch.found and not watch.used_up


@pytest.mark.parametrize(("item", "value", "words"), [
    ("temperature_c", 97.0, "97 degrees Celsius"), ("cpu_ratio", 1.0, "100 % of the processor at work"),
    ("rss_bytes", 2e9, "1907 MB of memory taken"), ("free_memory_bytes", 1e6, "1 MB of memory free"),
])  # fmt: skip
def test_a_computer_past_a_limit_at_three_looks_says_which_and_at_the_next_that_is_well_no_more(item, value, words):
    rover = CoreBench()
    rover.settle()
    for look in range(LOOKS + 1):
        rover.machine = WELL._replace(**{item: value if look else math.nan})  # what it does not say is no fault
        rover.step()
        rover.machine = None
        assert rows_told(rover) == (["COMPUTER_STRAINED"] if look == LOOKS else [])
        rover.run(0.99)
    assert words in rover.told("FAULT")[0][1]
    rover.machine = WELL
    rover.step()
    assert rover.told("FAULT_CLEARED")[0][1] == "COMPUTER_STRAINED"


def test_every_limit_of_the_computer_is_watched():
    beyond = Machine(2.0, 0.0, 1e15, -1.0, 200.0, 0.0)
    assert strained(beyond, Computer()).count(",") == len(Computer.__slots__) - 1
    assert strained(WELL, Computer()) == ""


# -- chances -------------------------------------------------------------------------------------------------------


def test_chances_that_were_used_long_ago_count_no_more():
    spells = Spells(most=2, within_ns=100, longest_ns=1000)
    for at_ns in (0, 50, 101):
        spells.note(True, at_ns)
        assert not spells.used_up
        spells.note(False, at_ns + 1)
    spells.note(True, 120)
    assert spells.used_up  # 50, 101 and 120
    spells.note(False, 160)
    assert not spells.used_up


# -- the mission rule and the operator -----------------------------------------------------------------------------


def planned(monkeypatch, **changes):
    """Every plan from now on with its decision's kind or its state changed."""
    real = cycle.plan

    def plan(request):
        result = real(request)
        return replace(
            result,
            decision=replace(result.decision, **changes.get("decision", {})),
            state=replace(result.state, **changes.get("state", {})),
        )

    monkeypatch.setattr(cycle, "plan", plan)


def test_a_goal_without_a_way_is_told_as_no_path_until_the_next_goto(known, monkeypatch):
    rover = CoreBench(memory=known)
    rover.settle()
    planned(monkeypatch, decision={"kind": "unreachable", "reason": "nothing is left"})
    request = rover.goto(3.0, 0.5)
    assert rover.until_final(request) is RequestState.FAILED
    failed_s, why = rover.told("FAILED")[0]
    assert why == "nothing is left"
    rover.run(1.0)
    assert rows_told(rover) == ["NO_PATH"]
    assert rover.told("FAULT")[0][0] - failed_s <= BY_NAME["NO_PATH"].detect_s
    assert rover.mode is Mode.STANDBY and standing(rover)
    rover.goto(1.0, 0.0)
    rover.run(0.1)
    assert rover.told("FAULT_CLEARED")[0][1] == "NO_PATH"


@pytest.mark.parametrize(("strategy", "told"), [("visibility", ["LOOP"]), ("optimistic", [])])
def test_a_strategy_that_comes_no_nearer_for_two_stops_is_told_as_a_loop_while_it_runs(
    known, monkeypatch, strategy, told
):
    rover = CoreBench(settings=quick(mission=Mission(strategy=strategy)), memory=known)
    rover.settle()
    planned(monkeypatch, state={"since_record": 1})
    rover.goto(3.0, 0.5)
    rover.until_phase(Phase.DRIVING)
    rover.run(0.1)
    assert rows_told(rover) == []
    planned(monkeypatch, state={"since_record": 2})
    rover.goto(3.0, 0.5)
    rover.step()
    rover.until_phase(Phase.DRIVING)
    rover.run(0.02)
    assert rows_told(rover) == told and rover.mode is Mode.AUTONOMOUS
    rover.order("stop")
    rover.run(0.02)
    assert [text for _, text in rover.told("FAULT_CLEARED")] == [*told, "OPERATOR"]


@pytest.mark.parametrize(
    ("order", "mode"),
    [
        ("stop", Mode.STANDBY),
        ("safe", Mode.SAFE),
        ("emergency_stop", Mode.ESTOP),
    ],
)
def test_the_operators_word_is_a_row_of_its_own_and_obeyed_in_its_tick(driving, order, mode):
    driving.order(order)
    driving.step()
    assert rows_told(driving)[0] == "OPERATOR"
    assert driving.mode is mode and driving.rover.twist == (0.0, 0.0, 0.0)
    driving.step()
    assert driving.told("FAULT_CLEARED")[0][1] == "OPERATOR"


def test_the_defaults_leave_a_battery_that_is_half_empty_alone():
    watch = PowerWatch()
    for k in range(1, 4):
        watch.update(word(24.5, 0.25), k * S, Config().safety)
    assert not watch.found
