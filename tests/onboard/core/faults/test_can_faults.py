"""The CAN rows of the fault table: the flight core against a bench whose wire is broken in every way that has a row."""

from itertools import pairwise

import pytest

from hil.faults.can_faults import CAUSES
from onboard.core.mission.sweep import SweepState
from onboard.devices.can_recovery import WAITS_NS
from onboard.records import BusTrouble, Frame, Twist
from protocol.conventions import cut
from protocol.generated.can_codec import TABLE
from protocol.link.events import TEXT_BYTES
from protocol.tables.faults import BY_NAME
from protocol.tables.modes import Mode, Phase
from tests.onboard.core_bench import CoreBench, first_map, quick

TICK_S = 0.01
pytestmark = pytest.mark.copied
POWER_STATUS, STATUS_2 = 0x200, 0x1A2


@pytest.fixture(scope="module")
def known():
    return first_map()


@pytest.fixture(scope="module")
def driving(known):
    rover = CoreBench(settings=quick(), memory=known)
    rover.settle()
    rover.request = rover.goto(3.0, 0.5)
    rover.until_driving()
    return rover


def begin(rover, cause, target=0):
    CAUSES[cause].begin(rover.wire, target)


def heal(rover, cause, target=0):
    CAUSES[cause].heal(rover.wire, target)


def standing(rover):
    return rover.rates == [0.0] * 4


def told(rover, name):
    return [text for _, text in rover.told("FAULT") if text.startswith(name)]


def names(rover):
    return {text.partition(":")[0] for _, text in rover.told("FAULT")}


# -- the bus is lost ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("cause", "words"), [("can_bus_off", "bus-off"), ("can_unplugged", "closed")])
def test_a_lost_bus_is_named_and_orders_zero_within_50_ms(driving, cause, words):
    begin(driving, cause)
    took = driving.until(lambda: driving.rover.twist == Twist() and told(driving, "CAN_BUS_OFF"), 1.0)
    assert took <= BY_NAME["CAN_BUS_OFF"].detect_s
    assert words in told(driving, "CAN_BUS_OFF")[0]


def test_silence_of_all_nodes_is_a_lost_bus_within_50_ms_and_not_four_silent_wheels(driving):
    for node in driving.nodes.all:
        node.silent = True
    took = driving.until(lambda: told(driving, "CAN_BUS_OFF"), 1.0)
    assert took <= BY_NAME["CAN_BUS_OFF"].detect_s + TICK_S  # the first frame that is missing comes a tick later
    driving.run(2.0)
    assert names(driving) == {"CAN_BUS_OFF"}
    assert "no frame of any node" in told(driving, "CAN_BUS_OFF")[0]


def test_without_orders_the_wheels_stop_by_themselves(driving):
    begin(driving, "can_bus_off")
    driving.run(0.1 + 1.3)  # the node's timeout, then 1 rad/s2 from 1.1 rad/s
    assert max(map(abs, driving.turning_rates)) < 0.02


@pytest.mark.parametrize("lost_s", [0.2, 1.0, 2.5])
@pytest.mark.parametrize("cause", ["can_bus_off", "can_unplugged"])
def test_after_a_recovery_the_drive_goes_on_without_any_other_fault(driving, cause, lost_s):
    begin(driving, cause)
    driving.run(lost_s)
    heal(driving, cause)
    driving.until(lambda: not standing(driving), 2.0)
    driving.run(1.0)
    assert names(driving) == {"CAN_BUS_OFF"}
    assert driving.mode is Mode.AUTONOMOUS
    assert [text for _, text in driving.told("FAULT_CLEARED")] == ["CAN_BUS_OFF"]
    assert driving.rover.nodes.lost_frames == 0  # counters were not followed across the gap


def test_the_bus_is_opened_again_at_once_then_after_growing_waits_and_safe_ends_it(driving):
    begin(driving, "can_unplugged")
    tries, safe_s = [], None
    for k in range(500):
        driving.step()
        if driving.outputs.can_connect:
            tries.append(k * TICK_S)
        if safe_s is None and driving.mode is Mode.SAFE:
            safe_s = k * TICK_S
    waits = [round(b - a, 2) for a, b in pairwise(tries)]
    assert tries[0] == 0.0
    assert waits[:6] == [wait_ns / 1e9 for wait_ns in WAITS_NS]
    assert safe_s == pytest.approx(sum(WAITS_NS) / 1e9, abs=0.02)
    assert "CAN_BUS_OFF" in driving.told("MODE")[-1][1]


def test_safe_is_not_left_while_the_bus_is_gone_and_can_be_left_when_it_is_back(driving):
    begin(driving, "can_unplugged")
    driving.until(lambda: driving.mode is Mode.SAFE, 5.0)
    refused = driving.order("resume")
    driving.run(0.1)
    assert driving.text(refused) == "still active: CAN_BUS_OFF"
    heal(driving, "can_unplugged")
    driving.until(lambda: driving.rover.nodes.bus_well, 11.0)  # the slow tries of 10 s go on
    driving.order("resume")
    driving.run(0.1)
    assert driving.mode is Mode.STANDBY


def test_a_bus_that_comes_and_goes_ends_in_safe_too(driving):
    for _ in range(12):
        begin(driving, "can_hung_up")
        driving.run(0.6)
    assert driving.mode is Mode.SAFE
    assert "CAN_BUS_OFF" in driving.told("MODE")[-1][1]


def test_a_sweep_that_the_bus_broke_is_taken_again(known):
    rover = CoreBench(settings=quick(), memory=known)
    rover.settle()
    rover.goto(3.0, 0.5)
    rover.until_phase(Phase.SCANNING)
    rover.until(lambda: rover.rover.executive.mission._sensing.state is SweepState.SWEEPING, 10.0)
    begin(rover, "can_bus_off")
    rover.run(0.3)
    heal(rover, "can_bus_off")
    rover.run(0.3)
    assert rover.rover.executive.mission._sensing.tries == 1
    rover.until_phase(Phase.DRIVING)


def test_error_passive_is_counted_and_stops_nothing(driving):
    begin(driving, "can_error_passive")
    driving.run(0.5)
    assert driving.inputs.can.error_frames[BusTrouble.PASSIVE] == 1
    assert not standing(driving) and not names(driving)
    assert any("error-passive" in text for _, text in driving.told("CAN"))


# -- its frames are wrong ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("can_id", [0x185, POWER_STATUS, STATUS_2], ids=["unknown", "power", "wheel status"])
def test_a_babbling_id_is_named_within_200_ms_and_ignored_until_it_stops(driving, can_id):
    begin(driving, "can_babble", can_id)
    took = driving.until(lambda: told(driving, "CAN_BABBLE"), 1.0)
    assert took <= BY_NAME["CAN_BABBLE"].detect_s
    assert f"{can_id:#05x}" in told(driving, "CAN_BABBLE")[0]
    driving.run(0.3)
    counted = driving.rover.nodes.bad_frames, driving.rover.nodes.unknown_frames
    driving.run(1.0)
    assert (driving.rover.nodes.bad_frames, driving.rover.nodes.unknown_frames) == counted
    assert not standing(driving) and names(driving) == {"CAN_BABBLE"}
    heal(driving, "can_babble", can_id)
    driving.run(2.0)
    assert [text for _, text in driving.told("FAULT_CLEARED")] == ["CAN_BABBLE"]


def test_a_babbling_wheel_is_ignored_and_therefore_silent(driving):
    begin(driving, "can_babble", 0x182)
    driving.until(lambda: driving.mode is Mode.SAFE, 0.2 + BY_NAME["WHEEL_SILENT"].detect_s + TICK_S)
    assert "WHEEL_SILENT" in driving.told("MODE")[-1][1]


def test_a_bus_loaded_beyond_its_limit_ends_in_safe(driving):
    def flood():
        driving.noise = tuple(Frame(0x70F, bytes(8), driving.now_ns) for _ in range(28))
        driving.step()
        return driving.mode is Mode.SAFE

    assert any(flood() for _ in range(40))
    assert "CAN_BABBLE" in driving.told("MODE")[-1][1]


def test_corrupt_frames_are_named_within_200_ms_with_their_counts_and_dropped(driving):
    begin(driving, "can_corrupt", 8)
    took = driving.until(lambda: told(driving, "CAN_CORRUPT"), 1.0)
    assert took <= BY_NAME["CAN_CORRUPT"].detect_s
    assert "checksums" in told(driving, "CAN_CORRUPT")[0]
    driving.run(2.0)
    counts = driving.rover.nodes.guard_counts
    assert counts.crc > 100 and counts.accepted > 10 * counts.crc
    assert driving.mode is Mode.AUTONOMOUS
    heal(driving, "can_corrupt")
    driving.run(1.0)
    assert "CAN_CORRUPT" in [text for _, text in driving.told("FAULT_CLEARED")]


def test_corruption_of_every_third_frame_ends_in_safe(driving):
    begin(driving, "can_corrupt", 33)
    driving.until(lambda: driving.mode is Mode.SAFE, 0.5)
    assert "CAN_CORRUPT" in driving.told("MODE")[-1][1]


def test_frames_read_by_a_tick_that_began_late_are_not_from_the_future(driving):
    driving.wire.ahead_ns = 9_000_000  # stamped when they are read, 9 ms after the tick was due
    driving.run(1.0)
    assert driving.rover.nodes.from_future == 0
    assert not driving.told("FAULT") and not standing(driving)


def test_frames_from_the_future_are_named_and_do_not_look_fresh_for_ever(driving):
    begin(driving, "can_future")
    driving.run(0.3)
    text = told(driving, "CAN_CORRUPT")[0]
    assert "from the future" in cut(text, TEXT_BYTES).decode(), "the figures reach the ground"
    assert driving.rover.nodes.from_future > 100
    assert driving.mode is Mode.AUTONOMOUS and not standing(driving)
    driving.nodes.wheels[1].silent = True
    took = driving.until(lambda: standing(driving), 1.0)
    assert took <= BY_NAME["WHEEL_STALE"].detect_s + TICK_S


# -- who speaks ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("node", "name"), [(2, "WHEEL_2"), (5, "TILT"), (7, "POWER")])
def test_a_node_that_speaks_another_dbc_is_named_at_its_first_heartbeat_and_there_is_no_drive(driving, node, name):
    begin(driving, "node_foreign", node)
    driving.until(lambda: driving.mode is Mode.SAFE, 0.5 + BY_NAME["NODE_FOREIGN"].detect_s)
    assert f"DBC version of {name} " in told(driving, "NODE_FOREIGN")[0]
    driving.run(0.1)
    assert standing(driving)
    heal(driving, "node_foreign", node)
    driving.run(0.6)
    driving.order("resume")
    driving.run(0.1)
    assert driving.mode is Mode.STANDBY


@pytest.mark.parametrize(("node", "name"), [(3, "WHEEL_3"), (6, "IMU"), (7, "POWER")])
def test_a_second_node_under_one_id_is_named_within_a_second_and_there_is_no_drive(driving, node, name):
    begin(driving, "node_twice", node)
    took = driving.until(lambda: driving.mode is Mode.SAFE, 2.0)
    assert took <= BY_NAME["NODE_TWICE"].detect_s
    assert name in told(driving, "NODE_TWICE")[0]
    driving.run(0.1)
    assert standing(driving) and names(driving) == {"NODE_TWICE"}


def test_a_second_computer_on_the_bus_is_a_node_twice(driving):
    for k in range(30):
        data = TABLE[0x300].encode(1, k, 7, k & 15)
        driving.noise = (Frame(0x300, data, driving.now_ns),)
        driving.step()
    assert driving.mode is Mode.SAFE
    assert "COMPUTER" in told(driving, "NODE_TWICE")[0]
