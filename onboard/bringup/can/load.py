"""Bus load and worst-case response times of the DBC's frames (Davis, Burns, Bril, Lukkien 2007, sufficient form).

Three cases: OPERATION, every regular frame at its shortest interval (the axis sweeps); EMERGENCY, every node asserts
its stop as well and the axis stands; EVERYTHING, both at once, which lasts less than one interval and bounds the load.

A frame's response time R = J + w + C: jitter, queueing behind one lower frame already on the wire (B) and behind every
higher frame that is released in the meantime, and its own bits. Schedulable if R <= period for each frame. J is 0:
releases are modelled as sporadic with the shortest interval of the DBC.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from typing import NamedTuple

from onboard.bringup.can.bits import worst_bits
from protocol.generated.can_frames import BITS_PER_S, FRAMES, Layout


class Case(Enum):
    """Traffic on the bus."""

    OPERATION = "operation"
    EMERGENCY = "emergency"
    EVERYTHING = "everything"


class FrameLoad(NamedTuple):
    """One frame of a case.

    name: name in the DBC.
    can_id: identifier.
    period_s: shortest interval.
    wire_s: time on the wire with every stuff bit.
    response_s: response time.
    load_ratio: share of the bus.
    """

    name: str
    can_id: int
    period_s: float
    wire_s: float
    response_s: float
    load_ratio: float


def analyse(case: Case, frames: Mapping[int, Layout] = FRAMES, bits_per_s: int = BITS_PER_S) -> list[FrameLoad]:
    """Rows in the order of priority. Raises ValueError for a frame without interval, or if the bus is overloaded."""
    taking = [frames[can_id] for can_id in sorted(frames) if case is not Case.OPERATION or not frames[can_id].event]
    periods_s = [_interval_s(layout, case) for layout in taking]
    wire_s = worst_bits(8) / bits_per_s
    if sum(wire_s / period_s for period_s in periods_s) >= 1.0:
        raise ValueError("the bus is overloaded: no response time is bounded")
    return [
        FrameLoad(
            layout.name,
            layout.can_id,
            period_s,
            wire_s,
            _response_s(periods_s[:index], wire_s, 1 / bits_per_s),
            wire_s / period_s,
        )
        for index, (layout, period_s) in enumerate(zip(taking, periods_s))
    ]


def total(rows: list[FrameLoad]) -> float:
    """Share of the bus used by all frames of a case."""
    return sum(row.load_ratio for row in rows)


def _interval_s(layout: Layout, case: Case) -> float:
    """The shortest regular interval of a frame; if it has none, its delay time."""
    fast_ms = 0 if case is Case.EMERGENCY else layout.fast_ms
    interval_ms = fast_ms or layout.cycle_ms or layout.delay_ms
    if not interval_ms:
        raise ValueError(f"{layout.name} has neither a cycle time nor a delay time")
    return interval_ms / 1000.0


def _response_s(higher_s: list[float], wire_s: float, bit_s: float) -> float:
    """Queueing delay by fixed-point iteration behind the intervals of higher frames; all frames are 8 bytes long.

    Blocking by any frame, including earlier ones of the same id (the sufficient test).
    """
    queue_s = wire_s
    while (again_s := wire_s + sum(math.ceil((queue_s + bit_s) / p) * wire_s for p in higher_s)) > queue_s:
        queue_s = again_s
    return queue_s + wire_s
