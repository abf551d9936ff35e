"""Text attributes of elevation files: unit of height, and projection as PROJJSON."""

from __future__ import annotations

from typing import Any

METRES = {
    "": 1.0, "m": 1.0, "metre": 1.0, "metres": 1.0, "meter": 1.0, "meters": 1.0, "km": 1e3, "kilometre": 1e3,
    "kilometer": 1e3, "cm": 1e-2, "mm": 1e-3, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048,
    "us survey foot": 1200 / 3937, "us-ft": 1200 / 3937, "ftus": 1200 / 3937,
}  # fmt: skip


class DemError(ValueError):
    """The file cannot become a map; the text is one line that continues after the file's name."""


def unit_m(unit: str | None) -> float:
    """Metres per unit of height; 1 if there is no unit. Raises DemError for an unknown unit."""
    try:
        return METRES[(unit or "").strip().lower()]
    except KeyError:
        raise DemError(f"has heights in {unit!r}, which is no known unit; give --unit, metres for each") from None


def projection_name(tree: Any) -> str:
    """Name of a projection; empty if it has none."""
    name = str(tree.get("name", ""))
    return "" if name.lower() in ("unknown", "unnamed") else name


def vertical_datum(tree: Any) -> str:
    """Name of the vertical part of a compound system; empty if there is none."""
    parts = tree.get("components", ())
    return str(parts[1]["name"]) if len(parts) > 1 else ""


def ellipsoid(tree: Any) -> str:
    """Ellipsoid of the projection, as PROJ text. Raises DemError if there is none."""
    shape = _find(tree, "ellipsoid")
    if shape is None:
        raise DemError("has a projection without an ellipsoid; give the right one by --crs")
    if "radius" in shape:
        return f"+R={_metres(shape['radius'])!r}"
    a = _metres(shape["semi_major_axis"])
    if "semi_minor_axis" in shape:
        return f"+a={a!r} +b={_metres(shape['semi_minor_axis'])!r}"
    return f"+a={a!r} +rf={float(shape['inverse_flattening'])!r}"


def _metres(value: Any) -> float:
    """Length in metres of a PROJJSON value: a number of metres, or a dict of value and unit."""
    if isinstance(value, dict):
        return float(value["value"]) * float(value["unit"]["conversion_factor"])
    return float(value)


def _find(tree: Any, key: str) -> Any:
    """Return the first value under `key` in a tree of dicts and lists, or None."""
    if isinstance(tree, dict) and key in tree:
        return tree[key]
    branches = tree.values() if isinstance(tree, dict) else tree if isinstance(tree, list) else ()
    return next((found for branch in branches if (found := _find(branch, key)) is not None), None)
