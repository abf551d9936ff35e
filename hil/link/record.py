"""Record of the link: a file with the fate of every datagram, and the current figures.

The file is CSV: time of the bench in s, direction, number, bytes, kind, fate ("" if it arrives, else the cause of its
loss), and the arrival time of each copy. The same profile, seed and datagrams give the same bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from hil.link.impairment import OVERHEAD_BYTES, Counts, Impairment
from protocol.link.datagrams import DatagramKind
from protocol.link.direct import Word

HEAD = "time_s,direction,number,bytes,kind,fate,arrives_s\n"
_S = 1_000_000_000


class Recorder:
    """Writer of the file. Use it inside `with`. Raises OSError if the file cannot be written."""

    def __init__(self, path: Path) -> None:
        self._kinds = {int(kind): kind.name for kind in (*DatagramKind, *Word)}
        self._file = path.open("w")
        self._numbers: dict[str, int] = {}
        self._file.write(HEAD)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._file.close()

    def note(self, direction: str, datagram: bytes, now_ns: int, fate: str, arrivals_ns: Sequence[int]) -> None:
        """Write one offered datagram. direction: down or up."""
        number = self._numbers[direction] = self._numbers.get(direction, 0) + 1
        kind = self._kinds.get(datagram[0], "") if datagram else ""
        arrives = " ".join(f"{at_ns / _S:.6f}" for at_ns in arrivals_ns)
        self._file.write(f"{now_ns / _S:.6f},{direction},{number},{len(datagram)},{kind},{fate},{arrives}\n")


@dataclass(frozen=True, slots=True)
class Now:
    """Figures of one direction, rates over the time since the last call.

    direction: down or up
    rate_bps: rate of the line
    offered_bps, delivered_bps: with UDP and IP headers
    offered: datagrams since the start
    lost: lost datagrams since the start, by cause
    under_way: datagrams on their way
    blackout: True during a blackout
    """

    direction: str
    rate_bps: float
    offered_bps: float
    delivered_bps: float
    offered: int
    lost: dict[str, int]
    under_way: int
    blackout: bool

    def report(self) -> dict[str, Any]:
        """Fields for JSON."""
        return asdict(self)

    def text(self) -> str:
        """One line for a terminal."""
        causes = ", ".join(f"{count} {cause.replace('_', ' ')}" for cause, count in self.lost.items() if count)
        lost = f"{sum(self.lost.values())} of {self.offered} lost" + (f" ({causes})" if causes else "")
        dark = "BLACKOUT, " if self.blackout else ""
        return (
            f"{self.direction} {dark}{self.offered_bps / 1e3:.1f} kbit/s in, {self.delivered_bps / 1e3:.1f} out "
            f"of {self.rate_bps / 1e3:g}, {lost}, {self.under_way} on the way"
        )


class Meter:
    """Meter of one direction: rates between calls, counts since the start."""

    def __init__(self, direction: str, model: Impairment) -> None:
        self._direction, self._model = direction, model
        self._before, self._before_ns = Counts(), 0

    def now(self, now_ns: int) -> Now:
        """Figures since the last call. Bytes include UDP and IP headers, as the line does."""
        counts, seconds = self._model.counts, max(1, now_ns - self._before_ns) / _S
        offered = counts.offered - self._before.offered
        in_bytes = counts.offered_bytes - self._before.offered_bytes + OVERHEAD_BYTES * offered
        out_bytes = counts.delivered_bytes - self._before.delivered_bytes
        out_bytes += OVERHEAD_BYTES * (counts.delivered - self._before.delivered)
        self._before, self._before_ns = replace(counts), now_ns
        return Now(
            self._direction,
            self._model.rate_bps,
            8 * in_bytes / seconds,
            8 * out_bytes / seconds,
            counts.offered,
            counts.causes(),
            self._model.under_way,
            self._model.dark(now_ns),
        )
