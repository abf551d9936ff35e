"""Wheels on loose soil: table of soils, and interface of the native kernel (equations in native/soil.hpp).

Nominal values are like lunar simulant; slip is near 1.5, 8 and 20 % at 0, 10 and 20 degrees. On flat ground a rover
slips 8 % on soft soil, 32 % on powder, and does not advance in dust.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil.native import _soil
from onboard.native import elementary
from onboard.records import Grid


class SoilClass(NamedTuple):
    """Constants of one soil, in the kernel's order.

    stiffness_npm3, exponent: pressure stiffness * z^exponent, N/m^(2 + exponent)
    damping_paspm: damping along the rim's normal, Pa s/m
    unloading_ratio: share of the pressure left on the trailing half
    cohesion_pa: cohesion
    tan_phi: tangent of the friction angle
    shear_length_m: shear length K
    shear_damping_spm: damping of the shear per newton of load, s/m
    """

    stiffness_npm3: float
    exponent: float
    damping_paspm: float
    unloading_ratio: float
    cohesion_pa: float
    tan_phi: float
    shear_length_m: float
    shear_damping_spm: float


CLASSES = {
    "firm": SoilClass(2.5e6, 1.0, 2e4, 0.93, 500.0, elementary.tan(math.radians(38)), 0.012, 8.0),
    "nominal": SoilClass(8.3e5, 1.0, 2e4, 0.88, 170.0, elementary.tan(math.radians(35)), 0.018, 8.0),
    "soft": SoilClass(1.0e5, 1.0, 6e3, 0.7, 50.0, elementary.tan(math.radians(14)), 0.025, 8.0),
    "powder": SoilClass(6.0e4, 1.0, 4e3, 0.6, 0.0, elementary.tan(math.radians(8)), 0.03, 8.0),
    "dust": SoilClass(6.0e4, 1.0, 4e3, 0.6, 0.0, elementary.tan(math.radians(4)), 0.03, 8.0),
}


def mixed(soil: SoilClass, other: SoilClass, share: float) -> SoilClass:
    """Mixture of two soils, share 0 to 1 of the other: stiffness by its logarithm, the rest linear.

    Nobody has measured such a mixture; it serves for a change from one soil to the other without a step.
    """
    between = [(1.0 - share) * a + share * b for a, b in zip(soil, other)]
    logarithms = elementary.log(soil.stiffness_npm3), elementary.log(other.stiffness_npm3)
    stiffness = elementary.exp((1.0 - share) * logarithms[0] + share * logarithms[1])
    return SoilClass(stiffness, *between[1:])


class SoilContacts:
    """Contacts of the wheels with the soil of a field; stores each wheel's shear displacement."""

    def __init__(
        self, grid: Grid, soil_z: NDArray[np.float32], radius_m: float, width_m: float, soils: tuple[str, ...]
    ) -> None:
        if grid.rows < 2 or grid.columns < 2:
            raise ValueError(f"grid: expected at least 2 x 2 nodes, given {grid.rows} x {grid.columns}")
        self._wheels = len(soils)
        self._heights = np.empty((grid.rows, grid.columns), np.float32)  # the kernel reads them in place
        self.reshape(soil_z)
        self._contacts = _soil.Contacts(self._heights, grid.x0_m, grid.y0_m, grid.cell_m, radius_m, width_m, len(soils))
        for wheel, name in enumerate(soils):
            self.set_soil(wheel, name)

    def set_soil(self, wheel: int, name: str) -> None:
        """Set the soil under one wheel (index from 0); `name` is a row of CLASSES."""
        if name not in CLASSES:
            raise ValueError(f"soil {name!r} is not one of {', '.join(CLASSES)}")
        self.set_constants(wheel, CLASSES[name])

    def set_constants(self, wheel: int, soil: SoilClass) -> None:
        """Set a soil that need not be in the table, as `set_soil`."""
        self._contacts.set_soil(wheel, tuple(soil))

    def reshape(self, soil_z: NDArray[np.float32]) -> None:
        """Set new heights, (rows, columns); shear stays. Raises ValueError for a wrong shape or values not finite."""
        heights = np.asarray(soil_z, np.float32)
        if heights.shape != self._heights.shape or not np.isfinite(heights).all():
            raise ValueError(f"soil {heights.shape} on a grid {self._heights.shape}, or heights not finite")
        self._heights[:] = heights

    def reset(self) -> None:
        """Reset all shear to zero."""
        self._contacts.reset()

    def shear(self, wheel: int) -> tuple[float, float, float]:
        """Shear displacement along and across (m), and the trailing half (-1..1)."""
        return self._contacts.state(wheel)

    def step(self, states: tuple[Any, ...], dt_s: float) -> list[tuple[Any, Any, float, float]]:
        """Run one step for all wheels: (force (3,) N, point (3,) m, load N, sinkage m) of each, map axes.

        states: one row per wheel as returned by pybullet's getLinkStates: [0] centre, [1] quaternion x y z w, [6]
            velocity, [7] angular velocity, all in map axes. Raises ValueError for another number of wheels.
        """
        if len(states) != self._wheels:
            raise ValueError(f"{len(states)} states for {self._wheels} wheels")
        return self._contacts.step(states, dt_s)
