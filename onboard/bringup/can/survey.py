"""Survey of the nodes on a bus and their state: the report of `onboard can info` after two seconds of listening.

Two nodes with one id: each counts its own frames, so their counters interleave. Two tracks are stored for an id; a
frame continues the track whose next number it carries, or restarts the older one. One sender, also one that loses
frames, seldom continues the older track; two senders do so with nearly every frame, or repeat each other's numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from onboard.bringup.can.bits import wire_bits
from onboard.bringup.can.candump import ReceivedFrame
from onboard.bringup.can.decode import DecodedFrame, Decoder, SummaryLine, named
from onboard.records import Frame
from protocol.generated.can_codec import DBC_VERSION, NodeState
from protocol.generated.can_frames import BITS_PER_S, FRAMES, Layout

NEEDED = tuple(layout.sender for layout in FRAMES.values() if layout.family == "NODE_HEARTBEAT")
SENDERS = ("COMPUTER", *NEEDED, "GUARD")
RATE_TOLERANCE, LEAST_FRAMES, TWICE_RATIO, LOAD_LIMIT = 0.1, 8, 0.4, 0.40
_STOPPED = {NodeState.EMERGENCY_STOP: "is stopped", NodeState.RESET_ARMED: "is stopped, its reset begun"}


@dataclass(slots=True)
class _Tracks:
    """The alive counters of one id as two sequences."""

    newest: list[int] = field(default_factory=lambda: [-1, -1])
    on: int = 0
    changes: int = 0
    frames: int = 0

    def note(self, counter: int) -> None:
        """Process the next frame's counter."""
        self.frames += 1
        if counter != (self.newest[self.on] + 1) & 15:
            self.on = 1 - self.on
            self.changes += counter == (self.newest[self.on] + 1) & 15
        self.newest[self.on] = counter


class NodeReport(NamedTuple):
    """One node.

    name: its name.
    frames: number of frames it sent.
    beat: the values of its newest heartbeat, None without one.
    """

    name: str
    frames: int
    beat: dict[str, Any] | None


class Report(NamedTuple):
    """Result of a survey.

    span_s: duration of the listening.
    nodes: state of each node.
    tallies: tally of each id of the DBC.
    load_ratio: share of the bus in use.
    error_frames: number of error frames.
    others: number of frames of each kind that are not in the DBC.
    findings: one line for each problem, with what to do.
    """

    span_s: float
    nodes: list[NodeReport]
    tallies: list[SummaryLine]
    load_ratio: float
    error_frames: int
    others: dict[str, int]
    findings: list[str]

    def as_dict(self) -> dict[str, object]:
        """Report for programs."""
        return {
            **self._asdict(),
            "nodes": [node._asdict() for node in self.nodes],
            "tallies": {t.name: {"rate_hz": t.rate_hz, "frames": t.frames, **t.counts._asdict()} for t in self.tallies},
        }


class Survey:
    """Collector of all frames on the bus; call `report` at any time."""

    def __init__(self) -> None:
        self._decoder = Decoder()
        self._tracks: dict[int, _Tracks] = {}
        self._sent: dict[str, int] = {}
        self._beats: dict[str, dict[str, Any]] = {}
        self._bits = 0

    def receive(self, frames: Iterable[Frame]) -> None:
        """Process frames with the times of their arrival."""
        for frame in frames:
            self._bits += wire_bits(frame.can_id, frame.data)
            seen = self._decoder.receive(ReceivedFrame(frame.stamp_ns, frame.can_id, frame.data))
            layout = FRAMES.get(frame.can_id)
            if layout is not None:
                self._note(layout, seen)

    def report(self, span_s: float, error_frames: int) -> Report:
        """Report on the frames so far.

        span_s: duration of the listening.
        error_frames: of the controller, while listening.
        """
        tallies = self._decoder.tallies()
        nodes = [NodeReport(name, self._sent.get(name, 0), self._beats.get(name)) for name in SENDERS]
        load_ratio = self._bits / BITS_PER_S / span_s
        others = dict(self._decoder.others)
        found = list(_silence(error_frames, bool(self._sent or others)))
        if self._sent:
            twice = self._twice(tallies)
            once = {name: count for name, count in self._sent.items() if name not in twice}
            found += [*_of_nodes(nodes), *_of_twins(twice), *_of_rates(tallies, once), *_of_guard(tallies)]
        found += [f"{name}, {count} frames: another device on this bus?" for name, count in others.items()]
        if load_ratio > LOAD_LIMIT:
            found.append(f"the bus is loaded by {load_ratio:.0%}; `onboard can load` says what is normal")
        return Report(span_s, nodes, tallies, load_ratio, error_frames, others, found)

    def _note(self, layout: Layout, seen: DecodedFrame) -> None:
        self._sent[layout.sender] = self._sent.get(layout.sender, 0) + 1
        if len(seen.data) == 8 and not {"crc", "length"} & set(seen.problems):
            self._tracks.setdefault(layout.can_id, _Tracks()).note(seen.data[6] >> 4)
        if seen.values is not None and layout.family in ("NODE_HEARTBEAT", "COMPUTER_HEARTBEAT"):
            self._beats[layout.sender] = named(layout.can_id, seen.values)

    def _twice(self, tallies: list[SummaryLine]) -> dict[str, list[int]]:
        """Senders that seem to be two nodes, with the ids that show it."""
        found: dict[str, list[int]] = {}
        for tally in tallies:
            tracks = self._tracks.get(tally.can_id, _Tracks())
            odd = max(tracks.changes, tally.counts.repeated)
            if tracks.frames >= LEAST_FRAMES and odd > TWICE_RATIO * tracks.frames:
                found.setdefault(FRAMES[tally.can_id].sender, []).append(tally.can_id)
        return found


def _silence(error_frames: int, heard: bool) -> Iterator[str]:
    if not heard and error_frames:
        yield (
            f"only error frames, {error_frames} of them: another bit rate (right are {BITS_PER_S // 1000} kbit/s), "
            "CAN_H and CAN_L exchanged, or no second node to acknowledge; try `ip -details link show`"
        )
    elif not heard:
        yield (
            "nothing at all is heard: are the nodes powered, is the bus plugged in and terminated (60 ohm between "
            "CAN_H and CAN_L), is the interface up? A wrong bit rate that nobody else speaks on is silent too"
        )
    elif error_frames:
        yield f"{error_frames} error frames of the controller: cable, connectors, termination (60 ohm between wires)"


def _of_nodes(nodes: list[NodeReport]) -> Iterator[str]:
    for name, frames, beat in nodes:
        if name in NEEDED and not frames:
            yield f"{name} is not heard: no power, no cable, or it was given another number"
        elif name in NEEDED and beat is None:
            yield f"{name} sends no heartbeat: its firmware and DBC version are unknown"
        elif beat is not None and name != "COMPUTER":
            yield from _of_beat(name, beat)


def _of_beat(name: str, beat: dict[str, Any]) -> Iterator[str]:
    if beat["dbc_version"] != DBC_VERSION:
        yield (
            f"{name} was built with version {beat['dbc_version']} of rover.dbc, this program with {DBC_VERSION}: "
            "its values may mean something else; do not drive before both are the same"
        )
    for state, words in _STOPPED.items():
        if beat["state"] == state.name:
            yield f"{name} {words}: an EMERGENCY_STOP is latched; find out why, then `onboard can reset`"
    if beat["state"] == NodeState.FAULT.name:
        yield f"{name} says FAULT: see the fault bits of its status frame"
    if beat["tx_errors"] or beat["rx_errors"]:
        yield (
            f"{name} counts {beat['tx_errors']} transmit and {beat['rx_errors']} receive errors: "
            "cable, connector or termination near it"
        )


def _of_twins(twice: dict[str, list[int]]) -> Iterator[str]:
    for name, ids in twice.items():
        yield (
            f"two nodes seem to be {name}: alive counters interleave on {', '.join(f'{i:#05x}' for i in ids)}; "
            "unplug one and see whether it still comes, then give the other its own number"
        )


def _of_rates(tallies: list[SummaryLine], sent: dict[str, int]) -> Iterator[str]:
    rates = {tally.name: tally.rate_hz for tally in tallies}
    for layout in FRAMES.values():
        if layout.event or layout.sender not in sent or layout.name == "TILT_COMMAND":
            continue
        slow_hz = 1000.0 / layout.cycle_ms
        fast_hz = 1000.0 / layout.fast_ms if layout.fast_ms else slow_hz
        rate_hz = rates.get(layout.name)
        if layout.name not in rates:
            yield f"{layout.name} is not heard, though {layout.sender} is there: {slow_hz:g} a second are due"
        elif rate_hz is not None and not slow_hz * (1 - RATE_TOLERANCE) <= rate_hz <= fast_hz * (1 + RATE_TOLERANCE):
            yield f"{layout.name} comes {rate_hz:.1f} times a second, {slow_hz:g} are due"


def _of_guard(tallies: list[SummaryLine]) -> Iterator[str]:
    for _, name, frames, _, counts in tallies:
        if counts.crc:
            yield f"{name}: {counts.crc} of {frames} frames fail their CRC: another layout in the node, or bit errors"
        if counts.out_of_range:
            yield f"{name}: {counts.out_of_range} of {frames} frames hold a value out of its range"
        if counts.length:
            yield f"{name}: {counts.length} of {frames} frames are not 8 bytes long: another device has this id?"
        if counts.lost:
            yield f"{name}: {counts.lost} frames never came, by the alive counter"
