"""Present state of the rover as the gateway knows it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from ground.gateway.origin import Origin
from protocol.tables.modes import Mode

RUNS = (Mode.AUTONOMOUS, Mode.TELEOP, Mode.SEQUENCE)


class VehicleState(NamedTuple):
    """Present state of the rover.

    values: newest telemetry items in our units and frames.
    onboard_ns: newest onboard time.
    enabled: True after `arm` at this gateway.
    origin: of the map frame on the globe.
    stopping: True while a command that stops the rover awaits its report.
    """

    values: Mapping[str, float]
    onboard_ns: int
    enabled: bool
    origin: Origin
    stopping: bool = False

    def number(self, name: str) -> float | None:
        """Return an item's value; None if it has not arrived or is not known."""
        value = self.values.get(name)
        return value if value is not None and math.isfinite(value) else None

    @property
    def mode(self) -> Mode | None:
        """The rover's mode; None until it is received."""
        number = self.number("mode")
        return Mode(int(number)) if number is not None and int(number) in set(Mode) else None

    @property
    def armed(self) -> bool:
        """True if enabled here in STANDBY; in a mode whose wheels run, if enabled here or no stop is pending here."""
        return (self.enabled and self.mode is Mode.STANDBY) or (
            self.mode in RUNS and (self.enabled or not self.stopping)
        )

    @property
    def boot_ms(self) -> int:
        """Onboard time in ms, as in MAVLink's time stamps."""
        return self.onboard_ns // 1_000_000 & 0xFFFF_FFFF

    def all(self, *names: str) -> list[float] | None:
        """Return the values of all names; None if one is missing."""
        found = [self.number(name) for name in names]
        return None if None in found else [value for value in found if value is not None]
