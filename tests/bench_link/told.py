"""Rows `telemetry` and `telemetry-bulk`: share and age of 2 Hz telemetry on an idle and on a busy link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ground.link.news import Item, News
from hil.link.impairment import Profile
from tests.bench_link.figures import Figure, Told, quantile, share
from tests.bench_link.world import World, profile

RATE_HZ = 2.0
BESIDE_LOSS, LATE_S = 0.02, 0.3
WATCHED = ("mode", "x_m", "yaw_rad", "steer_1_rad", "job_ratio")  # one item of each 2 Hz message
LINKS = ("lan", "ets8-a", "ets8-b", "ets8-c", "ets8-shadow", "moon", "moon-bad", "stress")


@dataclass
class Heard:
    """Ages in s of each sample that arrived, by its name and onboard time."""

    ages_s: dict[tuple[str, int], float]
    made: int

    def __call__(self, world: World, news: News) -> None:
        if isinstance(news, Item) and news.name in WATCHED:
            self.ages_s.setdefault((news.name, news.onboard_ns), (news.at_ns - news.onboard_ns) / 1e9)


def lost_share(link: Profile, until_s: float) -> float:
    """Return the share that the profile loses between 0 and until_s."""
    p = link.loss
    if link.mean_bad_s:
        p = 1 - (1 - p) * link.mean_good_s / (link.mean_bad_s + link.mean_good_s)
    if link.blackout_length_s:
        dark = sum(_dark(link, k / 10) for k in range(round(until_s * 10))) / round(until_s * 10)
        p = 1 - (1 - p) * (1 - dark)
    return p


def _dark(link: Profile, at_s: float) -> bool:
    since_s = at_s - link.blackout_first_s
    return since_s >= 0 and since_s % (link.blackout_every_s or 1e12) < link.blackout_length_s


def listen(name: str, seed: int, seconds: float, busy: bool) -> Heard:
    """Run for a time without products, or with one product after the other."""
    link = profile(name)
    world, heard = World(link, seed), Heard({}, round(seconds * RATE_HZ) * len(WATCHED))
    world.hear = heard
    rng = np.random.default_rng(seed)
    size = round(min(link.down_bps, 1e6) / 8 * 20)
    while world.now_s < seconds:
        if busy:
            world.rover.core.offer(f"cloud {world.now_s}", rng.bytes(size), "raw")
        world.run(seconds, lambda: busy and not world.rover.core._bulk.busy)
    world.run(seconds + link.one_way_s + 3.0)
    heard.ages_s = {key: age_s for key, age_s in heard.ages_s.items() if key[1] < seconds * 1e9}
    return heard


def _row(row: str, quick: bool, told: Told, busy: bool) -> list[Figure]:
    seconds, seeds, out = (300.0, 2, []) if quick else (600.0, 6, [])
    for name in LINKS:
        told(name)
        link = profile(name)
        many = seeds * (4 if link.mean_bad_s else 1)
        runs = [listen(name, seed, seconds, busy) for seed in range(many if name != "lan" else 1)]
        limit = 1 - lost_share(link, seconds) - BESIDE_LOSS
        came, made = sum(len(run.ages_s) for run in runs), sum(run.made for run in runs)
        out.append(share(row, name, f"arrives of {RATE_HZ:g} Hz", came, made, limit))
        ages = [list(run.ages_s.values()) for run in runs]
        out.append(quantile(row, name, "age, p95", ages, 0.95, link.one_way_s + LATE_S, "s"))
    return out


def idle(quick: bool, told: Told) -> list[Figure]:
    """Measure with nothing else on the link."""
    return _row("telemetry", quick, told, busy=False)


def busy(quick: bool, told: Told) -> list[Figure]:
    """Measure with products one after the other all the time."""
    return _row("telemetry-bulk", quick, told, busy=True)
