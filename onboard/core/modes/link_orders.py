"""Orders about the link itself: the key epoch, and the contact windows outside of which the rover does not send."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.records import Event
from onboard.records.status import EPOCH, Save, SaveResult
from protocol.link.contacts import Windows, windows
from protocol.link.transactions import Order, RequestState
from protocol.tables.commands import RefusedError

KEPT = EPOCH


class LinkOrders:
    """Owner of the key epoch.

    epoch: in force now.
    kept: the epoch in force at the start, as the shell gives it.
    saves: data for the shell to store.
    events: to report; the executive takes them.

    Windows end with the program: they are in onboard time, which restarts at each start.
    """

    def __init__(self, kept: bytes, downlink: Downlink) -> None:
        self._downlink = downlink
        self.epoch = int(kept) if kept.isdigit() else 0
        self.saves: list[Save] = []
        self.events: list[Event] = []
        self._switching: list[tuple[int, int]] = []  # request ids and the requested epochs
        self.orders = {"keys_rotate": self._switch, "contacts_set": self._set, "contacts_clear": self._clear}

    def receive(self, saved: Sequence[SaveResult], now_ns: int) -> None:
        """Process the link port's results of an epoch switch."""
        for name, error in saved:
            if name != EPOCH or not self._switching:
                continue
            request_id, epoch = self._switching.pop(0)
            if error:
                self._downlink.report(request_id, RequestState.FAILED, error)
                continue
            self.epoch = epoch
            self.events.append(Event(now_ns, "info", "KEYS", f"key epoch {epoch} is in force"))
            self._downlink.report(request_id, RequestState.COMPLETED, f"key epoch {epoch} is in force")

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        return (self.epoch, len(self._switching), len(self._downlink.windows.spans))

    def _switch(self, order: Order, ctx: Context) -> None:
        epoch = round(order.number("epoch"))
        if epoch <= self.epoch:
            raise RefusedError(f"key epoch {self.epoch} is in force: only a later one can follow")
        if self._switching:
            raise RefusedError("another switch is under way")
        self._switching.append((order.request_id, epoch))
        self.saves.append(Save(EPOCH, b"%d" % epoch))
        self._downlink.report(order.request_id, RequestState.STARTED, "the new epoch is kept first")

    def _set(self, order: Order, ctx: Context) -> None:
        spans = order.points("windows_s")
        try:
            found = windows((round(begin * 1e9), round(end * 1e9)) for begin, end in spans)
        except ValueError as error:
            raise RefusedError(str(error)) from error
        if found.over(ctx.now_ns):
            raise RefusedError(f"all of these windows are over: it is {ctx.now_ns / 1e9:.1f} s on board")
        self._put(found, order, ctx, f"{len(found.spans)} windows, the rover is silent outside")

    def _clear(self, order: Order, ctx: Context) -> None:
        self._put(Windows(), order, ctx, "none: the link may carry at any time")

    def _put(self, found: Windows, order: Order, ctx: Context, text: str) -> None:
        self._downlink.windows = found
        self.events.append(Event(ctx.now_ns, "info", "CONTACTS", f"{text}; by station {order.station}"))
        self._downlink.report(order.request_id, RequestState.COMPLETED, text)
