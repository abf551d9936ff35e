"""What a world is fitted with, beside its field and its rover: ray caster, errors of nodes and scanner."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hil.devices.errors import USUAL, SensorErrors
from hil.devices.lidar_errors import IDEAL, LidarErrors
from hil.rays.casters import DEFAULT


@dataclass(frozen=True, slots=True)
class Fitting:
    """One world's. rays: row of hil.rays.casters; sector_rad: half sector that the flight program maps, ahead."""

    rays: str = DEFAULT
    sensors: SensorErrors = USUAL
    lidar: LidarErrors = IDEAL
    sector_rad: float = math.pi
