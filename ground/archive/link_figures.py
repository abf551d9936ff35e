"""Figures of the link from what an archive has of it: what came, what was lost or refused, how fast. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple


class Row(NamedTuple):
    """One datagram. utc_ns: when it was heard or sent; counter, boot_id: None where it had none."""

    utc_ns: int
    direction: str
    verdict: str
    size: int
    counter: int | None
    boot_id: int | None


class Figures(NamedTuple):
    """span_s: from the first to the last datagram. lost: counters of the rover that never came, of those between.

    rates: bytes a second with 28 for UDP and IP each. silent_s: longest time without a word of the rover. refused: by
    the check that failed.
    """

    span_s: float
    heard: int
    lost: int
    loss_ratio: float | None
    late: int
    down_bytes_ps: float | None
    up_bytes_ps: float | None
    sent: int
    silent_s: float | None
    refused: dict[str, int]


_UDP_IP = 28


def figures(rows: Iterable[Row]) -> Figures:
    """The figures of datagrams in the order of their times; what two stations heard counts once."""
    seen: dict[int, set[int]] = {}
    refused: Counter[str] = Counter()
    times: list[int] = []
    heard = late = sent = down = up = 0
    first = last = None
    for row in rows:
        first, last = row.utc_ns if first is None else first, row.utc_ns
        if row.direction == "up":
            sent, up = sent + 1, up + row.size + _UDP_IP
        elif row.verdict != "ok":
            refused[row.verdict] += 1
        elif row.counter is not None and row.boot_id is not None:
            known = seen.setdefault(row.boot_id, set())
            if row.counter in known:
                continue
            late += bool(known) and row.counter < max(known)
            known.add(row.counter)
            heard, down = heard + 1, down + row.size + _UDP_IP
            times.append(row.utc_ns)
    span_s = 0.0 if first is None or last is None else (last - first) / 1e9
    lost = sum(max(known) - min(known) + 1 - len(known) for known in seen.values())
    return Figures(
        span_s, heard, lost, lost / (heard + lost) if heard else None, late, *(_rate(n, span_s) for n in (down, up)),
        sent, max((b - a for a, b in pairwise(times)), default=0) / 1e9 if times else None, dict(refused),
    )  # fmt: skip


def _rate(size: int, span_s: float) -> float | None:
    return size / span_s if span_s else None


def words(found: Figures) -> list[str]:
    """Lines for people."""
    def told(value: float | None, form: str) -> str:
        return "?" if value is None else form.format(value)

    refused = ", ".join(f"{kind} {count}" for kind, count in sorted(found.refused.items())) or "none"
    return [
        f"{'over':16} {found.span_s:.1f} s",
        f"{'heard':16} {found.heard} datagrams, {found.late} out of order",
        f"{'lost':16} {found.lost} datagrams, {told(found.loss_ratio and 100 * found.loss_ratio, '{:.1f} %')}"
        if found.loss_ratio else f"{'lost':16} {found.lost} datagrams",
        f"{'refused':16} {refused}",
        f"{'down':16} {told(found.down_bytes_ps, '{:.0f} B/s')}",
        f"{'up':16} {told(found.up_bytes_ps, '{:.0f} B/s')}, {found.sent} datagrams",
        f"{'longest silence':16} {told(found.silent_s, '{:.1f} s')}",
    ]
