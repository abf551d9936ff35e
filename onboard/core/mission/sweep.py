"""One sweep of the tilting scanner at a stop: park, stream, sweep, collect.

States: PREPARING (tilt goes to its first angle, the LIDAR starts to stream) -> SWEEPING (segments run, scans are
stored) -> SETTLING (the last turn arrives) -> the sweep. A silent LIDAR, a sweep that does not end, a first scan that
does not come, and a call of `discard` discard the data and start again; `tries` counts. No sweep starts in a tick with
a call of `discard`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from onboard.config import Config
from onboard.devices.lidar.session import LidarSession
from onboard.devices.nodes import Nodes
from onboard.perception.scan.cloud import ahead
from onboard.perception.scan.sweep import TiltSegment
from onboard.records import Scan, TiltTrack

_LEAD_NS = 400_000_000  # a segment is sent at least 0.2 s ahead
_SETTLE_NS = 60_000_000  # one turn and its transfer
_PARKED_RAD = 0.01
_PREPARE_NS = 10_000_000_000  # for the axis to park and the stream to begin; includes a reconnect of the scanner


class SweepState(Enum):
    """State of the sweep."""

    PREPARING = "preparing"
    SWEEPING = "sweeping"
    SETTLING = "settling"


@dataclass(frozen=True, slots=True)
class Sweep:
    """Result of one sweep: scans in time order and the tilt while they were taken."""

    scans: tuple[Scan, ...]
    tilt: TiltTrack


class Sensing:
    """Run of one sweep, a `nod` of the axis; call `step` each tick until it returns the Sweep."""

    def __init__(self, config: Config, nod: Sequence[TiltSegment]) -> None:
        self._config, self._segments = config, nod
        self._length_ns = sum(s.duration_ns for s in self._segments)
        self.state = SweepState.PREPARING
        self.tries = 0
        self._scans: list[Scan] = []
        self._start_ns = 0
        self._end_ns = 0
        self._prepare_ns: int | None = None
        self._spoilt = False
        self.why = ""  # reason of the last discarded sweep

    @property
    def progress_ratio(self) -> float:
        """Share of a whole sweep's scans received so far."""
        return min(1.0, len(self._scans) / max(1.0, self._length_ns / 25e6))

    def discard(self, why: str) -> None:
        """Discard the data of this sweep; call before the tick's `step`."""
        self._spoilt, self.why = True, why

    def step(self, lidar: LidarSession, nodes: Nodes, scans: Sequence[Scan], now_ns: int) -> Sweep | None:
        """Process one tick. Returns the finished sweep once."""
        spoilt, self._spoilt = self._spoilt, False
        if self.state is SweepState.PREPARING:
            self._prepare(lidar, nodes, bool(scans) and not spoilt, now_ns)
            return None
        sector_rad = self._config.scanning.sector_rad
        self._scans.extend(ahead(scan, sector_rad) for scan in scans if scan.start_ns >= self._start_ns)
        if spoilt or lidar.silent(now_ns) or not nodes.bus_well or now_ns > self._start_ns + 2 * self._length_ns:
            self._discard(nodes)
        elif self.state is SweepState.SWEEPING and nodes.sweep_done(now_ns):
            self.state, self._end_ns = SweepState.SETTLING, now_ns + _SETTLE_NS
        elif self.state is SweepState.SETTLING and now_ns >= self._end_ns:
            lidar.stream(False)
            sweep = Sweep(tuple(self._scans), nodes.tilt_track(self._start_ns - _LEAD_NS))
            nodes.park_tilt(self._config.scanning.start_rad)
            return sweep
        return None

    def _prepare(self, lidar: LidarSession, nodes: Nodes, ready: bool, now_ns: int) -> None:
        if self._prepare_ns is None:
            self._prepare_ns = now_ns
        lidar.stream(True)
        first_rad = self._config.scanning.start_rad
        nodes.park_tilt(first_rad)
        angle_rad = nodes.tilt_angle_rad
        parked = angle_rad is not None and not nodes.tilt_moving and abs(angle_rad - first_rad) < _PARKED_RAD
        if parked and ready and nodes.bus_well:
            self._start_ns = now_ns + _LEAD_NS
            nodes.sweep(self._segments, self._start_ns)
            self.state = SweepState.SWEEPING
        elif now_ns > self._prepare_ns + _PREPARE_NS:
            self._discard(nodes)

    def _discard(self, nodes: Nodes) -> None:
        self.tries += 1
        self._scans.clear()
        self.state, self._prepare_ns = SweepState.PREPARING, None
        nodes.park_tilt(self._config.scanning.start_rad)
