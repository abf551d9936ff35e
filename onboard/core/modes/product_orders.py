"""The order `get`: a job packs the product, or the tick does if it is small; then the downlink sends it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import TYPE_CHECKING

from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.core.mission.plan_request import plan_request, stands_on
from onboard.core.modes.parameter_orders import ParameterOrders
from onboard.core.modes.tasks import Tasks
from onboard.perception.map import ldem
from onboard.planning.explanation import explain
from protocol.link.transactions import Order, RequestState
from protocol.products import PRODUCTS
from protocol.products.nsp import encode_nsp
from protocol.tables.commands import RefusedError

if TYPE_CHECKING:
    from onboard.perception.map.stop_map import StopMap

PRODUCT_JOBS = {
    "product": "ldem", "product_scan": "scan", "product_record": "record", "product_height_std": "height_std"
}  # fmt: skip
SLICE_BYTES = 1_000_000  # two minutes of a 64 kbit/s line; hashed within one tick
_PRODUCT_TICKS = 100
_OLDER_NS = 1_000_000_000  # the record is written twice a second, so data this old is on the disk
_SPAN_NS = 10_000_000_000
_ONLY_OF_RECORD = frozenset({"from_s", "to_s", "channels"})
_UNREADABLE = frozenset({"DISK_FULL", "RECORD_FAIL"})
_CODECS = {row.name: row.codec for row in PRODUCTS}


class Products:
    """Packer of products. tasks: source of the newest plan and sweep; active: names of the active faults."""

    def __init__(
        self, downlink: Downlink, tasks: Tasks, parameters: ParameterOrders, active: Callable[[], Collection[str]]
    ) -> None:
        self._downlink, self._tasks, self._parameters, self._active = downlink, tasks, parameters, active
        self._asked: dict[str, int] = {}  # job -> request
        self._makers = {
            "ldem": self._ldem,
            "scan": self._scan,
            "nsp": self._nsp,
            "record": self._record,
            "height_std": self._height_std,
        }
        self.orders = {"get": self._get}

    def step(self, ctx: Context) -> None:
        """Offer the packed products to the downlink."""
        for job, product in PRODUCT_JOBS.items():
            if job in ctx.taken:
                data, about = ctx.taken[job] if product == "record" else (ctx.taken[job], "")
                self._offer(self._asked.pop(job), product, data, about)

    def give_up(self, job: str, reason: str) -> None:
        """Report that the product of this job failed."""
        self._downlink.report(self._asked.pop(job), RequestState.FAILED, reason)

    def _offer(self, request_id: int, product: str, data: bytes, about: str = "") -> None:
        if not data:
            self._downlink.report(request_id, RequestState.FAILED, about)
            return
        object_id = self._downlink.offer(product, data, _CODECS[product])
        text = f"{product} of {len(data)} bytes on its way" + (f"; {about}" if about else "")
        self._downlink.report(request_id, RequestState.COMPLETED, text, (object_id,))

    def _get(self, order: Order, ctx: Context) -> None:
        """Start the product of the order. Raises RefusedError if there is nothing to send."""
        product = str(order.arguments["product"])
        if product != "record" and (strange := sorted(_ONLY_OF_RECORD.intersection(order.arguments))):
            raise RefusedError(f"{product} takes no {', '.join(strange)}: these are of `get record`")
        self._makers[product](order, ctx)

    def _begin(self, job: str, order: Order, ctx: Context, arguments: tuple[object, ...]) -> None:
        if job in ctx.jobs.running:
            raise RefusedError("one is being packed already: ask again")
        ctx.jobs.submit(job, arguments, ctx.tick + _PRODUCT_TICKS)
        self._asked[job] = order.request_id
        self._downlink.report(order.request_id, RequestState.STARTED, f"packing the {PRODUCT_JOBS[job]}")

    def _ldem(self, order: Order, ctx: Context) -> None:
        memory, pose, config = self._map(), ctx.localisation.pose, self._parameters.config
        request = plan_request(memory, pose, (pose.x_m, pose.y_m), None, config, ctx.fences)
        self._begin("product", order, ctx, (request, stands_on(memory, pose, config), config))

    def _height_std(self, order: Order, ctx: Context) -> None:
        pose, size_m = ctx.localisation.pose, self._parameters.config.mapping.size_m
        self._begin("product_height_std", order, ctx, (ldem.window(self._map().cells, pose.x_m, pose.y_m, size_m),))

    def _map(self) -> StopMap:
        """Return the rover's map. Raises RefusedError if there is none."""
        if self._tasks.memory is None:
            raise RefusedError("no map yet: it comes after a scan or a goto's first")
        return self._tasks.memory

    def _scan(self, order: Order, ctx: Context) -> None:
        swept = self._tasks.swept
        if swept is None:
            raise RefusedError("no scan yet: it comes with `scan` or the first stop of a goto")
        entry = (swept.pose, swept.stop)
        arguments = (swept.sweep.scans, swept.sweep.tilt, entry, self._parameters.config.rover)
        self._begin("product_scan", order, ctx, arguments)

    def _nsp(self, order: Order, ctx: Context) -> None:
        if self._tasks.latest is None:
            raise RefusedError("no decision yet: it comes after the first scan of a goto")
        told = explain(self._tasks.latest, self._parameters.config.mission)
        self._offer(order.request_id, "nsp", encode_nsp(told))

    def _record(self, order: Order, ctx: Context) -> None:
        if not self._parameters.config.record.path:
            raise RefusedError("no record is kept: record.path is empty")
        if troubles := sorted(_UNREADABLE.intersection(self._active())):
            raise RefusedError(f"the record's disk is in trouble: {', '.join(troubles)}")
        newest_ns = ctx.now_ns - _OLDER_NS
        until_ns = min(newest_ns, round(order.number("to_s") * 1e9) if "to_s" in order.arguments else newest_ns)
        since_ns = round(order.number("from_s") * 1e9) if "from_s" in order.arguments else until_ns - _SPAN_NS
        if since_ns >= until_ns:
            raise RefusedError(
                f"from {since_ns / 1e9:g} s to {until_ns / 1e9:g} s there is nothing; "
                f"the record is sent up to {newest_ns / 1e9:.2f} s now"
            )
        slim = order.arguments.get("channels") == "slim"
        self._begin("product_record", order, ctx, (max(0, since_ns), until_ns, slim, SLICE_BYTES))
