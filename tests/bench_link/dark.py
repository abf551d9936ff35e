"""Row `blackout`: 60 s without a bit, during a product, events, and commands with and without expiry."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ground.link.news import EventHeard, Item, News, ProductHeard
from hil.link.impairment import Profile
from onboard.records import Event
from protocol.link.transactions import RequestState
from tests.bench_link.figures import Figure, Told, count, quantile
from tests.bench_link.world import S, World, profile

BEGIN_S, LENGTH_S, LIMIT_S = 25.0, 60.0, 400.0
END_S = BEGIN_S + LENGTH_S
FRESH_S, LIFETIME_S = 2.0, 10.0
_EVENT_EVERY_S, _LAST_EVENT_S = 0.5, 100.0
_SIZE_BYTES = 160_000


@dataclass
class Watch:
    """Recorder of the ground's news in one run."""

    fresh_s: float = float("inf")
    events: list[str] = field(default_factory=list)
    product: bytes | None = None

    def __call__(self, world: World, news: News) -> None:
        match news:
            case Item() if news.onboard_ns >= END_S * S:
                self.fresh_s = min(self.fresh_s, news.at_ns / S - END_S)
            case EventHeard() if news.name == "NOTE":
                self.events.append(news.text)
            case ProductHeard():
                self.product = news.product.data


@dataclass(frozen=True)
class Passed:
    """Result of one run. wrong: names of the broken promises."""

    fresh_s: float
    wrong: tuple[str, ...]
    complete_s: float


def pass_through(link: Profile, seed: int) -> Passed:
    """Run one blackout from 25 to 85 s. Three commands are given in it: two expire, one may arrive at any time."""
    world, watch = World(link, seed), Watch()
    world.hear = watch
    data, texts = np.random.default_rng(seed).bytes(_SIZE_BYTES), list[str]()
    ids: dict[str, int] = {}
    due = {BEGIN_S + 1: ("mortal", LIFETIME_S), BEGIN_S + 20: ("second", LIFETIME_S), BEGIN_S + 30: ("lasting", 0.0)}
    session, boot_id = world.session, world.rover.boot_id
    while world.now_s < LIMIT_S:
        at_s = world.now_s
        if at_s == 15.0:
            world.rover.core.offer("cloud", data, "raw")
        if at_s < _LAST_EVENT_S and at_s % _EVENT_EVERY_S == 0:
            texts.append(f"at {at_s:g}")
            world.rover.core.event(Event(world.now_ns, "info", "NOTE", texts[-1]))
        if at_s in due:
            name, lifetime_s = due[at_s]
            ids[name] = world.request("goto", {"x_m": float(len(ids)), "y_m": 0.0}, lifetime_s)
        world.tick()
        if at_s > _LAST_EVENT_S and _all_known(world, watch, texts):
            break
    states = {name: session.requester.requests[i].state for name, i in ids.items()}
    done = [order.arguments["x_m"] for order in world.executed]
    same = world.session is session and world.rover.boot_id == boot_id == session.boot_id
    wrong = {
        "events": sorted(watch.events) != sorted(texts),
        "product": watch.product != data,
        "executed": done != [2.0],
        "expired": [states["mortal"], states["second"]] != [RequestState.EXPIRED] * 2,
        "lasting": states["lasting"] != RequestState.COMPLETED,
        "restart": not same,
    }
    return Passed(watch.fresh_s, tuple(name for name, bad in wrong.items() if bad), world.now_s - END_S)


def _all_known(world: World, watch: Watch, texts: list[str]) -> bool:
    return watch.product is not None and len(watch.events) == len(texts) and not world.session.requester.open


def row(quick: bool, told: Told) -> list[Figure]:
    """Measure the Moon's profile and its bad one.

    At 30 % loss the limit applies to fresh telemetry's 95th percentile.
    """
    out, seeds = [], 3 if quick else 60
    for name, q in (("moon", 1.0), ("moon-bad", 0.95)):
        told(name)
        link = profile(name, blackout_first_s=BEGIN_S, blackout_every_s=0.0, blackout_length_s=LENGTH_S)
        runs = [pass_through(link, seed) for seed in range(seeds)]
        what = "fresh telemetry after its end, " + ("worst" if q == 1.0 else "p95")
        fresh_s = [[run.fresh_s] for run in runs]
        out.append(quantile("blackout", name, what, fresh_s, q, link.one_way_s + FRESH_S, "s"))
        for broken in ("events", "product", "executed", "expired", "lasting", "restart"):
            found = sum(broken in run.wrong for run in runs)
            out.append(count("blackout", name, f"wrong: {broken}", found, 0, seeds))
    return out
