"""Control lease: which operator station may command. A small state machine over stations and times.

    free ---- ask, or a command that needs it -------> held by that station
    held ---- its holder releases it ----------------> held by the first in the queue, else free
    held ---- no datagram of its holder for lease_s -> held by the first in the queue, else free

Rule 1: commands that halt the rover and queries need no lease and take none.
Rule 2: any authenticated datagram of the holder keeps the lease, so only a lost link ends it, not a pause in driving.
Rule 3: stations that ask wait in a queue; one that has fallen silent itself is skipped when its turn comes.
After a start nobody holds the lease: the stations ask again. The rover's own orders (of a sequence) need no lease.
"""

from __future__ import annotations

from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.records import Event
from protocol.link.transactions import Order, RequestState
from protocol.tables.commands import RefusedError, command


class Lease:
    """Lease state.

    holder: key id of the station that holds it; 0: nobody.
    lease_s: longest silence of a holder.
    events: to report; the executive takes them.
    """

    def __init__(self, lease_s: float, downlink: Downlink) -> None:
        self._downlink, self._silence_ns = downlink, round(lease_s * 1e9)
        self.holder = 0
        self._line: list[Order] = []  # queue of requests, one of each station, the oldest first
        self.events: list[Event] = []
        downlink.permit(self.permit)
        self.orders = {"lease_ask": self._ask, "lease_release": self._release, "lease_show": self._show}

    def permit(self, name: str, station: int) -> None:
        """Raise RefusedError if another station holds the lease that the command needs. Never takes the lease."""
        if self.holder not in (0, station) and station and not command(name).free:
            raise RefusedError(
                f"{command(name).typed}: station {self.holder} holds the lease (heard "
                f"{self._silent_ns(self.holder) / 1e9:.0f} s ago); allowed: stop, safe, questions, "
                "`lease ask`"
            )

    def check(self, order: Order, ctx: Context) -> None:
        """Take a free lease for the order's station if the command needs it. Raises RefusedError as `permit` does."""
        self.permit(order.name, order.station)
        if not self.holder and order.station and not command(order.name).free:
            self._give(order.station, ctx, "it was free")

    def step(self, ctx: Context) -> None:
        """Pass the lease on when its holder has fallen silent."""
        if self.holder and self._silent_ns(self.holder) > self._silence_ns:
            self._pass_on(ctx, f"station {self.holder} was not heard for {self._silence_ns / 1e9:.0f} s")

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        return (self.holder, len(self._line))

    # -- orders ------------------------------------------------------------------------------------------------

    def _ask(self, order: Order, ctx: Context) -> None:
        if self.holder in (0, order.station):
            if not self.holder:
                self._give(order.station, ctx, "asked for")
            self._downlink.report(order.request_id, RequestState.COMPLETED, f"station {order.station} holds it")
            return
        for other in [other for other in self._line if other.station == order.station]:
            self._line.remove(other)
            self._downlink.report(other.request_id, RequestState.CANCELLED, "asked for again")
        self._line.append(order)
        self._tell(ctx, f"station {order.station} asks for it, station {self.holder} holds it")
        self._downlink.report(order.request_id, RequestState.STARTED, f"station {self.holder} holds it and was told")

    def _release(self, order: Order, ctx: Context) -> None:
        if order.station != self.holder:
            waiting = [other for other in self._line if other.station == order.station]
            if not waiting:
                raise RefusedError(f"station {order.station} does not hold the lease: {self._words()}")
            self._line.remove(waiting[0])
            self._downlink.report(waiting[0].request_id, RequestState.CANCELLED, "no longer asked for")
            self._downlink.report(order.request_id, RequestState.COMPLETED, "no longer asked for")
            return
        self._pass_on(ctx, f"station {order.station} released it")
        self._downlink.report(order.request_id, RequestState.COMPLETED, self._words())

    def _show(self, order: Order, ctx: Context) -> None:
        data = (self.holder, *(other.station for other in self._line))
        self._downlink.report(order.request_id, RequestState.COMPLETED, self._words(), data)

    # -- holder -----------------------------------------------------------------------------------------------

    def _pass_on(self, ctx: Context, why: str) -> None:
        self.holder = 0
        while self._line:
            order = self._line.pop(0)
            if self._silent_ns(order.station) <= self._silence_ns:
                self._give(order.station, ctx, why)
                self._downlink.report(order.request_id, RequestState.COMPLETED, why)
                return
            self._downlink.report(order.request_id, RequestState.FAILED, "not heard any more when its turn came")
        self._tell(ctx, f"free: {why}")

    def _give(self, station: int, ctx: Context, why: str) -> None:
        self.holder = station
        self._tell(ctx, f"station {station} holds it: {why}")

    def _silent_ns(self, station: int) -> int:
        return self._downlink.now_ns - self._downlink.heard_ns.get(station, 0)

    def _words(self) -> str:
        line = ", ".join(str(order.station) for order in self._line)
        waits = f"; waiting: {line}" if line else ""
        if not self.holder:
            return "nobody holds it" + waits
        return f"station {self.holder} holds it, heard {self._silent_ns(self.holder) / 1e9:.0f} s ago{waits}"

    def _tell(self, ctx: Context, text: str) -> None:
        self.events.append(Event(ctx.now_ns, "info", "LEASE", text))
