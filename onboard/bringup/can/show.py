"""Decoded frames as lines for people and as objects for programs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from onboard.bringup.can.decode import DecodedFrame, SummaryLine, Values, named
from protocol.can.guard import Counts
from protocol.generated.can_frames import FRAMES, Signal

_NS = 1_000_000_000
WIDTH = max(len(layout.name) for layout in FRAMES.values())
_SIGNALS = {
    can_id: {s.name: (s, max(0, math.ceil(-math.log10(s.scale)))) for s in layout.signals}
    for can_id, layout in FRAMES.items()
}  # signal and number of decimals
_COUNTS = Counts._fields[1:]  # without the accepted ones


def signals_text(can_id: int, values: Values, units: bool = True) -> str:
    """`steer_rad 0.0012 rad  encoder_count 17 count  state RUNNING`: as many decimals as the signal's scale has."""
    signals = _SIGNALS[can_id]
    return "  ".join(_signal_text(*signals[name], value, units) for name, value in named(can_id, values).items())


def line_of(seen: DecodedFrame) -> str:
    """One frame on one line; its problems first."""
    stamp = "-" if seen.stamp_ns is None else f"{seen.stamp_ns // _NS}.{seen.stamp_ns % _NS // 1000:06d}"
    problems = f"! {', '.join(seen.problems)}" if seen.problems else ""
    told = f"data {seen.data.hex(' ')}" if seen.values is None else signals_text(seen.can_id, seen.values)
    return "  ".join(word for word in (f"{stamp:>12}", f"{seen.name:{WIDTH}}", problems, told) if word)


def row_of(seen: DecodedFrame) -> dict[str, object]:
    """One frame for programs."""
    return {
        "t_s": None if seen.stamp_ns is None else seen.stamp_ns / 1e9,
        "id": seen.can_id,
        "frame": seen.name,
        "node": seen.node,
        "values": None if seen.values is None else named(seen.can_id, seen.values),
        "problems": list(seen.problems),
        "data": seen.data.hex(),
    }


def summary_lines(tallies: Sequence[SummaryLine], others: Mapping[str, int]) -> list[str]:
    """A table of all frames with their problems, followed by the frames that are not in the DBC."""
    heads = ("frame", "frames", "rate/s", *_COUNTS)
    rows = [
        (
            tally.name,
            str(tally.frames),
            "-" if tally.rate_hz is None else f"{tally.rate_hz:.1f}",
            *(str(getattr(tally.counts, name) or "") for name in _COUNTS),
        )
        for tally in tallies
    ]
    return [*aligned([heads, *rows]), *(f"{name}: {count}" for name, count in sorted(others.items()))]


def summary_row(tallies: Sequence[SummaryLine], others: Mapping[str, int]) -> dict[str, object]:
    """Summary for programs."""
    frames = {t.name: {"frames": t.frames, "rate_hz": t.rate_hz, **t.counts._asdict()} for t in tallies}
    return {"summary": frames, "others": dict(sorted(others.items()))}


def aligned(rows: Iterable[Sequence[str]]) -> list[str]:
    """Columns of equal width, the first left-aligned, the others right-aligned."""
    kept = list(rows)
    widths = [max(map(len, column)) for column in zip(*kept)]
    return [
        "  ".join([f"{row[0]:{widths[0]}}", *(f"{cell:>{width}}" for cell, width in zip(row[1:], widths[1:]))]).rstrip()
        for row in kept
    ]


def _signal_text(signal: Signal, decimals: int, value: float | int | str, units: bool) -> str:
    if decimals:
        value = f"{value:.{decimals}f}"
    unit = signal.unit if units and signal.unit != "1" else ""
    return f"{signal.name} {value} {unit}".rstrip()
