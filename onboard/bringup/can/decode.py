"""Decoder from frames to named signals; checks each frame as the flight program does and counts problems by id."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any, NamedTuple

from onboard.bringup.can.candump import ReceivedFrame
from protocol.can.guard import Counts, Guard
from protocol.generated.can_frames import FRAMES

Values = dict[str, Any]
_CHOICES = {can_id: {s.name: s.choices for s in layout.signals if s.choices} for can_id, layout in FRAMES.items()}


class DecodedFrame(NamedTuple):
    """One decoded frame.

    stamp_ns: time of reception, None if unknown.
    can_id: identifier.
    data: payload.
    name: name in the DBC, or the id.
    node: its sender, None if the frame is not in the DBC.
    values: signals; None for a frame that the flight program drops.
    problems: fields of Counts that the frame raised, with the count if it is more than one ("lost 3"); or the kind of
        frame, if it is not in the DBC.
    """

    stamp_ns: int | None
    can_id: int
    data: bytes
    name: str
    node: str | None
    values: Values | None
    problems: tuple[str, ...]


@dataclass(slots=True)
class Times:
    """Number and times of the received frames of one id."""

    frames: int = 0
    first_ns: int = 0
    last_ns: int = 0


class SummaryLine(NamedTuple):
    """One line of the summary.

    can_id: identifier.
    name: name in the DBC.
    frames: number of frames.
    rate_hz: mean rate, None with fewer than two times.
    counts: the guard's counts.
    """

    can_id: int
    name: str
    frames: int
    rate_hz: float | None
    counts: Counts


class Decoder:
    """Decoder of received frames. `others`: number of frames of each kind that are not in the DBC."""

    def __init__(self) -> None:
        self._guard = Guard()
        self._times: dict[int, Times] = {}
        self.others: Counter[str] = Counter()

    def receive(self, heard: ReceivedFrame) -> DecodedFrame:
        """Decode one frame; its signals are present if it is good."""
        stamp_ns, can_id, data, kind = heard
        layout = FRAMES.get(can_id) if kind == "data" else None
        if layout is None:
            problem = "not in the DBC" if kind == "data" else kind
            name = f"{can_id:#05x}" if kind in ("data", "remote frame") else f"{can_id:#010x}"
            self.others[f"{name} {problem}"] += 1
            return DecodedFrame(stamp_ns, can_id, data, name, None, None, (problem,))
        self._note(can_id, stamp_ns or 0)
        before = self._guard.counts(can_id)
        values = self._guard.receive((can_id, data, stamp_ns or 0))
        problems = _raised(before, self._guard.counts(can_id))
        told = None if values is None else values._asdict()
        return DecodedFrame(stamp_ns, can_id, data, layout.name, layout.sender, told, problems)

    def tallies(self) -> list[SummaryLine]:
        """Tally of each received id of the DBC, in the order of the ids."""
        return [
            SummaryLine(can_id, FRAMES[can_id].name, times.frames, _rate_hz(times), self._guard.counts(can_id))
            for can_id, times in sorted(self._times.items())
        ]

    def _note(self, can_id: int, stamp_ns: int) -> None:
        times = self._times.setdefault(can_id, Times(0, stamp_ns))
        times.frames, times.last_ns = times.frames + 1, stamp_ns


def named(can_id: int, values: Values) -> Values:
    """The values with the names of a value table in place of their numbers."""
    choices = _CHOICES[can_id]
    return {
        name: choices[name][value] if name in choices and value < len(choices[name]) else value
        for name, value in values.items()
    }


def _rate_hz(times: Times) -> float | None:
    span_ns = times.last_ns - times.first_ns
    return (times.frames - 1) * 1e9 / span_ns if span_ns > 0 else None


def _raised(before: Counts, after: Counts) -> tuple[str, ...]:
    if after[1:] == before[1:]:  # only the count of accepted frames changed
        return ()
    steps = [(field, now - then) for field, then, now in zip(Counts._fields[1:], before[1:], after[1:])]
    return tuple(field if step == 1 else f"{field} {step}" for field, step in steps if step)
