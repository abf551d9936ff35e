"""Health report of a sensor: counts while it streamed, and each problem with its likely cause."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from onboard.devices.lidar.clock import ClockQuality
from onboard.devices.lidar.model import model_of
from onboard.devices.lidar.session import BAD
from onboard.records import BeamStatus, Scan
from protocol import WireError
from protocol.visible import visible

_DIRTY_RATIO, _ERROR_RATIO, _LOST_RATIO = 0.2, 0.05, 0.15
_BESIDE = 4  # beams to each side: a beam without return is lost if one of them returned on both sides
_SIGMA_LIMIT_NS, _PPM_LIMIT = 0.5e6, 200.0
_DAMAGE_LIMIT = 0.01
_SETTLED, _DRIFTED = 80, 400  # scans before the clock's times, and its rate, are judged


@dataclass(slots=True)
class ScanSums:
    """Sums over scans.

    scans: number of scans.
    first_ns, last_ns: start of the first and the last scan.
    nearest_m, farthest_m: smallest and largest range.
    lost: beams without return between beams that returned.
    beams: number of beams by BeamStatus.
    """

    scans: int = 0
    first_ns: int = 0
    last_ns: int = 0
    nearest_m: float = float("nan")
    farthest_m: float = float("nan")
    lost: int = 0
    beams: dict[str, int] = field(default_factory=lambda: {status.name.lower(): 0 for status in BeamStatus})

    def add(self, scans: Sequence[Scan]) -> None:
        """Add scans."""
        for scan in scans:
            self.first_ns = self.first_ns if self.scans else scan.start_ns
            self.last_ns = scan.start_ns
            self.scans += 1
            for status in BeamStatus:
                self.beams[status.name.lower()] += int((scan.status == status).sum())
            self.lost += _lost(scan)
            good = scan.ranges_m[scan.status == BeamStatus.OK]
            if len(good):
                self.nearest_m = float(np.fmin(self.nearest_m, good.min()))
                self.farthest_m = float(np.fmax(self.farthest_m, good.max()))

    @property
    def rate_hz(self) -> float:
        """Scans a second, by their own times."""
        return (self.scans - 1) * 1e9 / (self.last_ns - self.first_ns) if self.scans > 1 else 0.0

    def ratio(self, *names: str) -> float:
        """Share of the beams with one of these statuses."""
        return sum(self.beams[name] for name in names) / max(1, sum(self.beams.values()))

    @property
    def lost_ratio(self) -> float:
        """Lost beams, as share of those that returned or were lost. Beams to the sky are neither."""
        return self.lost / max(1, self.lost + self.beams["ok"])


def _lost(scan: Scan) -> int:
    """Beams without return that have a return within _BESIDE beams on either side."""
    seen = np.pad((scan.status == BeamStatus.OK).astype(np.int64), _BESIDE)
    before = np.convolve(seen, np.ones(_BESIDE, np.int64), "valid")  # sum over the _BESIDE beams from each one on
    count = len(scan.status)
    between = (before[:count] > 0) & (before[_BESIDE + 1 : _BESIDE + 1 + count] > 0)
    return int(np.count_nonzero(between & (scan.status == BeamStatus.NO_RETURN)))


class Report(NamedTuple):
    """Counts and estimates after a while.

    counts: the session's counts.
    clock: quality of the clock estimate.
    tally: sums over scans.
    info: the sensor's replies to VV, PP and II.
    """

    counts: Mapping[str, int]
    clock: ClockQuality
    tally: ScanSums
    info: Mapping[str, str]

    @property
    def bad(self) -> int:
        """Number of damaged frames, of all kinds."""
        return sum(self.counts[kind] for kind in BAD)

    def as_dict(self) -> dict[str, object]:
        """Report for programs."""
        clock, tally = self.clock, self.tally
        return {
            "info": dict(self.info),
            "scans": tally.scans,
            "rate_hz": round(tally.rate_hz, 3),
            "damaged": self.bad,
            "counts": {name: count for name, count in self.counts.items() if count},
            "clock": {
                "offset_ms": clock.offset_ns * 1e-6,
                "ppm": clock.ppm,
                "samples": clock.samples,
                "sigma_ms": clock.sigma_ns * 1e-6 if np.isfinite(clock.sigma_ns) else None,
            },
            "beams": tally.beams,
            "lost_ratio": round(tally.lost_ratio, 4),
            "findings": [{"name": name, "text": text} for name, text in findings(self)],
        }


def _kinds(report: Report) -> str:
    return ", ".join(f"{report.counts[kind]} {kind}" for kind in BAD if report.counts[kind])


def _damaged(r: Report) -> str:
    return _kinds(r) if r.bad > _DAMAGE_LIMIT * (r.tally.scans + r.bad) else ""


def _gaps(r: Report) -> str:
    gaps, missed = r.counts["gap"], r.counts["missed"]
    return f"{missed} turns without a scan, {gaps} gaps" if gaps or missed else ""


def _drift(r: Report) -> str:
    return f"{r.clock.ppm:+.0f} ppm" if r.clock.samples >= _DRIFTED and abs(r.clock.ppm) > _PPM_LIMIT else ""


def _unsure(r: Report) -> str:
    sigma_ns = r.clock.sigma_ns
    return f"{sigma_ns / 1e6:.2f} ms" if r.clock.samples >= _SETTLED and sigma_ns > _SIGMA_LIMIT_NS else ""


def _share(r: Report, limit: float, *names: str) -> str:
    return f"{r.tally.ratio(*names):.0%}" if r.tally.ratio(*names) > limit else ""


def _count(*names: str) -> Callable[[Report], str]:
    return lambda r: str(total) if (total := sum(r.counts.get(name, 0) for name in names)) else ""


CHECKS: tuple[tuple[str, Callable[[Report], str], str], ...] = (
    ("no scans", lambda r: "" if r.tally.scans else "none", "the sensor was asked and sent none; it says: {stat}"),
    ("damage", _damaged, "{found}: a cable loose, too long or beside a motor's, or a wrong bit rate"),
    ("gaps", _gaps, "{found}: the computer too busy, the line too slow (MD needs 135 kB/s), or frames damaged"),
    ("counter", _count("clock_jump", "clock_reboot"), "jumped or restarted {found} times: the sensor restarted; "
     "look at its power (12 V, 1 A at its start)"),
    ("drift", _drift, "{found} between the sensor's clock and ours; quartz has under 100. A computer that was busy "
     "measures wrong: check again when it is idle"),
    ("time", _unsure, "a scan's time is known to {found} only: the link is unevenly late (hub, network, computer)"),
    ("repeats", _count("repeated_stamp"), "{found} turns came twice: the sensor's motor or firmware"),
    ("period", _count("period_off"), "the motor is over 1 % off its speed: worn, cold, or its voltage is low"),
    ("window", lambda r: _share(r, _DIRTY_RATIO, "too_near"), "{found} of the beams return from too near: "
     "the window is dirty, or something hangs before it"),
    ("beams", lambda r: _share(r, _ERROR_RATIO, "error", "interference"), "{found} of the beams are in error: "
     "sunlight, another scanner, or the codes of another model"),
    ("lost", lambda r: f"{r.tally.lost_ratio:.0%}" if r.tally.lost_ratio > _LOST_RATIO else "", "{found} of the beams "
     "between others that returned have no return: the window is dirty, or the ground is dark, wet or in full sun"),
    ("laser", _count("laser_off"), "off although scans were asked for: an error of the sensor"),
    ("state", _count("unhealthy"), "the sensor says of itself: {stat}"),
    ("replies", _count("timeouts", "disagree"), "{found} were late, or two readings of one differed: bytes are lost"),
)  # fmt: skip
"""Possible defects: condition, text where it holds, likely cause."""


def findings(report: Report) -> list[tuple[str, str]]:
    """(name, cause) of each problem; empty without one."""
    stat = report.info.get("STAT", "unknown")
    found = ((name, shows(report), cause) for name, shows, cause in CHECKS)
    return [(name, cause.format(found=what, stat=stat)) for name, what, cause in found if what]


def model_words(info: Mapping[str, str]) -> str:
    """Return the sensor's model in words, from its PP reply; "" if that cannot be read."""
    try:
        model = model_of(info)
    except WireError:
        return ""
    rate_hz, step_deg = model.rpm / 60, math.degrees(model.step_rad)
    field_deg = step_deg * (model.last_step - model.first_step)
    return (
        f"{visible(model.name) or 'unknown model'}: {rate_hz:g} turns a second, {field_deg:g} degrees in steps of "
        f"{step_deg:g}, from {model.near_mm / 1000:g} m on"
    )
