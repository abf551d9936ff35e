"""Emergency stop: its sender, how it is asserted, and the two steps that release it.

stop() -> EMERGENCY_STOP at once and at 10 Hz
reset(nonce) -> RESET_REQUEST step 1 at 10 Hz until every node with a heartbeat has answered: armed, or not stopped
             -> step 2 likewise, until none is armed any more: released
no answer of one of them within 3 s: the reset is given up, the nodes stay stopped
"""

from __future__ import annotations

from collections.abc import Callable

from protocol.can.guard import Every
from protocol.generated.can_codec import NodeState, StopReason

EMERGENCY_STOP, RESET_REQUEST = 0x010, 0x020
REPEAT_NS = 100_000_000
RESET_LIMIT_NS, LOST_NS = 3_000_000_000, 1_500_000_000


def reason_name(reason: int) -> str:
    """Name of a stop reason; the number itself if the DBC has no name for it."""
    return StopReason(reason).name if reason <= max(StopReason) else str(reason)


class Emergency:
    """State of the stop. called: (sender, reason, detail) of the first active stop, or None."""

    def __init__(self) -> None:
        self.called: tuple[str, int, int] | None = None
        self.heard_ns: dict[str, int] = {}  # node -> time of its last heartbeat
        self.states: dict[str, NodeState] = {}
        self._own: tuple[int, int] | None = None
        self._repeat = Every(REPEAT_NS)
        self._step = 0
        self._nonce = 0
        self._begun_ns: int | None = None
        self._answered: set[str] = set()

    @property
    def resetting(self) -> bool:
        """True while a reset is under way."""
        return self._step > 0

    def stop(self, reason: int, detail: int) -> None:
        """Start the computer's own stop; ends a reset."""
        self._own, self._step = (reason, detail), 0
        self.called = self.called or ("COMPUTER", reason, detail)
        self._repeat.now()

    def heard_stop(self, node: str, reason: int, detail: int) -> None:
        """Record another node's stop."""
        self.called = self.called or (node, reason, detail)

    def heartbeat(self, node: str, state: int, stamp_ns: int) -> None:
        """Record the state in a node's heartbeat; a state that the DBC does not have counts as FAULT."""
        known = NodeState(state) if state <= max(NodeState) else NodeState.FAULT
        self.heard_ns[node], self.states[node] = stamp_ns, known
        waiting = (NodeState.EMERGENCY_STOP,) if self._step == 1 else (NodeState.EMERGENCY_STOP, NodeState.RESET_ARMED)
        if self._begun_ns is not None and known not in waiting:
            self._answered.add(node)

    def reset(self, nonce: int) -> None:
        """Begin the two steps of a reset."""
        self._own, self._step, self._nonce, self._begun_ns = None, 1, nonce & 0xFFFF, None
        self._answered.clear()
        self._repeat.now()

    def send(self, now_ns: int, put: Callable[..., None]) -> None:
        """Send the frames that are due by `put(can_id, *values)`."""
        if self._own is not None and self._repeat.due(now_ns):
            put(EMERGENCY_STOP, *self._own)
        if self._step and self._advance(now_ns) and self._repeat.due(now_ns):
            put(RESET_REQUEST, self._nonce, self._step)

    def _advance(self, now_ns: int) -> bool:
        """Advance when the present step is answered; return whether a reset frame is to be sent."""
        if self._begun_ns is None:
            self._begun_ns = now_ns
            return True
        if all(node in self._answered for node, heard_ns in self.heard_ns.items() if now_ns - heard_ns < LOST_NS):
            self._answered.clear()
            self._repeat.now()
            if self._step == 2:
                self.called = None
            self._step = 2 if self._step == 1 else 0
        elif now_ns - self._begun_ns > RESET_LIMIT_NS:
            self._step = 0
        return self._step > 0
