"""The transition table against a second one, written by mode instead of by row: what leads where."""

import pytest

from protocol.tables.modes import TRANSITIONS, Mode, next_mode

ANYWHERE = "safe:SAFE fault:SAFE emergency_stop:ESTOP "
WANTED = {
    Mode.BOOT: ANYWHERE + "booted:STANDBY",
    Mode.STANDBY: ANYWHERE + "stop:STANDBY goto:AUTONOMOUS mission:AUTONOMOUS return:AUTONOMOUS scan:AUTONOMOUS "
    "turn:TELEOP drive:TELEOP sequence_run:SEQUENCE",
    Mode.AUTONOMOUS: ANYWHERE + "goto:AUTONOMOUS mission:AUTONOMOUS return:AUTONOMOUS returned:STANDBY scanned:STANDBY "
    "arrived:STANDBY failed:STANDBY stop:STANDBY link_lost:STANDBY",
    Mode.TELEOP: ANYWHERE + "turn:TELEOP drive:TELEOP moved:STANDBY failed:STANDBY stop:STANDBY",
    Mode.SEQUENCE: ANYWHERE + "sequence_abort:STANDBY ended:STANDBY stop:STANDBY link_lost:STANDBY",
    Mode.SAFE: "resume:STANDBY emergency_stop:ESTOP",
    Mode.ESTOP: "reset:STANDBY",
}
LEADS = {
    (mode, event): Mode[after]
    for mode, words in WANTED.items() for event, _, after in (word.partition(":") for word in words.split())
}  # fmt: skip
EVENTS = sorted({event for _, event in LEADS})


@pytest.mark.parametrize("mode", list(Mode))
@pytest.mark.parametrize("event", EVENTS)
def test_an_event_leads_where_it_is_wanted_to_and_nowhere_else(mode, event):
    assert next_mode(mode, event) is LEADS.get((mode, event))


def test_no_other_event_leads_anywhere():
    assert {row.event for row in TRANSITIONS} == set(EVENTS)
