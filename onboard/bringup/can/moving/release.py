"""Release of a latched EMERGENCY_STOP without the flight program: the state machine of `onboard can reset`.

    LISTENING --1.2 s, no other computer--> READY --go--> RESETTING --all have answered, or 3 s--> DONE

As in flight: RESET_REQUEST with one nonce, step 2 when every node with a heartbeat has answered step 1. Meanwhile the
wheels are commanded OFF, without enable.
"""

from __future__ import annotations

from collections.abc import Sequence

from onboard.bringup.can.moving.jog import LISTEN_NS, Phase
from onboard.bringup.can.moving.permit import MASTER
from onboard.config import Can, Rover
from onboard.devices.nodes import NODES, Nodes
from onboard.records import Frame
from protocol.generated.can_codec import NodeState
from protocol.tables.modes import Mode

STOPPED = (NodeState.EMERGENCY_STOP, NodeState.RESET_ARMED)


class Release:
    """State machine of a release, run by `tick`.

    problem: one line with the reason of a refusal or a failure, empty without one.
    """

    def __init__(self, nonce: int, rover: Rover, can: Can) -> None:
        self.nodes = Nodes(rover, can)
        self.nodes.enabled = False
        self.phase = Phase.LISTENING
        self.problem = ""
        self._nonce = nonce
        self._began_ns: int | None = None

    @property
    def stopped(self) -> list[str]:
        """The nodes that report an EMERGENCY_STOP."""
        return [name for name in NODES if self.nodes.node_state(name) in STOPPED]

    def go(self) -> None:
        """Go from READY to the two steps; the operator has agreed."""
        if self.phase is Phase.READY:
            self.phase = Phase.MOVING
            self.nodes.reset(self._nonce)

    def tick(self, frames: Sequence[Frame], now_ns: int) -> tuple[Frame, ...]:
        """Process the received frames and return the frames to send; call it every 10 ms."""
        self._began_ns = now_ns if self._began_ns is None else self._began_ns
        self.nodes.receive(frames, now_ns)
        master = next((MASTER[frame.can_id] for frame in frames if frame.can_id in MASTER), "")
        if master:
            self._end(f"another computer commands this bus ({master} is on it): reset by its own means")
        elif self.phase is Phase.LISTENING and now_ns - self._began_ns >= LISTEN_NS:
            self._end("" if self.stopped else "no node is stopped: there is nothing to release")
            self.phase = Phase.DONE if self.problem else Phase.READY
        elif self.phase is Phase.MOVING and not self.nodes.resetting:
            self._end(f"{', '.join(self.stopped)} did not let go: does the cause still hold?" if self.stopped else "")
            self.phase = Phase.DONE
        return self.nodes.send(now_ns, Mode.STANDBY) if self.phase is Phase.MOVING else ()

    def _end(self, problem: str) -> None:
        if problem:
            self.problem, self.phase = problem, Phase.DONE
