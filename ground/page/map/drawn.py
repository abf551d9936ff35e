"""Products drawn on the map, as plain trees for the browser: path, decision with its candidates, fences. Pure."""

from __future__ import annotations

from typing import Any

from protocol import WireError
from protocol.products.nsp import decode_nsp
from protocol.products.way import decode_way
from protocol.visible import visible

NAMES = ("way", "nsp", "fences")  # the map itself is apart: it is sent as pictures
_MOST_CANDIDATES, _MOST_FENCES, _MOST_CORNERS = 6, 32, 64
_KINDS = ("keep_out", "goal")


def tree_of(name: str, data: bytes, utc_ns: int) -> Any:
    """Return the tree of a product of NAMES. Raises WireError for bytes that are none, KeyError for another name."""
    return {"way": _way, "nsp": _choice, "fences": _fences}[name](data, utc_ns / 1e9)


def _way(data: bytes, utc_s: float) -> dict[str, Any]:
    way = decode_way(data)
    return {
        "path": way.path,
        "beyond": way.beyond,
        "reason": way.reason,
        "rule": way.rule,
        "length_m": way.length_m,
        "time_s": way.time_s,
        "looks": way.looks,
        "utc_s": utc_s,
    }


def _choice(data: bytes, utc_s: float) -> dict[str, Any]:
    """Return the newest decision with its candidates, the best first, each with its terms of Eq. 28."""
    told = decode_nsp(data)
    places = [
        {
            "x_m": one.x_m,
            "y_m": one.y_m,
            "yaw_rad": one.heading_rad,
            "score": one.score,
            "gain_term": one.gain_term,
            "distance_term": one.distance_term,
            "visibility": one.visibility,
            "cost_m": one.cost_m,
        }
        for one in told.places[:_MOST_CANDIDATES]
    ]
    return {
        "stop": told.stop,
        "kind": told.kind,
        "rule": told.rule,
        "reason": told.reason,
        "places": places,
        "end": list(told.end),
        "utc_s": utc_s,
    }


def _fences(data: bytes, utc_s: float) -> dict[str, Any]:
    """Return the fences of the answer to `fence list`: a line each, `NAME KIND X Y X Y ...` in m; or `none`."""
    found = []
    try:
        lines = [line.split() for line in data.decode().splitlines() if line.strip() not in ("", "none")]
        for name, kind, *numbers in lines[:_MOST_FENCES]:
            values = [float(number) for number in numbers[: 2 * _MOST_CORNERS]]
            if kind not in _KINDS or len(values) < 6 or len(values) % 2 or not all(abs(v) < 1e6 for v in values):
                raise ValueError(kind)
            found.append(
                {
                    "name": visible(name),
                    "kind": kind,
                    "corners": [list(pair) for pair in zip(values[::2], values[1::2])],
                }
            )
    except ValueError as error:
        raise WireError("product") from error
    return {"fences": found, "utc_s": utc_s}
