"""Row `resume`: an end restarts in the middle of a product; share of the received bytes that is sent again."""

from __future__ import annotations

import numpy as np

from ground.link.news import News, ProductHeard
from protocol.link.datagrams import DatagramKind, line_bytes
from protocol.link.transactions import Order, RequestState
from tests.bench_link.figures import Figure, Told, count, mean
from tests.bench_link.moved import SIZE_BYTES
from tests.bench_link.world import World, profile

AGAIN = 0.2  # of the received bytes; at 30 % loss two transfers differ by this much, a new start is 1 more


def restart(name: str, loss: float, who: str, seed: int) -> tuple[float, bool]:
    """Return the bulk bytes that a restart adds, over half the object, and whether the object is right.

    who: "ground", "rover", or "" for none.
    """
    world, got = World(profile(name, loss=loss), seed), list[News]()
    data = np.random.default_rng(seed).bytes(SIZE_BYTES)

    def act(world: World, order: Order) -> None:
        object_id = world.rover.core.offer("ldem", data, "raw")
        world.rover.core.report(order.request_id, RequestState.COMPLETED, data=(object_id,))

    world.act, world.hear = act, lambda _, news: got.append(news) if isinstance(news, ProductHeard) else None
    world.kept = []
    world.run(5.0)
    world.request("get", {"product": "ldem"})
    world.run(300.0, lambda: _share(world) >= 0.5)
    if who:
        world.restart_ground() if who == "ground" else world.restart_rover()
        world.run(world.now_s + 30.0, lambda: bool(world.session.boot_id == world.rover.boot_id))
        world.request("get", {"product": "ldem"})
    world.run(world.now_s + 900.0, lambda: bool(got))
    right = len(got) == 1 and isinstance(got[0], ProductHeard) and got[0].product.data == data
    return world.line_bytes[DatagramKind.BULK_CHUNK] / line_bytes(SIZE_BYTES), right


def _share(world: World) -> float:
    have, total = world.session.transfers.get("ldem", (0, 1))
    return have / total


def row(quick: bool, told: Told) -> list[Figure]:
    """Measure 160 kB at a satellite's and the Moon's delay, without loss and with 30 %."""
    out, seeds = [], 2 if quick else 10
    for name, loss in [(name, loss) for name in ("ets8-a", "moon") for loss in (0.0, 0.3)]:
        whole = [restart(name, loss, "", seed) for seed in range(seeds)]
        for who in ("ground", "rover"):
            told(f"{name}, {loss:.0%}, {who}")
            runs = [restart(name, loss, who, seed) for seed in range(seeds)]
            again = [2 * (run[0] - alone[0]) for run, alone in zip(runs, whole, strict=True)]
            where = f"{name}, {100 * loss:g} %, {who}"
            out.append(mean("resume", where, "of what was there sent again", again, AGAIN))
            out.append(count("resume", where, "not whole or wrong", sum(not run[1] for run in runs), 0, seeds))
    return out
