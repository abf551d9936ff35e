"""Selection of frames and nodes of the DBC by the names that people type."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase

from protocol.generated.can_frames import FRAMES, NODES


class UnknownNameError(ValueError):
    """Name of no frame or node; one line, with the nearest name."""


def frames_of(patterns: Iterable[str], nodes: Iterable[str]) -> frozenset[int]:
    """The ids of the frames that match one of the patterns (all, if none is given) and come from one of the nodes.

    A pattern is a name in any case, with `*` as wildcard (WHEEL_*_FEEDBACK), or an id (0x181). Raises UnknownNameError
    for a pattern or node that matches nothing.
    """
    chosen: set[int] = set()
    for pattern in patterns:
        chosen |= _matching(pattern)
    senders = {_node(name) for name in nodes}
    return frozenset(
        can_id
        for can_id, layout in FRAMES.items()
        if (not patterns or can_id in chosen) and (not senders or layout.sender in senders)
    )


def _matching(pattern: str) -> set[int]:
    name = pattern.upper()
    if name.startswith("0X") and all(letter in "0123456789ABCDEF" for letter in name[2:]) and len(name) > 2:
        found = {int(name, 16)} & FRAMES.keys()
    else:
        found = {can_id for can_id, layout in FRAMES.items() if fnmatchcase(layout.name, name)}
    if not found:
        raise UnknownNameError(_unknown("frame", pattern, [layout.name for layout in FRAMES.values()]))
    return found


def _node(name: str) -> str:
    if name.upper() not in NODES:
        raise UnknownNameError(_unknown("node", name, list(NODES)))
    return name.upper()


def _unknown(kind: str, name: str, known: list[str]) -> str:
    from difflib import get_close_matches  # needed only after a typing error

    near = get_close_matches(name.upper(), known, 1)
    hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(known[:6])} ..."
    return f"rover.dbc has no {kind} {name}; {hint}"
