"""TABLE of the faults of the CAN bus: each row changes hil.devices.can.wire and restores it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from hil.devices.can.wire import CanWire
from onboard.records import BusTrouble
from protocol.generated.can_codec import TABLE

NODES = tuple(row.sender for row in TABLE.values() if row.name.startswith("NODE_HEARTBEAT"))
AHEAD_NS = 500_000_000


class CanCause(NamedTuple):
    """One fault of the bus. begin and heal take the wire and the scenario's target.

    targets: the first and the last that it may have; empty: it needs none
    """

    means: str
    begin: Callable[[CanWire, int], None]
    heal: Callable[[CanWire, int], None]
    targets: tuple[int, ...] = ()


def _set(name: str, value: Callable[[int], object], normal: object) -> tuple[Callable[[CanWire, int], None], ...]:
    """Begin and heal functions that set one attribute."""
    return (lambda wire, target: setattr(wire, name, value(target))), (lambda wire, _: setattr(wire, name, normal))


def _node(target: int) -> str:
    """Name of a node by the number of its heartbeat: 1 to 4 the wheels, 5 tilt, 6 IMU, 7 power; 0: the power node."""
    return NODES[target - 1]


CAUSES = {
    "can_bus_off": CanCause(
        "the computer's controller leaves the bus; healed: it restarts",
        lambda wire, _: wire.error(BusTrouble.BUS_OFF), lambda wire, _: wire.error(BusTrouble.RESTARTED)),
    "can_error_passive": CanCause(
        "the controller tells of over 127 errors; frames pass",
        lambda wire, _: wire.error(BusTrouble.PASSIVE), lambda wire, _: wire.error(BusTrouble.ACTIVE)),
    "can_unplugged": CanCause(
        "the computer's CAN port is closed and cannot be opened",
        lambda wire, _: wire.unplug(), lambda wire, _: wire.plug()),
    "can_hung_up": CanCause(
        "the computer's CAN port is closed once and can be opened again",
        lambda wire, _: wire.hang_up(), lambda wire, _: None),
    "can_corrupt": CanCause(
        "one bit is wrong in `target` percent of the frames to the computer",
        *_set("corrupt_ratio", lambda target: target / 100.0, 0.0), (1, 100)),
    "can_lose": CanCause(
        "`target` percent of the frames to the computer are lost",
        *_set("lost_ratio", lambda target: target / 100.0, 0.0), (1, 100)),
    "can_babble": CanCause(
        "the id `target` is sent 1000 times a second more",
        *_set("babble_id", lambda target: target, None), (0, 0x7FF)),
    "can_future": CanCause(
        "frames to the computer are stamped half a second ahead", *_set("ahead_ns", lambda _: AHEAD_NS, 0)),
    "node_foreign": CanCause(
        "a node's heartbeat carries another DBC version (target 1 to 4: wheels, 5 tilt, 6 IMU, 7 power)",
        *_set("foreign", _node, ""), (0, len(NODES))),
    "node_twice": CanCause(
        "a second node sends under the ids of node `target` (as node_foreign)", *_set("twin", _node, ""),
        (0, len(NODES))),
}  # fmt: skip
