"""Bus load and worst-case response times of the DBC's frames (Davis, Burns, Bril, Lukkien 2007, sufficient form).

Three cases: OPERATION, every regular frame at its shortest interval (the axis sweeps); EMERGENCY, every node asserts
its stop as well and the axis stands; EVERYTHING, both at once, which lasts less than one interval and bounds the load.

A frame's response time R = J + w + C: jitter, queueing behind one lower frame already on the wire (B) and behind every
higher frame that is released meanwhile, and its own bits. Schedulable when R <= period for each frame. J is 0: releases
are modelled as sporadic with the shortest interval of the DBC.
"""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

import cantools

DBC = Path(__file__).resolve().parent.parent / "protocol" / "rover.dbc"


class Case(Enum):
    """What happens on the bus."""

    OPERATION = "operation"
    EMERGENCY = "emergency"
    EVERYTHING = "everything"


class Row(NamedTuple):
    """One frame: shortest interval, time on the wire with every stuff bit, response time, share of the bus."""

    name: str
    can_id: int
    period_s: float
    wire_s: float
    response_s: float
    load_ratio: float


def worst_bits(data_bytes: int) -> int:
    """Bits of a standard data frame with the most stuff bits, interframe space included (Davis 2007, Eq. 1)."""
    exposed = 34 + 8 * data_bytes
    return exposed + 13 + (exposed - 1) // 4


def analyse(case: Case, dbc_path: Path = DBC) -> list[Row]:
    """Rows in the order of priority. Raises ValueError for a frame without interval, or when the bus is overloaded."""
    database: Any = cantools.database.load_file(dbc_path)
    bit_s = 1.0 / database.dbc.attributes["BusSpeed"].value
    messages = sorted((m for m in database.messages if _takes_part(m, case)), key=lambda m: m.frame_id)
    frames = [(m.name, m.frame_id, _interval_s(m, case), worst_bits(m.length) * bit_s) for m in messages]
    if sum(wire / period for _, _, period, wire in frames) >= 1.0:
        raise ValueError("the bus is overloaded: no response time is bounded")
    return [
        Row(name, can_id, period, wire, _response_s(frames, index, bit_s), wire / period)
        for index, (name, can_id, period, wire) in enumerate(frames)
    ]


def _takes_part(message: Any, case: Case) -> bool:
    event = message.dbc.attributes.get("GenMsgSendType")
    return case is not Case.OPERATION or event is None or event.value != 1


def _interval_s(message: Any, case: Case) -> float:
    """The shortest regular interval of a frame; where it has none, its delay time."""
    attributes = message.dbc.attributes
    fast = () if case is Case.EMERGENCY else ("GenMsgCycleTimeFast",)
    for key in (*fast, "GenMsgCycleTime", "GenMsgDelayTime"):
        if key in attributes and attributes[key].value:
            return float(attributes[key].value) / 1000.0
    raise ValueError(f"{message.name} has neither a cycle time nor a delay time")


def _response_s(frames: list[tuple[str, int, float, float]], index: int, bit_s: float) -> float:
    """Queueing delay by fixed-point iteration; blocking by any frame, own ones included (the sufficient test)."""
    _, _, _, wire = frames[index]
    blocking = max([f[3] for f in frames[index:]])
    queue = blocking
    while True:
        again = blocking + sum(math.ceil((queue + bit_s) / f[2]) * f[3] for f in frames[:index])
        if again <= queue:
            return queue + wire
        queue = again


def main() -> None:
    """Prints the tables."""
    for case in Case:
        rows = analyse(case)
        print(f"{case.value:28} {'id':>5} {'period':>8} {'wire':>8} {'response':>9} {'load':>7}")
        for r in rows:
            print(
                f"{r.name:28} {r.can_id:#05x} {r.period_s * 1e3:6.0f}ms {r.wire_s * 1e6:6.0f}us "
                f"{r.response_s * 1e3:7.2f}ms {r.load_ratio:6.2%}"
            )
        print(f"{'load':28} {sum(r.load_ratio for r in rows):.1%}\n")


if __name__ == "__main__":
    main()
