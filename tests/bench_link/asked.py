"""Row `commands`: each of 10,000 is executed exactly once and soon known to be, at 30 % loss and 2.6 s round trip."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from protocol.link.transactions import RequestState
from tests.bench_link.figures import Figure, Told, count, quantile
from tests.bench_link.world import World, profile

COMMANDS = 10_000
P95_RTT, P999_RTT = 3.0, 6.0
LINK = profile("moon", loss=0.3, one_way_s=1.3, duplicate=0.01, reorder=0.02)
RATE_HZ = 2.0
_SETTLE_S = 240.0


@dataclass(frozen=True)
class Asked:
    """Result of one seed. waits_rtt: time from request to first report, in round trips."""

    waits_rtt: list[float]
    lost: int
    repeated: int
    unknown: int


def ask(seed: int, commands: int, told: Told = lambda _: None) -> Asked:
    """Send commands at a steady rate until each has its outcome."""
    world, asked = World(LINK, seed, remembered=commands), 0
    world.run(_SETTLE_S, lambda: world.session.commanding)  # nothing is sent before the rover's versions arrive
    begin_s = world.now_s
    while asked < commands:
        world.request("goto", {"x_m": float(asked % 10_000), "y_m": float(asked // 10_000)})
        asked += 1
        world.run(begin_s + asked / RATE_HZ)
        if asked % 1000 == 0:
            told(f"{asked} of {commands} asked")
    requester = world.session.requester
    world.run(world.now_s + _SETTLE_S, lambda: not requester.open)
    times = Counter(order.arguments["x_m"] for order in world.executed)
    waits_s = [(r.history[0][0] - r.made_ns) / 1e9 for r in requester.requests.values() if r.history]
    return Asked(
        [wait_s / (2 * LINK.one_way_s) for wait_s in waits_s],
        commands - len(times),
        sum(n - 1 for n in times.values()),
        sum(r.state != RequestState.COMPLETED for r in requester.requests.values()),
    )


def row(quick: bool, told: Told) -> list[Figure]:
    """Measure the figures."""
    runs = []
    for seed in range(1 if quick else 5):
        runs.append(ask(seed, COMMANDS, lambda text, seed=seed: told(f"seed {seed}: {text}")))
    total, where = COMMANDS * len(runs), "moon, 30 %, 2.6 s"
    waits = [run.waits_rtt for run in runs]
    return [
        count("commands", where, "never executed", sum(run.lost for run in runs), 0, total),
        count("commands", where, "executed twice or more", sum(run.repeated for run in runs), 0, total),
        count("commands", where, "outcome not known", sum(run.unknown for run in runs), 0, total),
        quantile("commands", where, "answer, p95", waits, 0.95, P95_RTT, "RTT"),
        quantile("commands", where, "answer, p99.9", waits, 0.999, P999_RTT, "RTT"),
    ]
