"""Converter of decoded values to a Scan: metres, status of each beam, intensity, further echoes, in ring memory."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from onboard.config import Lidar
from onboard.devices.lidar.model import Model, status_table
from onboard.devices.lidar.scan_ring import ScanRing
from onboard.kernel_calls.scip import beams_into
from onboard.records import Scan
from protocol import scip

_M_PER_MM = np.float32(1e-3)


class BeamMaker:
    """Converter for the scans of one request to one model."""

    def __init__(self, config: Lidar, model: Model, asked: scip.ScanRequest) -> None:
        step = max(1, asked.cluster)
        self.ring = ScanRing(config.ring, asked.beams, asked.channels, asked.kind.echoes)
        self._shape = asked.beams, asked.kind.echoes, asked.channels
        self._each = asked.kind.echoes * asked.channels
        self._status_of = status_table(model)
        self._lead_turns = (asked.first + (step - 1) / 2 - config.reference_step) / model.steps_a_turn
        self._beam_turns = step / model.steps_a_turn
        self._first_rad = model.angle_rad(asked.first + (step - 1) / 2)
        self._step_rad = model.step_rad * step

    def scan(self, values: NDArray[np.integer[Any]], stamp_ns: int, turn_ns: float) -> Scan:
        """Return the scan whose stamp names the instant stamp_ns, in a turn that takes turn_ns.

        A cluster is represented by its middle, in angle and time.
        """
        place = self.ring.take()
        beams_into(values, self._each, self._status_of, place.ranges_m, place.status)
        wide = values.reshape(self._shape)
        if place.intensity is not None:
            place.intensity[:] = wide[:, 0, 1]
        if place.further_m is not None:
            further = wide[:, 1:, 0]
            place.further_m[:] = further * _M_PER_MM
            place.further_m[further < len(self._status_of) - 1] = np.nan  # MISSING is below every distance
        return Scan(
            stamp_ns + round(self._lead_turns * turn_ns),
            self._beam_turns * turn_ns,
            self._first_rad,
            self._step_rad,
            place.ranges_m,
            place.status,
            place.intensity,
            place.further_m,
        )
