"""Monitors of the CAN bus: condition, limit and event text of each of its rows of protocol.tables.faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from onboard.devices.nodes import Nodes
from protocol.generated.can_codec import DBC_VERSION

MONITORS: Mapping[str, Callable[[Nodes], bool]] = {
    "CAN_BUS_OFF": lambda nodes: not nodes.bus_well,
    "CAN_BABBLE": lambda nodes: bool(nodes.watch.babbling) or nodes.watch.overloaded,
    "CAN_CORRUPT": lambda nodes: nodes.watch.corrupt,
    "NODE_FOREIGN": lambda nodes: bool(nodes.watch.foreign),
    "NODE_TWICE": lambda nodes: bool(nodes.watch.twins),
}

LIMITS: Mapping[str, Callable[[Nodes], bool]] = {
    "CAN_BUS_OFF": lambda nodes: nodes.bus.used_up,
    "CAN_BABBLE": lambda nodes: nodes.watch.overloaded,
    "CAN_CORRUPT": lambda nodes: nodes.watch.rotten,
}

_NAMED = 8  # CAN ids listed in an event's text, which is short


def _ids(nodes: Nodes) -> str:
    ids = sorted(nodes.watch.babbling)
    more = f" and {len(ids) - _NAMED} more" if len(ids) > _NAMED else ""
    named = ", ".join(f"{can_id:#05x}" for can_id in ids[:_NAMED]) + more
    full = "the bus is over 80 % full" if nodes.watch.overloaded else ""
    return "; ".join(text for text in (f"far above their rates: {named}" * bool(ids), full) if text)


def _counts(nodes: Nodes) -> str:
    counts = nodes.guard_counts
    return (
        f"since the start {counts.crc} checksums, {counts.lost} lost, {counts.repeated} repeated, "
        f"{counts.out_of_range + counts.length} malformed, {nodes.from_future} from the future"
    )


def _versions(nodes: Nodes) -> str:
    told = ", ".join(f"{node} {version}" for node, version in sorted(nodes.watch.foreign.items()))
    return f"DBC version of {told}; ours is {DBC_VERSION}"


WORDS: Mapping[str, Callable[[Nodes], str]] = {
    "CAN_BUS_OFF": lambda nodes: nodes.bus.words,
    "CAN_BABBLE": _ids,
    "CAN_CORRUPT": _counts,
    "NODE_FOREIGN": _versions,
    "NODE_TWICE": lambda nodes: "two alive counters from " + ", ".join(nodes.watch.twins),
}
