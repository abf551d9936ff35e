"""Report of an estimate: a table for people, an object for programs, the TOML to add to the configuration."""

from __future__ import annotations

import math

from onboard.bringup.calibrate.estimate import Estimate, Value
from onboard.bringup.lidar.lag_report import LagReport


def lines(found: Estimate, lag: LagReport | str) -> list[str]:
    """Each value before, after and its sigma, in mm or degrees; then the scanner's lag and unobserved directions."""
    width = max(len(value.key) for value in found.values)
    made = [f"{'rover.':{width}}  {'before':>9}  {'after':>9}  {'1 sigma':>8}"]
    for value in found.values:
        before, after, sigma, unit = _for_people(value)
        note = "" if value.observed else "  not seen by this drive alone"
        made.append(f"{value.key:{width}}  {before:9.3f}  {after:9.3f}  {sigma:8.3f} {unit}{note}")
    made.append(f"{found.pairs} alignments of scans, {found.odd_pairs} left out as odd; misfit {found.misfit:.2f}")
    made += [f"scanner's lag not seen: {lag}"] if isinstance(lag, str) else lag.lines()
    if found.unobserved:
        made.append("not seen: the drive fits any value of these alike, what the drawing says is kept:")
        made += [f"  {words}" for words in found.unobserved]
    return made


def as_dict(found: Estimate, lag: LagReport | str) -> dict[str, object]:
    """The whole estimate in SI units.

    lag: null if unknown.
    """
    return {
        "values": {value.key: value._asdict() for value in found.values},
        "unobserved": list(found.unobserved),
        "misfit": found.misfit,
        "grip": found.grip,
        "pairs": found.pairs,
        "odd_pairs": found.odd_pairs,
        "lag": None if isinstance(lag, str) else lag.as_dict(),
    }


def toml(found: Estimate, lag: LagReport | str, source: str) -> str:
    """The tables [rover] with the calibrated keys and, if the lag is known, [lidar]."""
    rows = [
        f"{value.key} = {value.after:.6f}  # 1 sigma {value.sigma:.6f}, before {value.before:.6f}"
        + ("" if value.observed else "; not seen by the drive alone")
        for value in found.values
    ]
    seen = "" if isinstance(lag, str) else "\n" + lag.toml()
    return "\n".join([f"# onboard calibrate: {source}", "[rover]", *rows]) + "\n" + seen


def _for_people(value: Value) -> tuple[float, float, float, str]:
    factor, unit = (math.degrees(1.0), "deg") if value.key.endswith("_rad") else (1000.0, "mm")
    return value.before * factor, value.after * factor, value.sigma * factor, unit
