"""Link statistics from archived datagrams: received, lost and refused datagrams, data rates, silences. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple


class DatagramRow(NamedTuple):
    """One datagram.

    utc_ns: time of reception or of sending.
    direction: "up" or "down".
    verdict: "ok", or the check that failed.
    size: bytes of the datagram.
    counter, boot_id: of the datagram; None if it has none.
    run: station run that recorded it.
    """

    utc_ns: int
    direction: str
    verdict: str
    size: int
    counter: int | None
    boot_id: int | None
    run: int = 0


class Figures(NamedTuple):
    """Statistics of the link.

    span_s: time during which a station was open: from its first to its last datagram, overlaps counted once.
    heard: downlink datagrams received, each once.
    lost: downlink counters never received, between the lowest and highest counter that one station run received.
    loss_ratio: lost / (heard + lost); None if nothing was received.
    late: datagrams received out of order.
    down_bytes_ps, up_bytes_ps: data rates in B/s, each datagram with 28 B for UDP and IP; None if span_s is 0.
    sent: datagrams sent.
    silent_s: longest time between two received datagrams while a station was open; None if nothing was received.
    refused: refused datagrams, by the check that failed.
    apart_s: time between station runs, while no station was open.
    apart: counters that passed between station runs.
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
    apart_s: float = 0.0
    apart: int = 0


_UDP_IP = 28


def figures(rows: Iterable[DatagramRow]) -> Figures:
    """Compute the statistics of datagrams in time order. A datagram that two stations received counts once."""
    seen: dict[int, set[int]] = {}
    heard_by: dict[int, dict[int, Spread]] = {}
    opened: dict[int, Spread] = {}
    refused: Counter[str] = Counter()
    times: list[int] = []
    heard = late = sent = down = up = 0
    for row in rows:
        _widen(opened, row.run, row.utc_ns)
        if row.direction == "up":
            sent, up = sent + 1, up + row.size + _UDP_IP
        elif row.verdict != "ok":
            refused[row.verdict] += 1
        elif row.counter is not None and row.boot_id is not None:
            _widen(heard_by.setdefault(row.boot_id, {}), row.run, row.counter)
            known = seen.setdefault(row.boot_id, set())
            if row.counter in known:
                continue
            late += bool(known) and row.counter < max(known)
            known.add(row.counter)
            heard, down = heard + 1, down + row.size + _UDP_IP
            times.append(row.utc_ns)
    spans = _merged(opened.values())
    span_s, apart_s = sum(b - a for a, b in spans) / 1e9, sum(b[0] - a[1] for a, b in pairwise(spans)) / 1e9
    listened = {boot: _merged(spreads.values()) for boot, spreads in heard_by.items()}
    lost = sum(b - a + 1 for spreads in listened.values() for a, b in spreads) - heard
    apart = sum(b[0] - a[1] - 1 for spreads in listened.values() for a, b in pairwise(spreads))
    silences = (b - a for a, b in pairwise(times) if any(begin <= a and b <= end for begin, end in spans))
    return Figures(
        span_s,
        heard,
        lost,
        lost / (heard + lost) if heard else None,
        late,
        *(_rate(n, span_s) for n in (down, up)),
        sent,
        max(silences, default=0) / 1e9 if times else None,
        dict(refused),
        apart_s,
        apart,
    )


Spread = tuple[int, int]


def _widen(spreads: dict[int, Spread], key: int, value: int) -> None:
    low, high = spreads.get(key, (value, value))
    spreads[key] = (min(low, value), max(high, value))


def _merged(spreads: Iterable[Spread]) -> list[Spread]:
    """Merge spreads that overlap or touch, in order: what several stations had open at once counts once."""
    found: list[Spread] = []
    for low, high in sorted(spreads):
        if found and low <= found[-1][1] + 1:
            found[-1] = (found[-1][0], max(high, found[-1][1]))
        else:
            found.append((low, high))
    return found


def _rate(size: int, span_s: float) -> float | None:
    return size / span_s if span_s else None


def words(found: Figures) -> list[str]:
    """Return the statistics as lines for people."""

    def told(value: float | None, form: str) -> str:
        return "?" if value is None else form.format(value)

    refused = ", ".join(f"{kind} {count}" for kind, count in sorted(found.refused.items())) or "none"
    return [
        f"{'over':16} {found.span_s:.1f} s",
        f"{'heard':16} {found.heard} datagrams, {found.late} out of order",
        f"{'lost':16} {found.lost} datagrams, {told(found.loss_ratio and 100 * found.loss_ratio, '{:.1f} %')}"
        if found.loss_ratio
        else f"{'lost':16} {found.lost} datagrams",
        *[f"{'no station open':16} {found.apart_s:.1f} s, {found.apart} datagrams unheard"] * bool(found.apart_s),
        f"{'refused':16} {refused}",
        f"{'down':16} {told(found.down_bytes_ps, '{:.0f} B/s')}",
        f"{'up':16} {told(found.up_bytes_ps, '{:.0f} B/s')}, {found.sent} datagrams",
        f"{'longest silence':16} {told(found.silent_s, '{:.1f} s')}",
    ]
