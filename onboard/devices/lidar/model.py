"""Model of a sensor from its own replies: geometry, time of a beam, status codes, and the measurement request.

A UTM-30LX on USB asked for intensity over more than 95 degrees in one cluster "may crash its laser" (hokuyo_node). The
cluster is enlarged to avoid this, unless lidar.wide_intensity declares the firmware good.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from onboard.config import Lidar
from onboard.records import U8, BeamStatus
from protocol import WireError, scip

_WIDE_RAD = math.radians(95.0)
_STATUS = {
    scip.Code.NO_OBJECT: BeamStatus.NO_RETURN,
    scip.Code.TOO_NEAR: BeamStatus.TOO_NEAR,
    scip.Code.NEAR_END: BeamStatus.TOO_NEAR,
    scip.Code.INTERFERENCE: BeamStatus.INTERFERENCE,
}  # fmt: skip  every other code: ERROR


class Model(NamedTuple):
    """Sensor model as its PP reply describes it."""

    name: str
    first_step: int
    last_step: int
    front_step: int
    steps_a_turn: int
    rpm: int
    near_mm: int

    @property
    def turn_ms(self) -> float:
        """Nominal time of a turn, ms."""
        return 60e3 / self.rpm

    @property
    def step_rad(self) -> float:
        """Angle between steps, rad."""
        return math.tau / self.steps_a_turn

    def angle_rad(self, step: float) -> float:
        """Direction of a step, rad: 0 ahead, counter-clockwise."""
        return (step - self.front_step) * self.step_rad


UTM_30LX = Model("UTM-30LX", 0, 1080, 540, 1440, 2400, 23)


def model_of(pairs: Mapping[str, str]) -> Model:
    """Return the model in a PP reply. Raises WireError("text") if a value is missing, no number or impossible."""
    try:
        low, high, front, steps, rpm, near = (
            int(pairs[key]) for key in ("AMIN", "AMAX", "AFRT", "ARES", "SCAN", "DMIN")
        )
    except (KeyError, ValueError) as error:
        raise WireError("text", f"PP: {error}") from error
    if not (0 <= low < high < 10_000 > abs(front) and 0 < steps < 100_000 > rpm > 0 and 0 < near < 1000):
        raise WireError("text", f"PP: {dict(pairs)}")
    return Model(pairs.get("MODL", ""), low, high, front, steps, rpm, near)


def request_of(config: Lidar, model: Model, usb: bool) -> scip.ScanRequest:
    """Request for this sensor: the configured sector within the sensor's own, the cluster as wide as necessary."""
    first = max(model.first_step, config.first_step)
    last = model.last_step if config.last_step < 0 else min(model.last_step, config.last_step)
    first = min(first, last)
    cluster = config.cluster
    if scip.MEASURING[config.command].intensity and usb and not config.wide_intensity:
        cluster = max(cluster, math.ceil((last - first) * model.step_rad / _WIDE_RAD))
    return scip.ScanRequest(config.command, first, last, cluster, config.skip, config.scans)


def status_table(model: Model) -> U8:
    """BeamStatus of the values 0 to near_mm; values below DMIN are codes, values above are ranges."""
    table = np.full(model.near_mm + 1, BeamStatus.ERROR, np.uint8)
    for code, meaning in scip.codes_of(model.name).items():
        if code < model.near_mm:
            table[code] = _STATUS.get(meaning, BeamStatus.ERROR)
    table[model.near_mm] = BeamStatus.OK
    return table


def healthy(text: str) -> bool:
    """Return whether a STAT of II reports no error."""
    lower = text.lower()
    return any(word in lower for word in ("works well", "no error", "working normally"))
