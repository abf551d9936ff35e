"""Tests of the wheels campaign's judge: its measurements of the truth, and its limits."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hil.records import PlantState, WheelTruth
from onboard.records import Event, WheelCommand, WheelMode, WheelState
from protocol.generated.can_codec import NodeState
from tests.scenarios import wheels
from tests.scenarios.true_slip import PLACES_M, WINDOW_TICKS, TrueSlip, wheels_twist

pytestmark = pytest.mark.tool

RIM_RADPS, RIM_MPS = 1.1, 0.11
LOCALISED = SimpleNamespace(step=SimpleNamespace(dx_m=RIM_MPS / 100, dy_m=0.0))


def truth(velocity_mps=(RIM_MPS, 0.0, 0.0), steers_rad=(0.0,) * 4, quaternion_xyzw=(0.0, 0.0, 0.0, 1.0), rates=None):
    rates = rates or (RIM_RADPS,) * 4
    still = np.zeros(3)
    return PlantState(
        0,
        still,
        np.array(quaternion_xyzw),
        np.array(velocity_mps),
        still,
        still,
        tuple(WheelTruth(steer, 0.0, rate, 0.3) for steer, rate in zip(steers_rad, rates)),
    )


def lacks_ratio(state, ticks=WINDOW_TICKS):
    slip = TrueSlip()
    for _ in range(ticks):
        slip.update(state)
    return slip.lacks_ratio


# -- slip ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", (1.0, 0.6, 0.0, -0.2))
def test_the_body_lacks_what_it_does_not_make_of_the_wheels_way(share):
    assert lacks_ratio(truth((share * RIM_MPS, 0.0, 0.0))) == pytest.approx(1.0 - share)


def test_it_is_taken_in_the_rovers_own_axes_and_along_where_the_wheels_point():
    up_north = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))  # a quarter turn to the left, crabbing to its right: east
    assert lacks_ratio(truth((RIM_MPS / 2, 0.0, 0.0), (-math.pi / 2,) * 4, up_north)) == pytest.approx(0.5)


def test_a_slide_across_the_wheels_way_makes_no_way():
    assert lacks_ratio(truth((0.0, RIM_MPS, 0.0))) == pytest.approx(1.0)


def test_nothing_is_said_before_a_second_is_over_of_slow_wheels_and_of_a_turn_on_the_spot():
    stands = truth((0.0, 0.0, 0.0))
    assert lacks_ratio(stands, WINDOW_TICKS - 1) == 0.0
    assert lacks_ratio(truth((0.0, 0.0, 0.0), rates=(0.39,) * 4)) == 0.0
    assert lacks_ratio(truth((0.0, 0.0, 0.0), rates=(RIM_RADPS, RIM_RADPS, -RIM_RADPS, -RIM_RADPS))) == 0.0


def strays_rad(turn_radps, seconds, **state):
    """Return the strays after this time at this turn rate; by default straight ahead with the wheels straight."""
    slip, still = TrueSlip(), truth(**state)
    turning = replace(still, angular_radps=np.array([0.0, 0.0, turn_radps]))
    for _ in range(round(seconds * 100)):
        slip.update(turning)
    return slip.strays_rad


def test_a_body_strays_by_what_it_turned_otherwise_than_its_wheels_within_the_last_metre():
    assert strays_rad(-0.01, 5.0) == pytest.approx(0.05)
    assert strays_rad(0.01, 60.0) == pytest.approx(0.01 / RIM_MPS, rel=0.01)


ON_THE_SPOT = tuple(math.atan2(a, -b) for a, b in PLACES_M)  # all to the left


def test_the_wheels_turn_is_taken_out_and_a_turn_on_the_spot_is_no_straying():
    crooked = truth(steers_rad=(0.1, -0.1, -0.1, 0.1))
    u, w, turn_radps = wheels_twist(crooked)
    assert (u, w) == pytest.approx((RIM_MPS * math.cos(0.1), 0.0))
    assert turn_radps > 0.0
    assert strays_rad(turn_radps, 5.0, steers_rad=(0.1, -0.1, -0.1, 0.1)) == pytest.approx(0.0)
    assert wheels_twist(truth(steers_rad=ON_THE_SPOT)) == pytest.approx((0.0, 0.0, RIM_MPS / math.hypot(*PLACES_M[0])))
    assert strays_rad(0.2, 5.0, steers_rad=ON_THE_SPOT) == 0.0


# -- when a fault shows --------------------------------------------------------------------------------------------


def watched(fault, row, wheel, spells):
    """Return the campaign's truth after spells of (ticks, share of wheel 1's owed rate); nothing is detected."""
    seen = wheels._Truth(fault, row, wheel)
    seen.begun = True
    rover = SimpleNamespace(
        orders=[WheelCommand(WheelMode.RUN, 0.0, RIM_RADPS)] * 4,
        watch=SimpleNamespace(faults={}),
        localisation=LOCALISED,
    )
    owed_radps = tick = 0
    for ticks, share in spells:
        for _ in range(ticks):
            owed_radps, tick = min(RIM_RADPS, owed_radps + 0.01), tick + 1
            rates = (share * owed_radps, owed_radps, owed_radps, owed_radps)
            seen.observe(tick, None, None, rover, truth(rates=rates))
    return seen


def test_a_weak_drive_shows_from_the_first_tick_of_a_second_in_which_it_turns_otherwise_than_it_owes():
    seen = watched("wheel_weak", "WHEEL_WEAK", 1, [(300, 1.0), (150, 0.9)])
    assert seen.violated_tick == pytest.approx(301, abs=wheels.BLOCK_TICKS)


@pytest.mark.parametrize("spells", [[(400, 1.0)], [(300, 1.0), (60, 0.9), (300, 1.0)]])
def test_a_drive_that_ramps_or_lacks_a_moment_only_is_not_weak(spells):
    assert watched("wheel_weak", "WHEEL_WEAK", 1, spells).violated_tick == -1


def test_the_way_counts_from_the_start_of_the_second_that_shows_a_slip():
    seen = watched("soft_patch", "SLIP_HIGH", 0, [(500, 1.0)])
    assert seen.violated_tick == -1
    seen._slip._ways.extend([(RIM_MPS, 0.0)] * WINDOW_TICKS)
    rover = SimpleNamespace(watch=SimpleNamespace(faults={}), localisation=LOCALISED)
    seen.observe(501, None, None, rover, truth((0.0, 0.0, 0.0)))
    assert seen.violated_tick == 501 - WINDOW_TICKS + 1
    assert seen.way_m == pytest.approx(RIM_MPS, rel=0.02)


def jumping(counts_rad):
    """Return the campaign's truth of a jumping encoder of wheel 1; counts_rad: error of its count, for each tick."""
    seen = wheels._Truth("encoder_jumping", "ENCODER_BAD", 1)
    seen.begun = True
    for tick, over_rad in enumerate(counts_rad):
        state = truth()
        told = WheelState(0.0, state.wheels[0].position_rad + over_rad, RIM_RADPS, NodeState.RUNNING, 0)
        rover = SimpleNamespace(
            orders=[WheelCommand(WheelMode.RUN, 0.0, RIM_RADPS)] * 4,
            watch=SimpleNamespace(faults={}),
            localisation=LOCALISED,
            nodes=SimpleNamespace(wheels=[told] * 4),
        )
        seen.observe(tick, None, None, rover, state)
    return seen


def test_a_jumping_encoder_shows_from_its_first_jump_and_not_by_the_wires_lag():
    assert jumping([0.5] * 30 + [0.52] * 30).violated_tick == -1
    assert jumping([0.5] * 30 + [0.2] * 30).violated_tick == 30


def lacking(ticks, found_tick=None):
    """Return the campaign's truth of dust on which the body stands for so long, to the last tick."""
    seen = wheels._Truth("no_grip", "NOT_MOVING", 0)
    seen.begun = True
    for tick in range(ticks):
        faults = {"NOT_MOVING": ()} if found_tick is not None and tick >= found_tick else {}
        rover = SimpleNamespace(watch=SimpleNamespace(faults=faults), localisation=LOCALISED)
        seen.observe(tick, None, None, rover, truth((0.0, 0.0, 0.0)))
    return seen


def test_dust_shows_where_the_rover_stands_on_it_for_the_rows_time_or_until_it_is_found():
    assert lacking(499).violated_tick == -1
    assert lacking(500).violated_tick == 0
    assert lacking(350, found_tick=340).violated_tick == 0
    assert lacking(350, found_tick=340).way_m == pytest.approx(340 * RIM_MPS / 100, rel=0.01)


def named_before(name, velocity_mps):
    """Return the rows counted as false that are named before the fault begins, with the wheels at RIM_MPS."""
    seen = wheels._Truth("soft_patch", "SLIP_HIGH", 0)
    rover = SimpleNamespace(localisation=LOCALISED)
    for tick in range(WINDOW_TICKS):
        events = [Event(tick, "WARNING", "FAULT", f"{name}: a text")] if tick == WINDOW_TICKS - 1 else []
        seen.observe(tick, None, SimpleNamespace(events=events), rover, truth(velocity_mps))
    return seen.false


def test_a_slip_that_is_named_before_the_fault_begins_is_false_unless_the_ground_really_slipped():
    assert named_before("SLIP_HIGH", (RIM_MPS, 0.0, 0.0)) == ["SLIP_HIGH"]
    assert named_before("SLIP_HIGH", (0.5 * RIM_MPS, 0.0, 0.0)) == []
    assert named_before("WHEEL_WEAK", (0.5 * RIM_MPS, 0.0, 0.0)) == ["WHEEL_WEAK"]


# -- judgement -----------------------------------------------------------------------------------------------------

STUCK = wheels.Row(210, "wheel_stuck", 2, 0.59, 0.1, True, 0.0, 0.5, "WHEEL_STUCK (wheel 2)", (), "SCANNING at stop 1")
SOFT = wheels.Row(218, "soft_patch", 0, 1.4, 0.2, True, 0.6, 1.5, "SLIP_HIGH", (), "")
GRIP = wheels.Row(219, "no_grip", 0, 3.2, 0.2, True, 0.8, 1.5, "NOT_MOVING", ("SLIP_HIGH",), "BACKING_OFF at stop 2")


def test_flights_that_keep_every_promise_are_let_pass():
    assert wheels.judge([STUCK, SOFT, GRIP]) == []
    for early in (replace(SOFT, shown=False, lacks=0.4), replace(SOFT, shown=False, lacks=0.2, strays_deg=9.0)):
        assert wheels.judge([early, SOFT]) == []


@pytest.mark.parametrize(("row", "told"), [
    (replace(STUCK, found=""), "nothing found in place of WHEEL_STUCK (wheel 2)"),
    (replace(STUCK, found="WHEEL_STUCK (wheel 3)"), "WHEEL_STUCK (wheel 3) found in place of WHEEL_STUCK (wheel 2)"),
    (replace(STUCK, took_s=1.01), "found after 1.01 s, 0.1 m"),
    (replace(SOFT, way_m=1.01), "found after 1.4 s, 1.01 m"),
    (replace(STUCK, answer="AUTONOMOUS -> SAFE: WHEEL_STUCK"), "answered by AUTONOMOUS -> SAFE: WHEEL_STUCK"),
    (replace(GRIP, answer=""), "answered by nothing"),
    (replace(SOFT, answer="AUTONOMOUS -> SAFE: SLIP_HIGH"), "answered by AUTONOMOUS -> SAFE: SLIP_HIGH"),
    (replace(STUCK, others=("SLIP_HIGH",)), "first SLIP_HIGH"),
])  # fmt: skip
def test_a_flight_falls_short_by_each_of_its_promises_alone(row, told):
    assert wheels.judge([row]) == [f"{row.seed} {row.fault}: {told}"]


@pytest.mark.parametrize("row", [replace(STUCK, shown=False), replace(SOFT, shown=False, lacks=0.2)])
def test_what_is_found_where_the_truth_does_not_show_it_is_false(row):
    assert f"{row.seed} {row.fault}: {row.found} is false" in wheels.judge([row])


def test_a_fault_that_no_flight_shows_is_told_with_the_row_that_it_leaves_unjudged():
    told = wheels.judge([replace(SOFT, shown=False, found="", lacks=0.1)])
    assert told == ["soft_patch never showed in 1 flights: SLIP_HIGH is not judged"]
