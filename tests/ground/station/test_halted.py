"""A command that moves the rover and has no answer yet is not repeated after the same station sent a stop."""

import pytest

from ground.archive.store import Archive
from ground.link.news import ReportHeard
from ground.link.session import Session
from hil.link.impairment import load_profile
from protocol.link.transactions import RequestState
from protocol.tables import commands
from tests.ground.link.test_session import KEYS, World

GOTO = {"x_m": 1.0, "y_m": 2.0}


def deaf_world():
    """The rover was heard; nothing of what is asked reaches it."""
    world = World(load_profile("ets8-a"))
    while not world.session.commanding:
        world.tick()
    world.up.offer = lambda *_: None
    return world


def sent_names(world, seconds):
    names, seal = [], world.session.sealer.seal
    world.session.sealer.seal = lambda kind, payload: (names.append(_name(kind, payload)), seal(kind, payload))[1]
    for _ in range(round(seconds * 100)):
        world.tick()
    return set(names) - {""}


def _name(kind, payload):
    return commands.decode(payload).name if kind == 4 else ""


@pytest.mark.parametrize("halt", commands.HALTING)
def test_an_unheard_goto_is_not_sent_again_after_what_halts_and_says_why(halt):
    world = deaf_world()
    goto, get = world.session.request("goto", GOTO, world.now_ns), world.session.request("status", {}, world.now_ns)
    assert sent_names(world, 2.0) == {"goto", "status"}
    world.session.request(halt, {}, world.now_ns)
    request = world.session.requester.requests[goto]
    assert request.state is RequestState.CANCELLED
    assert request.report.text.startswith(f"`{commands.command(halt).typed}` was asked for after it")
    assert [one.report.request_id for one in world.session.unsaid() if isinstance(one, ReportHeard)] == [goto]
    assert sent_names(world, 5.0) == {"status"}
    assert world.session.requester.requests[get].state is RequestState.REQUESTED


def test_what_is_asked_after_the_stop_or_was_heard_of_goes_on():
    world = World(load_profile("ets8-a"))
    while not world.session.commanding:
        world.tick()
    heard = world.session.request("goto", GOTO, world.now_ns)
    while world.session.requester.requests[heard].state is RequestState.REQUESTED:
        world.tick()
    world.session.request("stop", {}, world.now_ns)
    later = world.session.request("goto", GOTO, world.now_ns)
    assert world.session.requester.requests[heard].state is not RequestState.CANCELLED
    assert world.session.requester.unheard_moves == [later]


def test_what_the_rover_says_of_it_later_counts():
    world = World(load_profile("ets8-a"))
    while not world.session.commanding:
        world.tick()
    goto = world.session.request("goto", GOTO, world.now_ns)
    world.tick()
    world.session.request("stop", {}, world.now_ns)
    assert world.session.requester.requests[goto].state is RequestState.CANCELLED
    for _ in range(200):
        world.tick()
    assert world.session.requester.requests[goto].report.text == "stopped by the operator"
    assert world.rover.executed == ["goto", "stop"]


@pytest.mark.parametrize(("station", "before", "found"), [(1, False, "stop"), (2, False, ""), (1, True, "")])
def test_a_stop_of_another_process_is_found_in_the_archive(tmp_path, station, before, found):
    with Archive(tmp_path / "a.db", 1) as mine, Archive(tmp_path / "a.db", 1) as other:

        def stop():
            other.add("requests", 5, 300, station, "stop", "{}")
            other.commit()

        if before:
            stop()
        mine.add("requests", 5, 7, 1, "goto", "{}")
        assert mine.halt_after(7, 1) == ""
        mine.commit()
        assert mine.halt_after(7, 1) == ""
        if not before:
            stop()
        assert mine.halt_after(7, 1) == found


def test_a_session_without_a_stop_has_no_reason_to_end_anything():
    session = Session(KEYS, 1)
    goto = session.request("goto", GOTO, 0)
    assert session.requester.unheard_moves == [goto] and session.unsaid() == []
