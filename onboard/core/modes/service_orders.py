"""Orders of service: report the time, and end the flight program."""

from __future__ import annotations

from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.records import Event
from protocol.link.transactions import Order, RequestState

_REBOOT_NS = 1_000_000_000  # for both copies of the report to be sent


class Services:
    """Time and reboot orders. events: to report; the executive takes them."""

    def __init__(self, downlink: Downlink) -> None:
        self._downlink = downlink
        self.events: list[Event] = []
        self._reboot_ns: int | None = None
        self.orders = {"time": self._time, "reboot": self._reboot}

    def reboot_due(self, now_ns: int) -> bool:
        """Return whether the flight program ends with this tick."""
        return self._reboot_ns is not None and now_ns >= self._reboot_ns

    def _time(self, order: Order, ctx: Context) -> None:
        now_s, utc_s = ctx.now_ns / 1e9, ctx.utc_ns / 1e9
        text = f"{now_s:.2f} s since the start, " + (f"UTC {utc_s:.2f} s" if ctx.utc_ns else "UTC is not known")
        self._downlink.report(order.request_id, RequestState.COMPLETED, text, (now_s, utc_s))

    def _reboot(self, order: Order, ctx: Context) -> None:
        self._reboot_ns = ctx.now_ns + _REBOOT_NS
        self.events.append(Event(ctx.now_ns, "warning", "REBOOT", f"in 1 s, by station {order.station}"))
        self._downlink.report(order.request_id, RequestState.STARTED, "in 1 s; its end shows by a new boot id")
