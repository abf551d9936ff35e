"""Rows `bulk` and `profiles`: a file's share of the token bucket, and the arrival of a map over every link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ground.link.news import News, ProductHeard
from hil.link.impairment import Profile
from protocol.link.transactions import RequestState
from tests.bench_link.figures import Figure, Told, count, mean
from tests.bench_link.told import LINKS
from tests.bench_link.world import World, profile

BUCKET = 0.93
SIZE_BYTES, MAP_BYTES = 160_000, 24_700
CLEAN, LOSSY = 0.85, 0.80


@dataclass(frozen=True)
class Moved:
    """Result of one object.

    share: its bytes over those that the bucket left beyond other traffic until it was whole.
    """

    share: float
    seconds: float
    right: bool


def move(link: Profile, seed: int, size: int, limit_s: float = 900.0) -> Moved:
    """Transfer an incompressible object over a link that has carried telemetry for 10 s."""
    world, data, got = World(link, seed), np.random.default_rng(seed).bytes(size), list[News]()
    world.hear = lambda _, news: got.append(news) if isinstance(news, ProductHeard) else None
    world.run(10.0)
    begin_s, beside = world.now_s, world.beside_bulk()
    world.rover.core.offer("cloud", data, "raw")
    world.run(begin_s + limit_s, lambda: bool(got))
    seconds = world.now_s - begin_s
    left = BUCKET * link.down_bps / 8 * seconds - (world.beside_bulk() - beside)
    return Moved(size / left, seconds, len(got) == 1 and got[0].product.data == data)


def bulk(quick: bool, told: Told) -> list[Figure]:
    """Measure 64 kbit/s, at a satellite's and the Moon's delay."""
    out, seeds = [], 4 if quick else 30
    for name, loss in [(name, loss) for name in ("ets8-a", "moon") for loss in (0.0, 0.1, 0.3)]:
        told(f"{name}, {loss:.0%}")
        link = profile(name, loss=loss)
        runs = [move(link, seed, SIZE_BYTES) for seed in range(seeds)]
        limit, where = CLEAN if not loss else LOSSY * (1 - loss), f"{name}, {100 * loss:g} %"
        out.append(mean("bulk", where, "160 kB by bucket", [r.share for r in runs], limit, at_least=True))
        out.append(count("bulk", where, "not whole or wrong", sum(not r.right for r in runs), 0, seeds))
    return out


def profiles(quick: bool, told: Told) -> list[Figure]:
    """Check over every link that a map arrives as sent, a command's outcome is known, and nothing is done twice."""
    out, seeds = [], 2 if quick else 10
    for name in LINKS:
        told(name)
        link, wrong = profile(name), 0
        for seed in range(seeds):
            world = World(link, seed)
            world.run(5.0 + 2 * link.one_way_s, lambda world=world: world.session.boot_id != 0)
            request_id = world.request("scan")
            state = world.session.requester.requests[request_id]
            world.run(400.0, lambda state=state: state.state.final)
            once = [order.name for order in world.executed] == ["scan"] and state.state == RequestState.COMPLETED
            wrong += not once or not move(link, seed, MAP_BYTES).right
        out.append(count("profiles", name, "a scan and a map that failed", wrong, 0, seeds))
    return out
