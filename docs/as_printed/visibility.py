"""Algorithm 1 and Eq. 6 as printed; the flight version is `onboard.planning.sensing.visibility`.

Line numbers in comments are the chapter's. All beams of line 1 run in parallel; the steps of line 7 are a loop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.records import F32, F64, I32


@dataclass(frozen=True, slots=True)
class Fan:
    """The virtual beams.

    range_m: their range.
    cell_m: the map's resolution d_Res.
    beams: their number around the circle.
    """

    range_m: float
    cell_m: float
    beams: int = 360


@dataclass(frozen=True, slots=True)
class Mended:
    """Corrected faults; none: as printed.

    ray_advances: line 8 continues from the previous sample.
    flat_is_seen: S_max starts at -inf and an equal slope is seen.
    mast_m: height of the sensor above its node.
    plan_steps: u_i lies in the horizontal plane, and j stays below j_max.
    """

    ray_advances: bool = False
    flat_is_seen: bool = False
    mast_m: float = 0.0
    plan_steps: bool = False


@dataclass(frozen=True, slots=True)
class Classified:
    """Number of times that each node was put into each set; a node may be in both.

    noc: (rows, columns) int32, chi_noc.
    occ: (rows, columns) int32, chi_occ.
    """

    noc: I32
    occ: I32

    @property
    def vis(self) -> float:
        """Eq. 6 of the samples, as the algorithm counts them."""
        return float(self.noc.sum() / max((self.noc + self.occ).sum(), 1))

    @property
    def vis_of_cells(self) -> float:
        """Eq. 6 of the sets' cardinalities: a node counts once, as seen if any beam saw it."""
        return float((self.noc > 0).sum() / max((self.noc + self.occ > 0).sum(), 1))

    @property
    def vis_of_shares(self) -> float:
        """Eq. 6 with each sample weighing 1 / (samples in its node), the correction used in flight."""
        samples = self.noc + self.occ
        return float((self.noc[samples > 0] / samples[samples > 0]).sum() / max((samples > 0).sum(), 1))


AS_PRINTED = Mended()


def algorithm_1(heights_m: F32, at: tuple[int, int], fan: Fan, mended: Mended = AS_PRINTED) -> Classified:
    """Classify the nodes that the beams from node `at` (j, i) sample.

    heights_m: (rows, columns), all known. Samples off the map and in the sensor's own node, which has no slope, are
        left out; the chapter does not specify them.
    """
    rows, columns = heights_m.shape
    p_org = np.array([at[1] * fan.cell_m, at[0] * fan.cell_m, float(heights_m[at]) + mended.mast_m])
    way = _ways(heights_m, p_org, fan, mended)  # 2
    length = np.linalg.norm(way, axis=1)
    u = way / length[:, None] * fan.cell_m  # 3
    s_max = np.full(fan.beams, -np.inf if mended.flat_is_seen else 0.0)  # 4
    j_max = np.floor(length / fan.cell_m + 1e-9) - (1 if mended.plan_steps else 0)  # 5
    r_org = np.broadcast_to(p_org, way.shape)  # 6
    seen: list[NDArray[np.int64]] = []
    hidden: list[NDArray[np.int64]] = []
    for j in range(int(j_max.max()) + 1):  # 7
        r_end = r_org + u  # 8
        row, column = (np.rint(r_end[:, k] / fan.cell_m).astype(np.int64) for k in (1, 0))
        there = (j <= j_max) & (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        z = heights_m[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)].astype(np.float64)
        away = np.hypot(row - at[0], column - at[1]) * fan.cell_m
        slope = np.where(away > 0.0, (z - p_org[2]) / np.maximum(away, 1e-12), -np.inf)  # 9
        visible = slope >= s_max - 1e-6 if mended.flat_is_seen else slope > s_max  # 10
        there &= away > 0.0  # the sensor's own node
        flat = row * columns + column
        seen.append(flat[there & visible])  # 11
        hidden.append(flat[there & ~visible])  # 14
        s_max = np.where(there & visible, np.maximum(slope, s_max), s_max)  # 12
        if mended.ray_advances:
            r_org = r_end
    noc, occ = (np.bincount(np.concatenate(part), minlength=heights_m.size) for part in (seen, hidden))
    return Classified(noc.reshape(rows, columns).astype(np.int32), occ.reshape(rows, columns).astype(np.int32))  # 21


def _ways(heights_m: F32, p_org: F64, fan: Fan, mended: Mended) -> F64:
    """Each L_i, (beams, 3): from the sensor to the node at the beam's end, horizontal if `plan_steps` is set."""
    azimuth = np.arange(fan.beams) * (math.tau / fan.beams)
    plan = fan.range_m * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    end = np.rint((p_org[:2] + plan) / fan.cell_m).astype(np.int64)
    column, row = (np.clip(end[:, k], 0, heights_m.shape[1 - k] - 1) for k in (0, 1))
    rise = np.zeros(fan.beams) if mended.plan_steps else heights_m[row, column] - p_org[2]
    return np.column_stack([plan, rise])
