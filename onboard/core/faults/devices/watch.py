"""All device monitors: the devices' data of one tick in, the active rows of protocol.tables.faults out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from onboard.config import Config
from onboard.core.faults.devices.bias import BiasWatch
from onboard.core.faults.devices.clocks import Jumps, UtcWatch
from onboard.core.faults.devices.returns import FrameWatch, ReturnWatch
from onboard.core.faults.devices.stall import StallWatch
from onboard.devices.lidar.session import LidarSession
from onboard.devices.nodes import Nodes
from onboard.records import ImuSample, Scan

DEVICE_ROWS = ("LIDAR_GARBLED", "LIDAR_DIRTY", "LIDAR_CLOCK", "CLOCK_JUMP", "TILT_STALL", "IMU_BIAS")


class DeviceWatch:
    """Watch of all devices; call `update` each tick. faults: row -> finding, in words."""

    def __init__(self, config: Config) -> None:
        self.faults: dict[str, str] = {}
        self._frames, self._returns = FrameWatch(), ReturnWatch(config.rover, config.scanning.sector_rad)
        self._stall, self._bias, self._utc = StallWatch(), BiasWatch(), UtcWatch()
        self._lidar_clock, self._clocks, self._biases = Jumps(), Jumps(), Jumps()

    def update(self, lidar: LidarSession, nodes: Nodes, scans: Sequence[Scan], now_ns: int) -> None:
        """Process one tick of the scanner and the axis."""
        self._frames.update(lidar.counts["scans"], lidar.bad)
        self._returns.update(scans, nodes.tilt_angle_rad)
        self._stall.update(nodes.tilt, now_ns)
        quality = lidar.clock.quality
        broken = self._lidar_clock.update(quality.jumps + quality.reboots, now_ns)
        bad = lidar.flood.words if lidar.flood.flooded else f"{100 * self._frames.bad_ratio:.0f} % of its frames"
        self._set("LIDAR_GARBLED", self._frames.garbled or lidar.flood.flooded, bad)
        torn, spoilt = 100 * self._returns.torn_ratio, 100 * self._returns.spoilt_ratio
        self._set("LIDAR_DIRTY", self._returns.dirty, f"{torn:.0f} % torn, {spoilt:.0f} % without a word")
        self._set("LIDAR_CLOCK", broken, f"{quality.jumps} jumps, {quality.reboots} reboots since the start")
        self._set("TILT_STALL", self._stall.stalled, f"at {math.degrees(nodes.tilt_angle_rad or 0.0):.1f} degrees")

    def clocks(self, nodes: Nodes, utc_ns: int, now_ns: int) -> None:
        """Process one tick of the tilt node's clock and UTC."""
        self._utc.update(utc_ns, now_ns)
        jumped = self._clocks.update(nodes.tilt.clock_jumps + self._utc.jumps, now_ns)
        utc = f", UTC {self._utc.jumps}, last by {self._utc.last_ns / 1e9:+.1f} s" if self._utc.jumps else ""
        self._set("CLOCK_JUMP", jumped, f"since the start the tilt node's {nodes.tilt.clock_jumps}{utc}")

    def rest(self, imu: ImuSample | None, standing: bool, slips: bool, now_ns: int) -> float:
        """Process one tick of the gyro; return the change of its bias found in this tick, rad/s; 0 if none.

        slips: SLIP_HIGH is active.
        """
        before = self._bias.jumps
        self._bias.update(imu.gyro_radps if imu else None, standing, now_ns, slips)
        biased = self._biases.update(self._bias.jumps, now_ns)
        self._set("IMU_BIAS", biased, f"by {math.degrees(self._bias.step_radps):+.2f} degrees a second")
        return self._bias.step_radps if self._bias.jumps > before else 0.0

    def digest_items(self) -> tuple[float, ...]:
        """Values of this state that go into the state digest."""
        return (
            self._frames.bad_ratio,
            self._returns.torn_ratio,
            self._stall.stalled,
            self._lidar_clock.count,
            self._clocks.count,
            self._bias.jumps,
            self._bias.step_radps,
        )

    def _set(self, name: str, holds: bool, words: str) -> None:
        if holds:
            self.faults[name] = words
        else:
            self.faults.pop(name, None)
