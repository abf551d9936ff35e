"""Orders that change nothing of what the rover does: a product, the time; and the one that ends the flight program."""

from __future__ import annotations

from onboard.core.asking import plan_request, stands_on
from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.core.tasks import Tasks
from onboard.records import Event
from protocol.products import LDEM_CODEC
from protocol.transactions import Order, State

_PRODUCT_TICKS = 100
_REBOOT_NS = 1_000_000_000  # for both copies of the report to leave


class Services:
    """tasks: they have the map, whose window around the rover `get ldem` sends. events: the executive takes them."""

    def __init__(self, downlink: Downlink, tasks: Tasks) -> None:
        self._downlink, self._tasks = downlink, tasks
        self.events: list[Event] = []
        self._get_id = 0
        self._reboot_ns: int | None = None
        self.orders = {"get": self._get, "time": self._time, "reboot": self._reboot}

    def reboot_due(self, now_ns: int) -> bool:
        """Whether the flight program is to end with this tick."""
        return self._reboot_ns is not None and now_ns >= self._reboot_ns

    def step(self, ctx: Context) -> None:
        """A product that is packed goes on its way."""
        if "product" in ctx.taken:
            product = ctx.taken["product"]
            self._downlink.offer("ldem", product, LDEM_CODEC)
            self._downlink.report(self._get_id, State.COMPLETED, f"ldem of {len(product)} bytes on its way")

    def give_up(self, reason: str) -> None:
        """The product will not come."""
        self._downlink.report(self._get_id, State.FAILED, reason)

    def _get(self, order: Order, ctx: Context) -> None:
        memory, pose, config = self._tasks.memory, ctx.localisation.pose, self._tasks.config
        if memory is None:
            self._downlink.report(order.request_id, State.FAILED, "no map yet: it comes after a scan or a goto's first")
        elif "product" in ctx.jobs.running:
            self._downlink.report(order.request_id, State.FAILED, "one is being packed already: ask again")
        else:
            request = plan_request(memory, pose, (pose.x_m, pose.y_m), None, config, ctx.fences)
            arguments = (request, stands_on(memory, pose, config), config)
            ctx.jobs.submit("product", arguments, ctx.tick + _PRODUCT_TICKS)
            self._get_id = order.request_id
            self._downlink.report(order.request_id, State.STARTED, "packing the LDEM")

    def _time(self, order: Order, ctx: Context) -> None:
        now_s, utc_s = ctx.now_ns / 1e9, ctx.utc_ns / 1e9
        text = f"{now_s:.2f} s since the start, " + (f"UTC {utc_s:.2f} s" if ctx.utc_ns else "UTC is not known")
        self._downlink.report(order.request_id, State.COMPLETED, text, (now_s, utc_s))

    def _reboot(self, order: Order, ctx: Context) -> None:
        self._reboot_ns = ctx.now_ns + _REBOOT_NS
        self.events.append(Event(ctx.now_ns, "warning", "REBOOT", f"in 1 s, by station {order.station}"))
        self._downlink.report(order.request_id, State.STARTED, "in 1 s; its end shows by a new boot id")
