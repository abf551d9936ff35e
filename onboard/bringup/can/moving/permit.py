"""Conditions that forbid a movement by hand: another computer, a latched stop, a node missing, foreign or at fault."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from onboard.devices.emergency import reason_name
from onboard.devices.nodes import Nodes
from onboard.records import Frame
from protocol.can.guard import Guard
from protocol.generated.can_codec import DBC_VERSION, NodeState
from protocol.generated.can_frames import FRAMES

MASTER = {can_id: layout.name for can_id, layout in FRAMES.items() if layout.sender == "COMPUTER"}
HEARTBEATS = {can_id: row.sender for can_id, row in FRAMES.items() if row.family == "NODE_HEARTBEAT"}


class Permit:
    """Monitor of the bus in parallel with `nodes`. needed: names of the nodes that must be present."""

    def __init__(self, nodes: Nodes, needed: Sequence[str]) -> None:
        self._nodes, self._needed = nodes, needed
        self._heartbeats, self._versions = Guard(), dict[str, int]()
        self._master = ""

    def hear(self, frames: Sequence[Frame]) -> None:
        """Process the frames of a tick."""
        for frame in frames:
            self._master = self._master or MASTER.get(frame.can_id, "")
            if frame.can_id in HEARTBEATS and (told := self._heartbeats.receive(frame)) is not None:
                self._versions[HEARTBEATS[frame.can_id]] = told.dbc_version

    def forbidden(self) -> Iterator[str]:
        """Reports of conditions that forbid a movement at any time."""
        if self._master:
            yield f"another computer commands this bus ({self._master} is on it): end that program first"
        if self._nodes.emergency is not None:
            node, reason, _ = self._nodes.emergency
            yield f"{node} asserts an EMERGENCY_STOP ({reason_name(reason)}): find out why, then `onboard can reset`"
        for name in self._needed:
            state = self._nodes.node_state(name)
            if state in (NodeState.EMERGENCY_STOP, NodeState.RESET_ARMED):
                yield f"{name} has an EMERGENCY_STOP latched: find out why, then `onboard can reset`"
            if state is NodeState.FAULT:
                yield f"{name} says FAULT: look at its status with `onboard can watch`"
            if self._versions.get(name, DBC_VERSION) != DBC_VERSION:
                yield f"{name} has version {self._versions[name]} of rover.dbc, this program {DBC_VERSION}: update one"

    def missing(self) -> Iterator[str]:
        """Reports of needed nodes that have not been received by now."""
        for name in self._needed:
            if self._nodes.node_state(name) is None:
                yield f"{name} is not heard on this bus; `onboard can info` says who is"
