"""All state of the flight core: its parts, each with one owner."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from onboard.config import Config
from onboard.core.downlink import Downlink
from onboard.core.faults.computer import ComputerWatch
from onboard.core.faults.devices.watch import DeviceWatch
from onboard.core.faults.power import PowerWatch
from onboard.core.faults.wheels.watch import WheelWatch
from onboard.core.jobs import JobBook
from onboard.core.modes import fence_orders, link_orders
from onboard.core.modes.executive import Executive
from onboard.core.modes.fence_orders import FenceOrders
from onboard.core.modes.link_orders import LinkOrders
from onboard.core.modes.parameter_orders import KEPT, ParameterOrders
from onboard.core.pose_store import KEPT as KEPT_POSE
from onboard.core.pose_store import Keeping
from onboard.core.tick_timing import Pace
from onboard.devices.lidar.session import LidarSession
from onboard.devices.nodes import Nodes
from onboard.motion.wheel_health import SOUND, Wheels
from onboard.perception.pose.localisation import Localisation
from onboard.records import Gdem, Twist, WheelCommand, WheelMode
from onboard.records.status import HALTS, Save

if TYPE_CHECKING:  # built outside the tick, with modules that the core does not load
    from onboard.perception.map.stop_map import StopMap


class Rover:
    """All state of the core. Each part has one owner; nothing is shared.

    memory: map saved in an earlier run.
    kept: other data saved in earlier runs, by name.
    """

    def __init__(
        self,
        config: Config,
        gdem: Gdem | None,
        memory: StopMap | None = None,
        kept: Mapping[str, bytes] = MappingProxyType({}),
    ) -> None:
        self.lidar = LidarSession(config.lidar)
        self.nodes = Nodes(config.rover, config.can, config.link.boot_count)
        self.localisation = Localisation(config.rover, config.localisation)
        self.downlink = Downlink(config.link, kept.get(HALTS, b""))
        self.parameters = ParameterOrders(config, kept.get(KEPT, b""), self.downlink)
        self.fences = FenceOrders(bool(config.state.folder), kept.get(fence_orders.KEPT, b""), self.downlink)
        self.keeping = Keeping(config, kept.get(KEPT_POSE, b""), self.localisation)
        self.link = LinkOrders(kept.get(link_orders.KEPT, b""), self.downlink)
        self.executive = Executive((self.parameters, self.fences, self.link), gdem, self.downlink, memory)
        self.jobs = JobBook()
        self.orders: tuple[WheelCommand, ...] = (WheelCommand(WheelMode.HOLD, 0.0, 0.0),) * 4
        self.watch = WheelWatch(config.rover)
        self.power, self.computer = PowerWatch(), ComputerWatch()
        self.devices = DeviceWatch(config)
        self.wheels: Wheels = SOUND
        self.twist = Twist()
        self.steering_held = False
        self.pace = Pace()

    @property
    def config(self) -> Config:
        """The configuration with the operator's parameters as set now."""
        return self.parameters.config

    def take_saves(self) -> tuple[Save, ...]:
        """Return what is to be stored after this tick, once."""
        owners = (self.parameters, self.fences, self.keeping, self.link)
        saves = tuple(save for owner in owners for save in owner.saves)
        for owner in owners:
            owner.saves.clear()
        return saves
