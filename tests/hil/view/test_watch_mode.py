"""The 3D page's headline: mode and phase as the flight program has reported them, and where the rover truly is."""

import math

import numpy as np
import pytest

from hil.view.browser.panel import place, status
from hil.view.story import Instant, Moment, StoryEvent, _mode

pytestmark = pytest.mark.tool

AT = Moment(
    1.0,
    (3.0, 4.5, 0.2),
    (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4)),
    (0.0, 0.0),
    (0.0,) * 4,
    (0.0,) * 4,
    "",
)
NO_WAY = np.empty((0, 3))


def told(name, text):
    return StoryEvent(1.0, "info", name, text)


def test_mode_and_phase_are_those_of_the_events_so_far():
    assert _mode([]) == ""
    assert (
        _mode([told("MODE", "STANDBY -> AUTONOMOUS: goal"), told("PHASE", "DRIVING at stop 1")]) == "AUTONOMOUS driving"
    )


def test_the_headline_has_mode_place_and_heading():
    words = status(Instant(1.0, AT, (), None, 0, (), (), NO_WAY, NO_WAY, mode="AUTONOMOUS driving"), 9.0, 0.0)
    assert "**AUTONOMOUS driving**" in words
    assert place(AT) in words and "x 3.00 m, y 4.50 m, heading 90°" in place(AT)
