"""Fitting of a world besides its field and its rover: ray caster, errors of nodes and scanner."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hil.devices.can.errors import USUAL, SensorErrors
from hil.devices.lidar.errors import IDEAL, LidarErrors
from hil.plant.rays.casters import DEFAULT


@dataclass(frozen=True, slots=True)
class Fitting:
    """Fitting of one world.

    rays: row of hil.plant.rays.casters
    sensors: errors of the nodes
    lidar: errors of the scanner
    sector_rad: half sector ahead that the flight program maps
    """

    rays: str = DEFAULT
    sensors: SensorErrors = USUAL
    lidar: LidarErrors = IDEAL
    sector_rad: float = math.pi
