"""Memory of a mission goes back when the mission has ended (`make soak` has the figures)."""

import gc
import weakref
from types import SimpleNamespace

import pytest

from onboard.beside import Spare
from onboard.config import load


class Heavy:
    """What a cycle keeps."""


@pytest.fixture
def no_collector():
    gc.disable()
    yield
    gc.enable()


def test_what_only_cycles_hold_is_freed_when_a_mission_has_ended_and_not_before(no_collector):
    executive = SimpleNamespace(in_mission=True)
    rover, clock = SimpleNamespace(executive=executive), SimpleNamespace(now_ns=lambda: 0)
    spare = Spare(load(None, {"clock.mode": "lockstep"}), rover, clock, SimpleNamespace(), print)
    held = Heavy()
    held.itself, gone = held, weakref.ref(held)
    del held
    spare.use()
    assert gone() is not None
    executive.in_mission = False
    spare.use()
    assert gone() is None
