"""Bounded queue of reports to send: those of halting requests first, then one of each station in turn."""

from __future__ import annotations

from itertools import zip_longest

from protocol.link.datagrams import line_bytes
from protocol.link.reports import Report, encode_report

_COPIES, _COPY_NS = 2, 200_000_000
_MOST_SAID, _HALTS = 256, 0  # most requests of a station; key of the halting queue, as stations count from 1
_Said = dict[int, list[tuple[int, bytes]]]  # waiting reports: request's key -> (due_ns, payload), in order of creation


def key_of(station: int, request_id: int) -> int:
    """Combine station and request id into one key."""
    return station << 32 | request_id


class ReportQueue:
    """Queue of rule 7 of `protocol.link.transactions`. The oldest request of a station with too many is dropped."""

    def __init__(self) -> None:
        self._queues: dict[int, _Said] = {_HALTS: {}}  # by station

    def __contains__(self, key: int) -> bool:
        return any(key in said for said in self._queues.values())

    def drop(self, key: int) -> None:
        """Delete the waiting reports of a request, which are out of date."""
        for said in self._queues.values():
            said.pop(key, None)

    def add(self, report: Report, halts: bool, now_ns: int) -> None:
        """Queue a report and its copies. halts: True for a request that halts the rover."""
        payload, key = encode_report(report), key_of(report.station, report.request_id)
        said = self._queues.setdefault(_HALTS if halts else report.station, {})
        copies = [(now_ns + n * _COPY_NS, payload) for n in range(_COPIES)]
        said[key] = (said.get(key, []) + copies)[-2 * _COPIES :]
        if len(said) > _MOST_SAID:
            del said[next(iter(said))]

    def waiting(self, now_ns: int) -> bool:
        """True if a report is due."""
        return any(due_ns <= now_ns for said in self._queues.values() for rows in said.values() for due_ns, _ in rows)

    def send(self, now_ns: int, budget_bytes: float) -> list[bytes]:
        """Return due payloads in order, as long as their bytes on the line fit the budget."""
        out: list[bytes] = []
        for said, key in self._in_turn():
            for row in [row for row in said[key] if row[0] <= now_ns]:
                cost = line_bytes(len(row[1]))
                if cost > budget_bytes:
                    return out
                out.append(row[1])
                budget_bytes -= cost
                said[key].remove(row)
            if not said[key]:
                del said[key]
        return out

    def _in_turn(self) -> list[tuple[_Said, int]]:
        """Queue and key of each waiting request, in sending order."""
        halts, *others = ([(said, key) for key in said] for said in self._queues.values())
        return [*halts, *(row for rows in zip_longest(*others) for row in rows if row is not None)]
