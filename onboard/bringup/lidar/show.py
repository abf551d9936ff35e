"""Output of `watch` and `check`: a line of numbers, the scan from above in dots, the report."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.bringup.lidar.report import Report, findings
from onboard.devices.lidar.clock import WINDOW, ClockQuality
from onboard.records import BeamStatus, Scan

_BRAILLE = 0x2800
_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])  # dots of a character, 4 rows by 2 columns


def polar(scan: Scan, columns: int, rows: int, reach_m: float) -> list[str]:
    """The scan from above, ahead is up: `rows` lines of braille, + is the scanner, reach_m half of the height."""
    phi = scan.first_angle_rad + np.arange(len(scan.ranges_m)) * scan.step_rad
    seen = scan.status == BeamStatus.OK
    dot_m = 2 * reach_m / (4 * rows)
    up = np.round(2 * rows - scan.ranges_m[seen] * np.cos(phi[seen]) / dot_m).astype(int)
    right = np.round(columns - scan.ranges_m[seen] * np.sin(phi[seen]) / dot_m).astype(int)
    inside = (up >= 0) & (up < 4 * rows) & (right >= 0) & (right < 2 * columns)
    cells: NDArray[np.int64] = np.zeros((rows, columns), np.int64)
    up, right = up[inside], right[inside]
    np.bitwise_or.at(cells, (up // 4, right // 2), _DOTS[up % 4, right % 2])
    lines = [[chr(_BRAILLE + cell) if cell else " " for cell in row] for row in cells.tolist()]
    lines[rows // 2][columns // 2] = "+"
    return ["".join(line).rstrip() for line in lines]


class ScanView(NamedTuple):
    """Ranges of a scan; None where nothing is seen."""

    ahead_m: float | None = None
    nearest_m: float | None = None
    nearest_deg: float | None = None  # positive left


def view(scan: Scan) -> ScanView:
    """The range straight ahead, and the nearest return."""
    phi = scan.first_angle_rad + np.arange(len(scan.ranges_m)) * scan.step_rad
    ahead_m = float(scan.ranges_m[int(np.abs(phi).argmin())])
    ahead = round(ahead_m, 3) if math.isfinite(ahead_m) else None
    seen = np.flatnonzero(scan.status == BeamStatus.OK)
    if not len(seen):
        return ScanView(ahead)
    near = seen[scan.ranges_m[seen].argmin()]
    return ScanView(ahead, round(float(scan.ranges_m[near]), 3), round(math.degrees(phi[near]), 2))


def numbers(scan: Scan | None, rate_hz: float, counts: dict[str, int], clock: ClockQuality, trouble: str = "") -> str:
    """One line of at most 80 columns: rate, scans, ahead, nearest, clock; or the trouble."""
    text = f"{rate_hz:4.1f} Hz {counts['scans']:6d} scans"
    if trouble:
        return f"{text}  {trouble}"
    if scan is not None:
        seen = view(scan)
        text += "  ahead nothing" if seen.ahead_m is None else f"  ahead {seen.ahead_m:6.3f} m"
        if seen.nearest_deg is not None:
            text += f"  nearest {seen.nearest_m:6.3f} m at {seen.nearest_deg:+4.0f}°"
    sigma = f"±{clock.sigma_ns / 1e6:.3f} ms" if math.isfinite(clock.sigma_ns) else "unknown"
    return f"{text}  clock {sigma}"


def _clock(clock: ClockQuality) -> str:
    """Clock quality as text. The rate is shown only with a full window: over milliseconds it is too uncertain."""
    if not math.isfinite(clock.sigma_ns):
        return "not known yet"
    rate = f", {clock.ppm:+.0f} ppm" if clock.samples >= WINDOW else ""
    return f"±{clock.sigma_ns / 1e6:.3f} ms{rate}"


def lines_of(report: Report) -> list[str]:
    """The report for people."""
    tally, clock = report.tally, report.clock
    name = report.info.get("PROD") or report.info.get("MODL") or "a sensor that did not say its name"
    beams = ", ".join(f"{name} {tally.ratio(name):.1%}" for name in tally.beams if tally.beams[name])
    lines = [
        f"sensor    {name}, {report.info.get('FIRM', 'firmware unknown')}",
        f"scans     {tally.scans}, {tally.rate_hz:.2f} a second by their own times; {report.bad} damaged",
        f"beams     {beams or 'none'}; {tally.nearest_m:.3f} to {tally.farthest_m:.3f} m",
        f"lost      {tally.lost_ratio:.1%} of the beams between others that returned",
        f"clock     {_clock(clock)}, from {clock.samples} scans",
    ]
    found = findings(report)
    return lines + ([f"WRONG     {name}: {text}" for name, text in found] or ["healthy   nothing is wrong"])
