"""Sensor information: the values that a sensor reports, and the optional requests that are made once a connection.

    %ST                 after the geometry: of SCIP 2.2 always, of others by lidar.probe_state
    TM0 TM1 ... TM2     before the first stream, by lidar.time_seed: an older seed would be off by the drift since

The result of each is one line of `info`. A sensor that refuses them or does not answer is used without them.
"""

from __future__ import annotations

from collections.abc import Mapping

from onboard.config import Lidar
from onboard.devices.lidar.clock import LidarClock
from onboard.devices.lidar.model import UTM_30LX, model_of
from onboard.devices.lidar.phases import Phase

SEEDS = 8  # TM1 exchanges, one at a time


class SensorInfo:
    """Sensor information. info: values of all replies so far, by key; model: the last one that PP described."""

    def __init__(self, config: Lidar) -> None:
        self.info: dict[str, str] = {}
        self.model = UTM_30LX
        self.seeds = 0  # TM1 exchanges of this connection
        self._config = config
        self._quickest_ns = 0
        self._asked: set[Phase] = set()

    def restart(self) -> None:
        """Reset for a new connection."""
        self._asked.clear()
        self.seeds = 0

    def add(self, phase: Phase, pairs: Mapping[str, str]) -> None:
        """Add a text reply. Raises WireError("text") if PP describes no model."""
        self.info = {**self.info, **pairs}
        if phase is Phase.GEOMETRY:
            self.model = model_of(pairs)

    def note(self, key: str, text: str) -> None:
        """Store the result of an optional exchange; ignore one without a key."""
        if key:
            self.info = {**self.info, key: text}

    def stranger(self) -> str:
        """Text for people if the sensor is not the configured model; else empty."""
        name = f"{self.info.get('PROD', '')} {self.model.name}"
        if self._config.model in name:
            return ""
        return (
            f"the sensor is a {name.strip()!r}, lidar.model = {self._config.model!r}: "
            "connect the right one or name it in lidar.model"
        )

    def nothing(self) -> str:
        """Text for people if the sensor gives no answer at all."""
        return (
            f"no SCIP answer on {self._config.address}: is this a Hokuyo, is it powered, and is the bit rate right "
            "(tty:PATH@115200)?"
        )

    def due(self, phase: Phase) -> bool:
        """Return whether to make this request now: at most once a connection, whatever its result."""
        probes = self._config.probe_state or self.info.get("PROT", "").endswith("2.2")
        wanted = {Phase.PROBE: probes, Phase.TIME_ON: self._config.time_seed}[phase]
        if not wanted or phase in self._asked:
            return False
        self._asked.add(phase)
        return True

    def seed(self, clock: LidarClock, stamp_ms: int, sent_ns: int, rx_ns: int) -> bool:
        """Add a reply to TM1, by the time of its request and the port's stamp of the reply. True for the last."""
        clock.seed(stamp_ms, sent_ns, rx_ns)
        self._quickest_ns = min(self._quickest_ns, rx_ns - sent_ns) if self.seeds else rx_ns - sent_ns
        self.seeds += 1
        self.note("TM", f"{self.seeds} exchanges, the quickest in {self._quickest_ns * 1e-6:.2f} ms")
        return self.seeds >= SEEDS
