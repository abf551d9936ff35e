"""Orders about the fault table: list active faults, mask a row for a time, clear a row.

A masked row is still monitored and reported when it becomes active, and still suppresses other rows; its response is
not carried out. A mask ends by itself. Rows that guard the rover's life or that people rely on cannot be masked
(`Fault.maskable`).
"""

from __future__ import annotations

from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.records import Event
from protocol.link.transactions import Order, RequestState
from protocol.tables.commands import RefusedError
from protocol.tables.faults import BY_NAME


class Masks:
    """Owner of the masks; call `unmasked` each tick. events: to report; the executive takes them."""

    def __init__(self, downlink: Downlink) -> None:
        self._downlink = downlink
        self._until_ns: dict[str, int] = {}
        self._found: tuple[str, ...] = ()
        self.events: list[Event] = []
        self.orders = {"faults_list": self._list, "faults_clear": self._clear, "faults_mask": self._mask}

    def unmasked(self, found: tuple[str, ...], now_ns: int) -> tuple[str, ...]:
        """Return the active faults whose response is to be carried out."""
        if not self._until_ns:
            self._found = found
            return found
        for name in [name for name, until_ns in self._until_ns.items() if until_ns <= now_ns]:
            self._end(name, now_ns, "its time is over")
        for name in found:
            if name in self._until_ns and name not in self._found:
                self._tell(now_ns, f"{name} is active; masked until {self._until_ns[name] / 1e9:.1f} s")
        self._found = found
        return tuple(name for name in found if name not in self._until_ns)

    def _list(self, order: Order, ctx: Context) -> None:
        masked = [f"{name} for {(until_ns - ctx.now_ns) / 1e9:.0f} s" for name, until_ns in self._until_ns.items()]
        parts = (f"active: {', '.join(self._found) or 'none'}", f"masked: {', '.join(masked) or 'none'}")
        self._downlink.report(
            order.request_id, RequestState.COMPLETED, "; ".join(parts), (_bits(self._found), _bits(self._until_ns))
        )

    def _mask(self, order: Order, ctx: Context) -> None:
        name = str(order.arguments["fault"])
        if not BY_NAME[name].maskable:
            may = ", ".join(row.name for row in BY_NAME.values() if row.maskable)
            raise RefusedError(f"{name} guards life and is never masked; may be: {may}")
        self._until_ns[name] = ctx.now_ns + round(order.number("lasting_s") * 1e9)
        text = f"{name} until {self._until_ns[name] / 1e9:.1f} s, by station {order.station}"
        self._tell(ctx.now_ns, text)
        self._downlink.report(order.request_id, RequestState.COMPLETED, text)

    def _clear(self, order: Order, ctx: Context) -> None:
        name = str(order.arguments["fault"])
        if name in self._until_ns:
            self._end(name, ctx.now_ns, f"ended by station {order.station}")
        ctx.judge_anew.append(name)
        self._downlink.report(order.request_id, RequestState.COMPLETED, f"{name}: no longer masked, checked again")

    def _end(self, name: str, now_ns: int, why: str) -> None:
        del self._until_ns[name]
        self._tell(now_ns, f"{name} no longer: {why}")

    def _tell(self, now_ns: int, text: str) -> None:
        self.events.append(Event(now_ns, "warning", "FAULT_MASKED", text))

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        return (len(self._until_ns), sum(self._until_ns.values()))


def _bits(names: tuple[str, ...] | dict[str, int]) -> int:
    """Return a bit mask with one bit for each row's number, as in telemetry."""
    return sum(1 << BY_NAME[name].number for name in names)
