"""Explanation product: one decision of the mission rule and the choice of the next sensing position. Exact.

    head | places, best first | counts by rule | texts: strategy, kind, rule, reason

A place is a row with all terms of Eq. 28; a count is the number of cells that one rule refused. If the strategy scores
nothing, the product has no places and no counts, only the decision with its reason.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from protocol import WireError

NSP_CODEC = "nsp-1"
MOST_PLACES, MOST_COUNTS, MOST_TEXT_BYTES = 16, 16, 2000
_MAGIC = b"NSP1"
_HEAD = struct.Struct("<4sHBBII11d")
_PLACE = struct.Struct("<2i9d")
_COUNT = struct.Struct("<IB")
_LENGTH = struct.Struct("<H")


class Candidate(NamedTuple):
    """One scored candidate. score = gain_term + distance_term, the terms of Eq. 28 with weights and signs.

    row, column: cell of the plan's grid.
    x_m, y_m, heading_rad: pose in the map frame.
    score: sum of the two terms.
    gain_term: term of the visibility gain.
    distance_term: term of the distance.
    visibility, new_cells: visibility and new cells from there, in the sector of the heading.
    cost_m: remaining cost to the goal.
    """

    row: int
    column: int
    x_m: float
    y_m: float
    heading_rad: float
    score: float
    gain_term: float
    distance_term: float
    visibility: float
    new_cells: float
    cost_m: float


class Explanation(NamedTuple):
    """A decision at a stop.

    stop: number of the stop.
    pose: x m, y m, yaw rad of the rover.
    goal_m: x, y of the goal.
    end: x m, y m, heading rad at the end of the chosen path.
    way_m: length of that path.
    weights: of gain and distance.
    strategy, kind, rule, reason: texts of the decision.
    scored: number of cells that are candidates.
    cells: number of cells of the map.
    places: the best and up to five next best; empty if the strategy scores nothing.
    rejected: number of cells that are no candidates, by the first rule that refused each.
    """

    stop: int
    pose: tuple[float, float, float]
    goal_m: tuple[float, float]
    end: tuple[float, float, float]
    way_m: float
    weights: tuple[float, float]
    strategy: str
    kind: str
    rule: str
    reason: str
    scored: int
    cells: int
    places: tuple[Candidate, ...]
    rejected: dict[str, int]


def encode_nsp(told: Explanation) -> bytes:
    """Encode the product. Raises ValueError if there are more places, counts or bytes of text than fit."""
    names = {name: name.encode() for name in told.rejected}
    texts = [text.encode() for text in (told.strategy, told.kind, told.rule, told.reason)]
    if len(told.places) > MOST_PLACES or len(told.rejected) > MOST_COUNTS:
        raise ValueError(f"{len(told.places)} places, {len(told.rejected)} counts: at most {MOST_PLACES} of each")
    if max(map(len, texts)) > MOST_TEXT_BYTES or max(map(len, names.values()), default=0) > 0xFF:
        raise ValueError(f"a text of more than {MOST_TEXT_BYTES} B, or a rule of more than 255")
    numbers = (*told.pose, *told.goal_m, *told.end, told.way_m, *told.weights)
    return b"".join(
        (
            _HEAD.pack(
                _MAGIC, told.stop & 0xFFFF, len(told.places), len(told.rejected), told.scored, told.cells, *numbers
            ),
            *(_PLACE.pack(*place) for place in told.places),
            *(_COUNT.pack(count, len(names[name])) + names[name] for name, count in told.rejected.items()),
            *(_LENGTH.pack(len(text)) + text for text in texts),
        )
    )


def decode_nsp(data: bytes) -> Explanation:
    """Decode the product. Raises WireError("product") if it is malformed."""
    try:
        magic, stop, places, counts, scored, cells, *numbers = _HEAD.unpack_from(data)
        if magic != _MAGIC or places > MOST_PLACES or counts > MOST_COUNTS:
            raise ValueError(f"{magic!r}, {places} places, {counts} counts")
        at = _HEAD.size
        found = tuple(Candidate(*_PLACE.unpack_from(data, at + n * _PLACE.size)) for n in range(places))
        rejected, at = _counts(data, at + places * _PLACE.size, counts)
        texts, at = _texts(data, at)
        if at != len(data):
            raise ValueError(f"{len(data)} B instead of {at}")
    except (struct.error, ValueError) as error:
        raise WireError("product", str(error)) from error
    x, y, yaw, goal_x, goal_y, end_x, end_y, end_yaw, way_m, gain, distance = numbers
    return Explanation(
        stop,
        (x, y, yaw),
        (goal_x, goal_y),
        (end_x, end_y, end_yaw),
        way_m,
        (gain, distance),
        *texts,
        scored,
        cells,
        found,
        rejected,
    )


def _counts(data: bytes, at: int, number: int) -> tuple[dict[str, int], int]:
    found: dict[str, int] = {}
    for _ in range(number):
        count, length = _COUNT.unpack_from(data, at)
        at += _COUNT.size + length
        found[_text(data, at - length, at)] = count
    return found, at


def _texts(data: bytes, at: int) -> tuple[tuple[str, str, str, str], int]:
    found = []
    for _ in range(4):
        (length,) = _LENGTH.unpack_from(data, at)
        if length > MOST_TEXT_BYTES:
            raise ValueError(f"a text of {length} B")
        at += _LENGTH.size + length
        found.append(_text(data, at - length, at))
    strategy, kind, rule, reason = found
    return (strategy, kind, rule, reason), at


def _text(data: bytes, start: int, end: int) -> str:
    if end > len(data):
        raise ValueError(f"a text that ends at {end} of {len(data)} B")
    return data[start:end].decode()
