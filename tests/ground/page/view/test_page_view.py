"""View model of the operator's page: nothing old looks fresh, whatever is wrong; the chain of a command; STOP."""

import json
import math
import re

import pytest

from ground.link.news import Item
from ground.link.rover_clock import Correlation
from ground.page.live.series import STEP_M, Series, Trail
from ground.page.view.model import layout, stale_after_s, view
from ground.page.view.pace import Pace, unequal
from ground.page.view.snapshot import CommandRow, OldValue, Snapshot
from ground.page.view.tree_feed import PAST, TreeFeed
from ground.page.view.words import command_words, value_words
from ground.page.web.stop import StopDesk, told
from protocol.tables.telemetry import TABLE

S = 1_000_000_000
UTC = 1_700_000_000 * S


def shot(at_s=100.0, items=(), onboard_s=500.0, **more):
    """A station at `at_s`; the rover's clock shows `onboard_s`. items: (name, value, received at s, onboard time s)."""
    made = {name: Item(round(at * S), round(onboard * S), name, value) for name, value, at, onboard in items}
    clock = None if onboard_s is None else Correlation(round(onboard_s * S), S // 10)
    given = {
        "now_ns": round(at_s * S),
        "mono_ns": round(at_s * S),
        "utc_ns": UTC,
        "items": made,
        "clock": clock,
        "heard_ns": round(at_s * S),
        "rtt_ns": 2 * S,
        "linked": True,
        **more,
    }
    return Snapshot(**given)


def age_s(snapshot, name="x_m", later_s=0.0):
    tree = view(snapshot, snapshot.mono_ns + round(later_s * S))
    value = tree["values"][name]
    return None if value["at_s"] is None else tree["now_s"] - value["at_s"]


def is_stale(snapshot, name="x_m", later_s=0.0):
    """As static/ages.js decides."""
    value = view(snapshot, snapshot.mono_ns)["values"][name]
    age = age_s(snapshot, name, later_s)
    return age is None or age > value["stale_s"] or not value["live"]


FRESH = ("x_m", 3.0, 99.5, 498.5)


def test_a_value_is_as_old_as_its_measurement_on_the_rover_and_not_as_its_arrival():
    assert age_s(shot(items=[FRESH])) == pytest.approx(1.5) and not is_stale(shot(items=[FRESH]))


def test_a_value_that_was_under_way_for_long_is_old_on_arrival():
    assert is_stale(shot(items=[("x_m", 3.0, 99.9, 440.0)]))


def test_values_of_a_silent_rover_grow_old():
    snapshot = shot(items=[FRESH])
    assert age_s(snapshot, later_s=60.0) == pytest.approx(61.5) and is_stale(snapshot, later_s=5.0)


def test_values_grow_old_while_the_links_thread_stands_still():
    stuck = shot(items=[FRESH])
    assert view(stuck, stuck.mono_ns + 30 * S)["now_s"] == pytest.approx(130.0) and is_stale(stuck, later_s=30.0)


def test_a_value_from_the_future_of_the_rovers_clock_is_no_younger_than_its_arrival():
    assert age_s(shot(items=[("x_m", 3.0, 90.0, 9e5)])) == pytest.approx(10.0)


def test_after_a_restart_of_the_station_the_archives_values_are_shown_and_never_fresh():
    snapshot = shot(onboard_s=None, heard_ns=None, before={"x_m": OldValue(3.0, UTC + 99 * S)})
    assert view(snapshot, snapshot.mono_ns)["values"]["x_m"]["text"] == "3.00 m"
    assert age_s(snapshot) == pytest.approx(1.0) and is_stale(snapshot)


@pytest.mark.parametrize("utc_ns", [UTC + 200 * S, 0, -5])
def test_an_archived_value_of_the_future_or_without_a_clock_has_an_unknown_age(utc_ns):
    snapshot = shot(before={"x_m": OldValue(3.0, utc_ns)})
    assert age_s(snapshot) is None and is_stale(snapshot)


def test_the_wall_clock_of_the_station_changes_no_age_of_a_received_value():
    assert age_s(shot(items=[FRESH], utc_ns=1)) == age_s(shot(items=[FRESH], utc_ns=4 * UTC))


def test_one_way_down_only_values_are_fresh_and_a_command_stays_unheard():
    row = command(requested_ns=90 * S, sent_ns=90 * S, copies=9)
    tree = view(shot(items=[FRESH], commands=(row,)), 100 * S)
    assert tree["link"]["state"] == "heard" and tree["link"]["on_its_way"] == ["goto 1 2"]
    assert [at for _, at in tree["commands"][0]["steps"]] == [90.0, 90.0, None, None, None]


def test_one_way_up_only_the_link_is_silent():
    assert view(shot(items=[FRESH], heard_ns=80 * S), 100 * S)["link"]["state"] == "silent"


@pytest.mark.parametrize(("more", "state"), [
    ({"linked": False}, "closed"), ({"heard_ns": None}, "never"), ({"in_contact": False}, "no contact"), ({}, "heard"),
])  # fmt: skip
def test_the_link_has_one_word(more, state):
    assert view(shot(**more), 100 * S)["link"]["state"] == state


def test_a_clock_that_runs_at_a_third_says_nothing_about_ages():
    slow = Pace()
    for n in range(20):
        slow.hear(n * S // 3, n * S)
    assert slow.ratio == pytest.approx(1 / 3, rel=0.01) and unequal(slow.ratio)
    snapshot = shot(items=[("x_m", 3.0, 99.0, 400.0)], pace_ratio=slow.ratio)
    assert age_s(snapshot) == pytest.approx(2.0)  # its arrival and half a round trip
    assert "0.33" in view(snapshot, snapshot.mono_ns)["link"]["pace"]


def test_the_pace_forgets_an_earlier_boot_and_needs_four_seconds():
    pace = Pace()
    pace.hear(900 * S, 0)
    pace.hear(S, 5 * S)
    assert pace.ratio is None
    pace.hear(6 * S, 10 * S)
    assert pace.ratio == pytest.approx(1.0) and not unequal(pace.ratio) and not unequal(None)


def test_a_value_is_stale_after_three_periods_and_the_way():
    assert stale_after_s("x_m", 1.3) == pytest.approx(1.5 + 1.3 + 2.0) and stale_after_s("voltage_v", 0.0) == 5.0


def test_the_place_is_predicted_from_fresh_values_only_and_ahead_along_the_heading():
    moving = [FRESH, ("y_m", 1.0, 99.5, 498.5), ("yaw_rad", math.pi / 2, 99.5, 498.5), ("speed_mps", 0.1, 99.5, 498.5)]
    predicted = view(shot(items=moving), 100 * S)["pose"]["predicted"]
    assert predicted["x_m"] == pytest.approx(3.0) and predicted["y_m"] == pytest.approx(1.15)
    assert view(shot(items=moving), 120 * S)["pose"]["predicted"] is None
    assert view(shot(items=[*moving[:3], ("speed_mps", 0.0, 99.5, 498.5)]), 100 * S)["pose"]["predicted"] is None


def test_every_item_of_the_table_is_on_the_page_once():
    names = [item["name"] for group in layout() for item in group["items"]]
    assert sorted(names) == sorted(row.name for row in TABLE)


@pytest.mark.parametrize(("name", "value", "words"), [
    ("yaw_rad", math.pi, "180°"), ("roll_rad", 0.1, "5.7°"), ("yaw_rate_radps", 0.5, "29 °/s"),
    ("x_m", 1.234, "1.23 m"),
    ("charge_ratio", 0.95, "95 %"), ("mode", 2.0, "AUTONOMOUS"), ("x_m", math.nan, "?"), ("faults", 0.0, "none"),
])  # fmt: skip
def test_people_read_units_degrees_and_names(name, value, words):
    assert value_words(name, value) == words


def test_values_that_are_no_numbers_are_not_known():
    tree = view(shot(items=[("x_m", math.nan, 99.5, 498.5), ("y_m", 1.0, 99.5, 498.5)]), 100 * S)
    assert tree["pose"] is None and tree["values"]["x_m"]["text"] == "–"


def command(name="goto", arguments=None, state="REQUESTED", text="", copies=0, **times):
    given = {"requested_ns": None, "sent_ns": None, "heard_ns": None, "accepted_ns": None, "ended_ns": None, **times}
    return CommandRow(
        7,
        1,
        name,
        {"x_m": 1.0, "y_m": 2.0} if arguments is None else arguments,
        "test",
        UTC,
        state=state,
        text=text,
        copies=copies,
        **given,
    )


def test_a_failed_commands_chain_ends_with_the_failure():
    row = command(requested_ns=S, sent_ns=S, heard_ns=2 * S, ended_ns=2 * S, state="FAILED", text="no")
    tree = view(shot(commands=(row,)), 100 * S)["commands"][0]
    assert tree["steps"][-1] == ["failed", 2.0] and tree["steps"][3] == ["accepted", None] and not tree["good"]


def test_a_command_is_shown_as_it_is_typed_with_degrees_and_no_control_characters():
    assert command_words("turn", {"heading_rad": math.pi / 2}) == "turn 90°"
    assert "\x1b" not in command_words("nothing\x1b[2J", {})


@pytest.mark.parametrize(("row", "state", "final"), [
    (None, "requested", False), (command("stop", {}, requested_ns=99 * S), "requested", False),
    (command("stop", {}, requested_ns=99 * S, sent_ns=99 * S, copies=2), "sent", False),
    (command("stop", {}, "ACCEPTED", requested_ns=97 * S, sent_ns=97 * S, heard_ns=99 * S), "heard", False),
    (command("stop", {}, "COMPLETED", requested_ns=97 * S, sent_ns=97 * S, heard_ns=99 * S, ended_ns=99 * S),
     "completed", True),
    (command("stop", {}, "FAILED", requested_ns=97 * S, sent_ns=97 * S, heard_ns=99 * S, ended_ns=99 * S),
     "failed", True),
])  # fmt: skip
def test_a_stop_says_how_far_it_came(row, state, final):
    found = told(row, shot())
    assert (found["state"], found["final"]) == (state, final)
    assert ("2.0 s" in found["words"]) == (state in ("heard", "completed", "failed"))


@pytest.mark.parametrize("row", [
    None, command("stop", {}), command("stop", {}, copies=5),
    command("stop", {}, requested_ns=120 * S, sent_ns=120 * S),
])  # fmt: skip
def test_a_stop_while_the_link_is_down_says_so_and_counts_no_seconds(row):
    found = told(row, shot(at_s=0.0, linked=False, trouble="no link: nobody is there"))
    assert "nobody is there" in found["words"] and not found["final"] and not re.search(r"\d s", found["words"])


@pytest.mark.parametrize("linked", [False, True])
@pytest.mark.parametrize(("state", "good"), [("COMPLETED", True), ("CANCELLED", False)])
def test_a_stop_that_ended_before_the_link_was_opened_again_has_its_outcome(linked, state, good):
    found = told(command("stop", {}, state, "halted", copies=2, ended_ns=0), shot(linked=linked))
    assert found["final"] and found["good"] == good and "halted" in found["words"]


class FakeStation:
    def __init__(self):
        from concurrent.futures import Future

        self.snapshot, self.asked, self.future = shot(linked=False, trouble="no link: nobody is there"), [], Future()

    def ask(self, name, arguments, asked_by, lifetime_s=0.0):
        self.asked.append((name, asked_by))
        return self.future

    def command(self, request_id):
        return None


def test_a_press_asks_once_however_often_it_is_posted_and_waits_for_a_closed_link():
    station = FakeStation()
    desk = StopDesk(station)
    for _ in range(3):
        found = desk.press("press-0001", "page operator")
    assert station.asked == [("stop", "page operator")] and found["state"] == "waiting" and "nobody" in found["words"]
    station.future.set_result(7)
    assert desk.press("press-0001", "page operator")["state"] == "requested"
    desk.press("press-0002", "page operator")
    assert len(station.asked) == 2
    with pytest.raises(ValueError, match="press"):
        desk.press("<script>", "page operator")


def test_a_stop_that_the_session_refuses_says_why():
    station = FakeStation()
    station.future.set_exception(ValueError("this station has no command key"))
    found = StopDesk(station).press("press-0001", "page operator")
    assert found["final"] and not found["good"] and "command key" in found["words"]


def test_the_short_history_keeps_the_newest_values_in_order_and_each_once():
    series = Series(length=5)
    for n in range(8):
        item = Item(n, n, "x_m", float(n))
        for _ in range(2):
            series.add({"x_m": item}, {"x_m": 100.0 + n})
    assert series.of("x_m").tolist() == [[100.0 + n, float(n)] for n in range(3, 8)] and len(series.of("y_m")) == 0


def test_a_trail_has_places_apart_and_begins_anew_with_a_boot():
    trail = Trail([(0.0, 0.0)])
    for n in range(11):
        trail.add(n * STEP_M * 0.501, 0.0, 1)
    trail.add(math.nan, 0.0, 1)
    assert len(trail.places) == 6 and trail.begun == 0
    trail.add(0.0, 0.0, 2)
    assert trail.places == [(0.0, 0.0)] and trail.begun == 1


def test_the_plot_is_sent_only_what_is_new_of_the_short_history():
    series = Series(4)
    series.seed("voltage_v", [(t, 20.0 + t) for t in range(3)])
    assert series.since("voltage_v", 1).tolist() == [[1, 21], [2, 22]]
    series.seed("voltage_v", [(t, 20.0 + t) for t in range(3, 9)])
    assert series.count("voltage_v") == 9 and len(series.since("voltage_v", 9)) == 0
    assert series.since("voltage_v", 8).tolist() == [[8, 28]]
    assert series.since("voltage_v", 1).tolist() == series.of("voltage_v").tolist()  # the ring has lost the rest


def test_a_difference_has_the_time_and_only_what_has_changed():
    snapshot = shot(items=[FRESH])
    feed = TreeFeed(view(snapshot, snapshot.mono_ns))
    feed.take(view(snapshot, snapshot.mono_ns + S))
    sent = json.loads(feed.text(0))
    assert set(sent) == {"number", "whole", "now_s", "utc_s"} and len(feed.text(0)) < 120
    moved = shot(101.0, onboard_s=501.0, items=[("x_m", 4.0, 101.0, 500.0)])
    feed.take(view(moved, moved.mono_ns))
    assert json.loads(feed.text(1))["values"] == {"x_m": {"text": "4.00 m", "at_s": 100.0}}


def test_differences_one_after_the_other_make_the_whole_tree_as_the_browser_adds_them():
    states = [shot(100.0 + k, onboard_s=500.0 + k, items=[("x_m", 1.0 * k, 100.0 + k, 499.5 + k)]) for k in range(5)]
    trees = [view(one, one.mono_ns) for one in states]
    feed = TreeFeed(trees[0])
    tree = json.loads(json.dumps(feed.whole()))
    for one in trees[1:]:
        feed.take(one)
        fresh = json.loads(feed.text(tree["number"]))
        assert not fresh["whole"]
        values = {name: {**tree["values"][name], **one} for name, one in fresh["values"].items()}
        tree = {**tree, **fresh, "values": {**tree["values"], **values}}  # as static/ages.js
    assert {**tree, "whole": True} == json.loads(json.dumps(feed.whole()))
    assert tree["values"]["x_m"]["text"] == "4.00 m"


def test_a_browser_that_missed_a_tree_gets_a_whole_one_and_one_that_has_the_newest_nothing():
    snapshot = shot(items=[FRESH])
    feed = TreeFeed(view(snapshot, snapshot.mono_ns))
    assert feed.text(0) == "" and json.loads(feed.text(PAST))["whole"]
    for _ in range(3):
        feed.take(view(snapshot, snapshot.mono_ns))
    assert json.loads(feed.text(1))["whole"] and json.loads(feed.text(PAST))["whole"]
    assert not json.loads(feed.text(2))["whole"]


def test_the_place_has_the_ellipse_of_its_covariance_and_of_an_older_rover_a_circle():
    axes = {"sigma_major_m": 0.4, "sigma_minor_m": 0.1, "sigma_axis_rad": 0.5}
    place = [FRESH, ("y_m", 2.0, 99.5, 498.5), ("sigma_position_m", 0.3, 99.5, 498.5)]
    found = view(shot(items=[*place, *((name, one, 99.5, 498.5) for name, one in axes.items())]), 0)["pose"]
    assert found["ellipse"] == {"major_m": 0.4, "minor_m": 0.1, "axis_rad": 0.5}
    assert view(shot(items=place), 0)["pose"]["ellipse"] == {"major_m": 0.3, "minor_m": 0.3, "axis_rad": 0.0}
    assert view(shot(items=place[:2]), 0)["pose"]["ellipse"] is None


def test_wheels_are_sent_as_numbers_for_the_drawing_reported_and_ordered():
    items = [("steer_1_rad", 0.25, 99.5, 498.5), ("steer_ordered_1_rad", 0.5, 99.5, 498.5)]
    values = view(shot(items=items), 0)["values"]
    assert (values["steer_1_rad"]["number"], values["steer_ordered_1_rad"]["number"]) == (0.25, 0.5)
    assert values["rate_ordered_4_radps"]["number"] is None and "number" not in values["x_m"]
