"""Memory of a mission goes back between missions (`make soak` has the figures)."""

import gc
import weakref
from types import SimpleNamespace

import pytest

from onboard.config import load
from onboard.spare_time import TRIM_NS, SpareTime


class Heavy:
    """What a cycle keeps."""


@pytest.fixture
def no_collector():
    gc.disable()
    yield
    gc.enable()


def test_what_only_cycles_hold_is_freed_between_missions_and_not_in_one(no_collector):
    executive, clock = SimpleNamespace(in_mission=True), SimpleNamespace(ns=0)
    clock.now_ns = lambda: clock.ns
    rover = SimpleNamespace(executive=executive)
    spare = SpareTime(load(None, {"clock.mode": "lockstep"}), rover, clock, SimpleNamespace(), print)

    def garbage():
        held = Heavy()
        held.itself = held
        return weakref.ref(held)

    gone = garbage()
    for _ in range(100):
        clock.ns += TRIM_NS
        spare.use()
    assert gone() is not None
    executive.in_mission = False
    spare.use()
    assert gone() is not None, "what the mission's last jobs leave is not garbage yet"
    clock.ns += TRIM_NS
    spare.use()
    assert gone() is None
    later = garbage()
    clock.ns += TRIM_NS
    spare.use()
    assert later() is None
