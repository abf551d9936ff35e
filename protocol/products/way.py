"""Way product: the rover's answer to a goto, one JSON object. Its encoder is `Prediction.to_json` on board."""

from __future__ import annotations

import json
import math
from typing import Any, NamedTuple

from protocol import WireError
from protocol.visible import visible

_MOST_BYTES = 1_000_000


class WayProduct(NamedTuple):
    """Predicted path of a goto.

    station, request_id: the goto; 0: none.
    kind, rule, reason: texts of the decision.
    length_m, time_s: None if there is no path.
    looks: number of scans on the path.
    path: x m, y m, heading rad of its corners in the map frame.
    beyond: x m, y m of the straight rest to the goal.
    """

    station: int
    request_id: int
    kind: str
    rule: str
    reason: str
    length_m: float | None
    time_s: float | None
    looks: int
    path: tuple[tuple[float, ...], ...]
    beyond: tuple[tuple[float, ...], ...]


def decode_way(data: bytes) -> WayProduct:
    """Decode the product; unknown keys are ignored. Raises WireError("product") if it is malformed."""
    if len(data) > _MOST_BYTES:
        raise WireError("product", f"way: {len(data)} B, at most {_MOST_BYTES}")
    try:
        return _way(json.loads(data))
    except KeyError as error:
        raise WireError("product", f"way: {error.args[0]} is missing") from error
    except RecursionError as error:
        raise WireError("product", "way: nested too deep") from error
    except (ValueError, OverflowError) as error:
        raise WireError("product", f"way: {visible(str(error))}") from error


def _way(tree: Any) -> WayProduct:
    if not isinstance(tree, dict):
        raise ValueError("no object")
    length_m = None if tree["length_m"] is None else _number(tree, "length_m")
    time_s = None if length_m is None and tree["time_s"] is None else _number(tree, "time_s")
    return WayProduct(
        _count(tree, "station") if "station" in tree else 0,
        _count(tree, "request_id") if "request_id" in tree else 0,
        _word(tree, "kind"),
        _word(tree, "rule"),
        _word(tree, "reason"),
        length_m,
        time_s,
        _count(tree, "looks"),
        _places(tree, "path", 3),
        _places(tree, "beyond", 2),
    )


def _word(tree: dict[str, Any], key: str) -> str:
    if not isinstance(tree[key], str):
        raise ValueError(f"{key} is no text")
    return visible(tree[key])


def _number(tree: dict[str, Any], key: str) -> float:
    return _finite(tree[key], key)


def _finite(value: Any, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"{key} is no number")
    return float(value)


def _count(tree: dict[str, Any], key: str) -> int:
    value = tree[key]
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 1 << 32:
        raise ValueError(f"{key} is no count")
    return value


def _places(tree: dict[str, Any], key: str, size: int) -> tuple[tuple[float, ...], ...]:
    rows = tree[key]
    if not isinstance(rows, list) or not all(isinstance(row, list) and len(row) == size for row in rows):
        raise ValueError(f"{key} is no list of places")
    return tuple(tuple(_finite(value, key) for value in row) for row in rows)
