"""Common behaviour of emulated nodes: receive through the guard, heartbeat, latched emergency stop, silence."""

from __future__ import annotations

from typing import Any

import numpy as np

from onboard.records import Frame
from protocol.can.guard import Every, Guard, Sender
from protocol.generated.can_codec import DBC_VERSION, TABLE, NodeState, StopReason

STOPS = {row.sender: can_id for can_id, row in TABLE.items() if row.name.startswith("EMERGENCY_STOP")}
HEARTBEATS = {row.sender: can_id for can_id, row in TABLE.items() if row.name.startswith("NODE_HEARTBEAT")}
RESET_REQUEST = 0x020
FIRMWARE = 1
HEARTBEAT_NS, STOP_NS = 500_000_000, 100_000_000
_BLOCK = 4096


class Noise:
    """Standard normal numbers of a generator, drawn in blocks."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._block: list[float] = []

    def next(self) -> float:
        """Next number."""
        if not self._block:
            self._block = self._rng.standard_normal(_BLOCK).tolist()
        return self._block.pop()


class Node:
    """One node.

    out: frames since the last `send`
    hears: CAN ids that it receives
    silent: fault: it neither sends nor receives, as if unplugged
    dbc_version: version in its heartbeat; a fault may change it
    """

    def __init__(self, name: str, hears: set[int], rng: np.random.Generator) -> None:
        self.name = name
        self.guard, self.sender = Guard(), Sender()
        self.out: list[Frame] = []
        self.silent = False
        self.dbc_version = DBC_VERSION
        self.latched = self.armed = False
        self.own_stop: tuple[int, int] | None = None
        self.hears = {RESET_REQUEST, *(i for sender, i in STOPS.items() if sender != name), *hears}
        self._nonce = -1
        self._beat = Every(HEARTBEAT_NS, int(rng.integers(50)) * 10_000_000)
        self._stop = Every(STOP_NS)

    @property
    def node_state(self) -> NodeState:
        """State in NODE_HEARTBEAT."""
        if self.latched:
            return NodeState.RESET_ARMED if self.armed else NodeState.EMERGENCY_STOP
        return NodeState.RUNNING

    def receive(self, frame: Frame, now_ns: int) -> None:
        """Receive one frame of the bus; a frame for other nodes or one that fails its checks changes nothing."""
        if self.silent or frame.can_id not in self.hears:
            return
        values = self.guard.receive(frame)
        if values is None:
            return
        if frame.can_id == RESET_REQUEST:
            self._reset(values.nonce, values.step)
        elif frame.can_id < RESET_REQUEST:
            self._latch()
        else:
            self.order(frame.can_id, values, now_ns)

    def send(self) -> list[Frame]:
        """Frames since the last call."""
        frames, self.out = self.out, []
        return [] if self.silent else frames

    def assert_stop(self, reason: StopReason, detail: int = 0) -> None:
        """Send this node's emergency stop at 10 Hz until it is reset."""
        self.own_stop = (int(reason), detail)
        self._latch()
        self._stop.now()

    def beat(self, now_ns: int) -> None:
        """Send NODE_HEARTBEAT and the own EMERGENCY_STOP when they are due; call at the end of each step."""
        if self.own_stop is not None and self._stop.due(now_ns):
            can_id = STOPS[self.name]
            self.out.append(Frame(can_id, self.sender.encode(can_id, *self.own_stop), now_ns))
        if self._beat.due(now_ns):
            can_id = HEARTBEATS[self.name]
            uptime_s = now_ns // 1_000_000_000 & 0xFFFF
            data = self.sender.encode(can_id, self.node_state, uptime_s, 0, 0, FIRMWARE, self.dbc_version)
            self.out.append(Frame(can_id, data, now_ns))

    def order(self, can_id: int, values: Any, now_ns: int) -> None:
        """Handle a valid frame for this kind of node."""

    def stopped(self) -> None:
        """Handle the latching of an emergency stop."""

    def _latch(self) -> None:
        if not self.latched:
            self.latched = True
            self.stopped()
        self.armed = False

    def _reset(self, nonce: int, step: int) -> None:
        """Two reset steps with the same nonce release the stop; each is answered by an extra heartbeat."""
        if step == 1:
            self.armed, self._nonce = self.latched, nonce
        elif self.latched and self.armed and nonce == self._nonce:
            self.latched = self.armed = False
            self.own_stop = None
        self._beat.now()
