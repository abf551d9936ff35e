"""Orders about fences: add, clear, list. Each change is saved if a state folder is configured."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.planning.fences import Fence, from_json, to_json
from onboard.records import Event
from onboard.records.status import Save, SaveResult
from protocol.link.transactions import Order, RequestState
from protocol.tables.commands import RefusedError, named

KEPT = "fences"
_MOST = 16


class FenceOrders:
    """Owner of the fences.

    fences: in force now.
    saves: data for the shell to store; the caller takes them.
    events: to report; the executive takes them.
    """

    def __init__(self, keeps: bool, kept: bytes, downlink: Downlink) -> None:
        self._downlink, self._keeps = downlink, keeps
        self.events: list[Event] = []
        self.saves: list[Save] = []
        self._saving: list[tuple[int, str]] = []  # requests that wait for their save, and the text of their reports
        self.fences: tuple[Fence, ...] = ()
        try:
            self.fences = from_json(kept)
        except ValueError as error:
            self.events.append(Event(0, "error", "FENCE", f"the kept fences cannot be read: {error}"))
        self.orders = {"fence_add": self._add, "fence_clear": self._clear, "fence_list": self._list}

    def receive(self, saved: Sequence[SaveResult]) -> None:
        """Process the shell's results of saves."""
        for name, error in saved:
            if name == KEPT and self._saving:
                request_id, text = self._saving.pop(0)
                self._downlink.report(request_id, RequestState.COMPLETED, f"{text}; {error or 'kept'}")

    def _add(self, order: Order, ctx: Context) -> None:
        name = str(order.arguments["fence"])
        others = tuple(fence for fence in self.fences if fence.name != name)
        if len(others) == _MOST:
            raise RefusedError(f"{_MOST} fences are in force: clear one first")
        fence = Fence(name, str(order.arguments["kind"]), order.points("corners_m"))
        if fence.crosses_itself:
            raise RefusedError(f"the edges of {name} cross: give its corners in their order around it")
        self.fences = (*others, fence)
        self._changed(order, ctx, f"{name}, {order.arguments['kind']} of {len(self.fences[-1].corners_m)} corners")

    def _clear(self, order: Order, ctx: Context) -> None:
        name = order.arguments.get("fence")
        if name is not None:
            named(str(name), [fence.name for fence in self.fences], "fence")
        self.fences = tuple(fence for fence in self.fences if name is not None and fence.name != name)
        self._changed(order, ctx, f"cleared {name or 'all'}, {len(self.fences)} left")

    def _changed(self, order: Order, ctx: Context, text: str) -> None:
        self.events.append(Event(ctx.now_ns, "info", "FENCE", f"{text}, by station {order.station}"))
        if self._keeps:
            self.saves.append(Save(KEPT, to_json(self.fences)))
            self._saving.append((order.request_id, text))
            self._downlink.report(order.request_id, RequestState.STARTED, text)
        else:
            self._downlink.report(order.request_id, RequestState.COMPLETED, f"{text}; ends with the program")

    def _list(self, order: Order, ctx: Context) -> None:
        lines = [f"{f.name} {f.kind} " + " ".join(f"{x:g} {y:g}" for x, y in f.corners_m) for f in self.fences]
        object_id = self._downlink.offer("fences", ("\n".join(lines) or "none").encode(), "text")
        self._downlink.report(order.request_id, RequestState.COMPLETED, f"{len(lines)} in force", (object_id,))

    def digest_items(self) -> tuple[float, ...]:
        """Values of this state that go into the state digest."""
        return (len(self._saving), *(part for fence in self.fences for corner in fence.corners_m for part in corner))
