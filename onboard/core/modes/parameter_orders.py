"""Orders about parameters: list, get, set, save. The request to save is an output of the core, its result an input."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.config import Config
from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.parameters import TABLE, listing, recalled
from onboard.records import Event
from onboard.records.status import Save, SaveResult
from protocol.link.transactions import Order, RequestState

KEPT = "parameters"


class ParameterOrders:
    """Owner of the configuration in flight.

    saves: data for the shell to store; the caller takes them.
    events: to report; the executive takes them.
    """

    def __init__(self, config: Config, kept: bytes, downlink: Downlink) -> None:
        self._downlink = downlink
        self.settings, dropped = recalled(config, kept)
        self.events = [Event(0, "warning", "PARAMETER", line) for line in dropped]
        self.saves: list[Save] = []
        self._saving: tuple[int, int] | None = None  # request and the version that is being written
        self.orders = {
            "param_list": self._list,
            "param_get": self._get,
            "param_set": self._set,
            "param_save": self._save,
        }

    @property
    def config(self) -> Config:
        """The configuration with the parameters as set now."""
        return self.settings.config

    def receive(self, saved: Sequence[SaveResult]) -> None:
        """Process the shell's results of saves."""
        for name, error in saved:
            if name == KEPT and self._saving is not None:
                request_id, version = self._saving
                self._saving = None
                state = RequestState.FAILED if error else RequestState.COMPLETED
                self._downlink.report(request_id, state, error or f"version {version} is kept")

    def _list(self, order: Order, ctx: Context) -> None:
        object_id = self._downlink.offer("parameters", listing(self.settings).encode(), "text")
        self._downlink.report(
            order.request_id, RequestState.COMPLETED, f"version {self.settings.version}", (object_id,)
        )

    def _get(self, order: Order, ctx: Context) -> None:
        name = str(order.arguments["parameter"])
        try:
            text = f"{name} = {self.settings.value(name)}, {TABLE[name].takes}; {TABLE[name].about.partition(';')[0]}"
        except ValueError as error:
            self._downlink.report(order.request_id, RequestState.FAILED, str(error))
            return
        last = self.settings.last(name)
        made = f"; was {last.old} before version {last.version}, station {last.station}" if last else ""
        self._downlink.report(order.request_id, RequestState.COMPLETED, text + made)

    def _set(self, order: Order, ctx: Context) -> None:
        name, text = str(order.arguments["parameter"]), str(order.arguments["value"])
        try:
            who = (ctx.now_ns, self.config.link.boot_count, order.station)
            self.settings = self.settings.set(name, text, who)
        except ValueError as error:
            self._downlink.report(order.request_id, RequestState.FAILED, str(error))
            return
        change = self.settings.changes[-1]
        self.events.append(Event(ctx.now_ns, "info", "PARAMETER", str(change)))
        told = f"{name} {change.old} -> {change.new}, {TABLE[name].takes}; version {change.version}, not saved"
        self._downlink.report(order.request_id, RequestState.COMPLETED, told)

    def _save(self, order: Order, ctx: Context) -> None:
        if not self.config.state.folder:
            self._downlink.report(
                order.request_id, RequestState.FAILED, "no folder to keep them in: state.folder is empty"
            )
        elif self._saving is not None:
            self._downlink.report(order.request_id, RequestState.FAILED, "they are being written already: ask again")
        else:
            self._saving = (order.request_id, self.settings.version)
            self.saves.append(Save(KEPT, self.settings.to_json()))
            self._downlink.report(order.request_id, RequestState.STARTED, f"version {self.settings.version}")

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        return (self.settings.version, self._saving is not None)
