"""What may not be done is answered with its reason and changes nothing: for every command and mode, and for any bytes.

"Nothing" is seen against a twin that was not told: state, frames, events and saves of both are the same.
"""

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from onboard.records import LinkMessage
from protocol import WireError
from protocol.link.datagrams import DatagramKind
from protocol.link.transactions import Code, RequestState
from protocol.tables import commands
from protocol.tables.modes import Mode
from tests.onboard.core_bench import STATION, CoreBench, first_map

INTO = {
    Mode.STANDBY: (), Mode.SAFE: ("safe",), Mode.ESTOP: ("emergency_stop",), Mode.AUTONOMOUS: ("goto 12 3",),
    Mode.TELEOP: ("drive 0.1 0 0 20 1.5",), Mode.SEQUENCE: ("sequence_upload survey 1 after 60", "sequence_run survey"),
}  # fmt: skip


class Pair:
    """A rover that is told, and its twin."""

    def __init__(self, memory, mode):
        self.told, self.twin = (CoreBench(memory=memory) for _ in range(2))
        for rover in (self.told, self.twin):
            rover.settle()
            for line in INTO[mode]:
                name, arguments = commands.parse(line.split())
                rover.order(name, **arguments)
                rover.run(0.2)
            assert rover.mode is mode

    def hear(self, payload):
        """A telecommand's payload reaches the one; what it reports of the request, within two ticks."""
        request_id = commands.request_id_of(payload)
        self.told.hear(LinkMessage(self.told.now_ns, True, "ok", STATION, DatagramKind.TELECOMMAND, payload))
        for _ in range(2):
            told, twin = self.told.step(), self.twin.step()
            assert state(self.told) == state(self.twin)
            events = tuple(event for event in told.events if event.name != "LINK_REFUSED")
            assert (told.can_frames, told.lidar_bytes, events, told.saves, told.jobs) == (
                twin.can_frames,
                twin.lidar_bytes,
                twin.events,
                twin.saves,
                twin.jobs,
            )
        return {report for _, report in self.told.reports if report.request_id == request_id}


def state(bench):
    """What the digest of the core's state is made of, but for the link's own books."""
    rover = bench.rover
    executive = rover.executive
    parts = (
        rover.localisation,
        rover.watch,
        rover.devices,
        rover.lidar,
        rover.nodes,
        rover.parameters,
        rover.fences,
        rover.keeping,
        executive.masks,
        executive.sequencer,
    )
    return executive.mode, executive.phase, executive.active, *(part.digest_items() for part in parts)


@pytest.fixture(scope="module")
def known():
    return first_map()


@pytest.fixture(scope="module")
def standing(known):
    return Pair(known, Mode.STANDBY)


def telecommand(row, request_id):
    """The row's own example, as bytes."""
    name, arguments = commands.parse(f"{row.typed} {row.example}".split())
    return commands.encode(commands.Telecommand(request_id, 0, 0, name, arguments))


@pytest.mark.parametrize("mode", INTO)
def test_a_command_that_the_mode_does_not_allow_is_refused_with_what_it_needs_and_changes_nothing(known, mode):
    pair = Pair(known, mode)
    forbidden = [row for row in commands.TABLE if mode not in row.modes]
    assert forbidden
    for number, row in enumerate(forbidden, 100):
        (report,) = pair.hear(telecommand(row, number))
        assert (report.state, report.code) == (RequestState.FAILED, Code.MODE)
        assert report.text.startswith(f"{row.typed} is refused in {mode.name}: it needs {row.modes[0].name}")


_ids = st.integers(1000, 2**32 - 1)
_rows = st.sampled_from(commands.TABLE)


@st.composite
def damaged(draw):
    """A telecommand of the table that was cut, lengthened, or had bytes behind its request id changed."""
    whole = telecommand(draw(_rows), draw(_ids))
    kind = draw(st.sampled_from(("cut", "longer", "changed")))
    if kind == "cut":
        return whole[: draw(st.integers(4, len(whole) - 1))]
    if kind == "longer":
        return whole + draw(st.binary(min_size=1, max_size=1100 - len(whole)))
    bytes_ = bytearray(whole)
    for at in draw(st.lists(st.integers(28, len(whole) - 1), min_size=1, max_size=4)):
        bytes_[at] = draw(st.integers(0, 255))
    return bytes(bytes_)


def is_valid(payload):
    """Whether these bytes are a command all the same."""
    try:
        asked = commands.decode(payload)
        commands.check(asked.name, asked.arguments)
    except (WireError, ValueError):
        return False
    return True


@given(damaged())
@settings(max_examples=300, deadline=None, derandomize=True)
def test_damaged_cut_and_oversized_commands_are_answered_with_a_reason_and_change_nothing(standing, payload):
    assume(not is_valid(payload))
    reports = standing.hear(payload)
    assert reports and all(report.state is RequestState.FAILED and report.text for report in reports)
    assert {report.code for report in reports} <= {Code.UNKNOWN_COMMAND, Code.RANGE, Code.REUSED_ID, Code.FORGOTTEN_ID}


@pytest.mark.parametrize("payload", [b"", b"\x07", b"\x07\x00\x00"])
def test_bytes_without_a_request_id_cannot_be_answered_but_are_counted(standing, payload):
    def asked():
        return {report.request_id for _, report in standing.told.reports}

    answered, refused = asked(), standing.told.rover.downlink.refused_count
    standing.hear(payload)
    assert asked() == answered
    assert standing.told.rover.downlink.refused_count == refused + 1
