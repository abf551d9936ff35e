"""The flight session alone, as a deterministic function of its inputs; live use and replay both run it."""

from __future__ import annotations

import hashlib
from enum import Enum

from onboard.config import Config
from onboard.devices.lidar.session import LidarSession
from onboard.records import Event, Inputs, Outputs, Scan

ORDER = "LIDAR_ORDER"  # the event that stores the order to the session in a record


class SessionOrder(Enum):
    """Order of the tool to the session."""

    NONE = ""
    STREAM = "stream"
    FAREWELL = "farewell"


class LidarCore:
    """One session, run by `tick`."""

    def __init__(self, config: Config) -> None:
        self.session = LidarSession(config.lidar)

    def tick(self, inputs: Inputs, order: SessionOrder = SessionOrder.NONE) -> tuple[Outputs, list[Scan]]:
        """The outputs to write now, and the scans that became complete."""
        session, now_ns = self.session, inputs.now_ns
        if order is SessionOrder.STREAM:
            session.stream(True)
        scans = session.receive(inputs.lidar_chunks, inputs.lidar_state, now_ns)
        data = session.farewell(now_ns) if order is SessionOrder.FAREWELL else session.send(now_ns)
        events = (Event(now_ns, "info", ORDER, order.value),) if order is not SessionOrder.NONE else ()
        digest = hashlib.blake2b(repr(session.digest_items()).encode(), digest_size=8).digest()
        connect = session.wants_connect(now_ns)
        return Outputs(lidar_bytes=data, lidar_connect=connect, events=events, state_digest=digest), scans
