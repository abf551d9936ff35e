"""Both real ends of the link and the model between them, on one virtual clock of 10 ms ticks.

    onboard.core.downlink.Downlink --- sealed --> hil.link.impairment --- opened --> ground.link.session.Session
          the flight program's end     <----------  both directions  ----------      the station's end

Sealing, opening, token bucket, priorities, transactions, events, bulk and telemetry are the flight code. zenoh, disk
and the rest of the rover are left out: an order is completed in the tick in which it arrives, unless `act` does
otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ground.link.news import News
from ground.link.saved_state import SavedLinkState
from ground.link.session import Session
from hil.link.impairment import Impairment, Profile, both_directions, load_profile
from onboard.config import Link
from onboard.core.downlink import Downlink
from onboard.core.telemetry import TelemetryInputs
from onboard.drivers.link.port import checked
from onboard.records import Estimate, Pose, PowerState, WheelState
from protocol.link.datagrams import DOWNLINK_KEY_ID, DatagramKind, Opener, Sealer, bench_keys, line_bytes
from protocol.link.transactions import Order, Requester, RequestState
from protocol.tables.modes import Mode, Phase

S = 1_000_000_000
TICK_NS = 10_000_000
KEYS = bench_keys(7)
STATION = 1
_STANDING = Estimate(Pose(3.0, 4.0, 0.5, 0.01, -0.02, 0.3), np.diag([0.01, 0.03, 0.0, 0.0004]), 0.0, 0.0)
VIEW = TelemetryInputs(
    mode=Mode.STANDBY,
    phase=Phase.NONE,
    estimate=_STANDING,
    goal_m=(6.0, 8.0),
    wheels=tuple(WheelState(0.1 * n, 9.0, 0.5 * n, n, 0) for n in (1, 2, 3, 4)),
    power=PowerState(25.25, 3.5, 0.87, 21.0, 0),
    job="map",
    job_ratio=0.25,
)  # every message has a value: the most that housekeeping takes


def profile(name: str, **changes: float) -> Profile:
    """Return a named link with some of its values changed."""
    return replace(load_profile(name), **changes)


class RoverEnd:
    """The flight program's part of the link: its core's end and the keys of its port."""

    def __init__(self, rate_bps: float, boot_id: int = 1) -> None:
        key = KEYS.downlink.key(DOWNLINK_KEY_ID)
        assert key is not None
        self.boot_id = boot_id
        self.core = Downlink(Link(rate_bps=rate_bps))
        self._sealer = Sealer(key, DOWNLINK_KEY_ID, boot_id)
        self.opener = Opener(KEYS.command, boot_id=boot_id)

    def receive(self, datagrams: list[bytes], now_ns: int) -> list[Order]:
        messages = [checked(self.opener, datagram, now_ns) for datagram in datagrams]
        return self.core.receive(messages, now_ns)

    def send(self, now_ns: int) -> list[tuple[int, bytes]]:
        """Return (kind, datagram) of all that may be sent now."""
        return [(kind, self._sealer.seal(kind, payload)) for kind, payload in self.core.send(now_ns)]


@dataclass
class World:
    """One link with a rover and a station on it.

    `tick` is 10 ms; `run` continues until a time or until `done` is true.
    """

    link: Profile
    seed: int
    view: TelemetryInputs = VIEW
    act: Callable[[World, Order], None] | None = None
    hear: Callable[[World, News], None] | None = None
    remembered: int = 2048  # requests in the session
    now_ns: int = 0
    executed: list[Order] = field(default_factory=list)
    line_bytes: dict[int, int] = field(default_factory=dict)  # bytes put on the downlink so far, by kind
    verdicts: dict[str, int] = field(default_factory=dict)  # of datagrams that reached the ground
    kept: list[bytes] | None = None  # a list: chunks as in the station's archive; it loads them after a restart

    def __post_init__(self) -> None:
        self.rover = RoverEnd(self.link.down_bps)
        self.session = self._new_session()
        self.down, self.up = both_directions(self.link, self.seed)
        self._wake_ns: int | None = None

    def _new_session(self, counter: int = 0, next_id: int = 1, boot_id: int = 0) -> Session:
        made = Session(KEYS, STATION, up_bps=self.link.up_bps, kept=SavedLinkState(boot_id))
        made.requester = Requester(STATION, next_id, remembered=self.remembered)
        made.sealer.counter = counter
        return made

    def restart_ground(self) -> None:
        """Restart the station's process: its disk has counters, next request id, boot id and `kept`; nothing else."""
        old = self.session
        self.session = self._new_session(old.sealer.counter + 640, old.requester.next_id, old.boot_id)
        self.session.recall(lambda: reversed(self.kept or []))

    def restart_rover(self) -> None:
        """Restart the flight program under the next boot id; its work in progress is lost."""
        self.rover = RoverEnd(self.link.down_bps, self.rover.boot_id + 1)

    def request(self, name: str, arguments: dict | None = None, lifetime_s: float = 0.0) -> int:
        self._wake_ns = 0
        return self.session.request(name, arguments or {}, self.now_ns, lifetime_s)

    def tick(self) -> None:
        now_ns = self.now_ns
        self._rover_turn(now_ns)
        arrived = self._take_down(now_ns)
        for datagram in arrived:
            verdict, news = self.session.receive(datagram, now_ns)
            self.verdicts[verdict] = self.verdicts.get(verdict, 0) + 1
            if self.kept is not None and verdict == "ok" and datagram[0] == DatagramKind.BULK_CHUNK:
                self.kept.append(datagram)
            for one in news if self.hear else ():
                self.hear(self, one)
        if arrived:
            self._wake_ns = 0
        if self._wake_ns is not None and now_ns >= self._wake_ns:
            for datagram in self.session.send(now_ns):
                self.up.offer(datagram, now_ns)
            self._wake_ns = self.session.next_due_ns(now_ns)
        self.now_ns += TICK_NS

    def _take_up(self, now_ns: int) -> list[bytes]:
        return self.up.due(now_ns) if _due(self.up, now_ns) else []

    def _take_down(self, now_ns: int) -> list[bytes]:
        return self.down.due(now_ns) if _due(self.down, now_ns) else []

    def _rover_turn(self, now_ns: int) -> None:
        core = self.rover.core
        for order in self.rover.receive(self._take_up(now_ns), now_ns):
            self.executed.append(order)
            if self.act is None:
                core.report(order.request_id, RequestState.COMPLETED)
            else:
                self.act(self, order)
        for notice in core.notices:
            core.event(notice)
        core.notices.clear()
        core.sample(self.view, now_ns)
        for kind, datagram in self.rover.send(now_ns):
            cost = line_bytes(len(datagram) - _FRAME_BYTES)
            self.line_bytes[kind] = self.line_bytes.get(kind, 0) + cost
            self.down.offer(datagram, now_ns)

    def run(self, until_s: float, done: Callable[[], bool] | None = None) -> World:
        while self.now_ns < until_s * S and not (done is not None and done()):
            self.tick()
        return self

    @property
    def now_s(self) -> float:
        return self.now_ns / S

    def beside_bulk(self) -> int:
        """Return the bytes on the line so far that were not bulk."""
        return sum(size for kind, size in self.line_bytes.items() if kind != DatagramKind.BULK_CHUNK)


_FRAME_BYTES = line_bytes(0) - 28


def _due(model: Impairment, now_ns: int) -> bool:
    return model.next_due_ns is not None and model.next_due_ns <= now_ns
