"""The link model: rate, delay, loss, queue, blackout, order; the oracle is arithmetic."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from hil.link.impairment import Impairment, Profile, both_directions, load_profile
from onboard.config import ConfigError

S = 1_000_000_000
MS = 1_000_000


def link(seed: int = 1, rate_bps: float = 1e9, **changes: float) -> Impairment:
    return Impairment(replace(Profile(), **changes), rate_bps, np.random.default_rng(seed))


def arrivals(model: Impairment, until_ns: int, step_ns: int = MS) -> list[tuple[int, bytes]]:
    return [(now, d) for now in range(0, until_ns, step_ns) for d in model.due(now)]


def test_line_rate_is_within_one_percent_over_60_s():
    model, got = link(rate_bps=64e3), 0
    for now in range(0, 60 * S, 10 * MS):
        if now % (100 * MS) == 0:
            for _ in range(2):
                model.offer(bytes(800), now)
        got += sum(len(d) + 28 for d in model.due(now))
    assert got * 8 / 60 == pytest.approx(64e3, rel=0.01)


def test_delay_is_the_one_way_delay_plus_the_time_on_the_line():
    model = link(rate_bps=64e3, one_way_s=1.28)
    model.offer(bytes(972), 0)
    assert model.next_due_ns == pytest.approx(1.28 * S + 1000 * 8 / 64e3 * S, abs=1)
    assert model.due(model.next_due_ns - 1) == []
    assert len(model.due(model.next_due_ns)) == 1
    assert model.next_due_ns is None


def test_noise_loses_30_percent_within_three_sigma():
    n, p, seeds = 10_000, 0.3, range(12)
    models = [link(seed, loss=p) for seed in seeds]
    lost = sum(model.offer(b"x", k * MS) == "noise" for model in models for k in range(n))
    total = n * len(models)
    assert abs(lost - total * p) < 3 * math.sqrt(total * p * (1 - p))
    assert lost == sum(model.counts.noise for model in models) == sum(model.counts.lost for model in models)


def test_shadow_takes_30_percent_of_the_time_in_stays_of_three_seconds():
    model = link(mean_bad_s=3.0, mean_good_s=7.0)
    shadow = [model.offer(b"x", k * 100 * MS) == "shadow" for k in range(200_000)]
    stays = sum(b and not a for a, b in itertools.pairwise(shadow))
    assert np.mean(shadow) == pytest.approx(0.3, abs=0.03)
    assert 0.1 * sum(shadow) / stays == pytest.approx(3.0, rel=0.15)


def test_queue_of_two_seconds_drops_the_tail():
    model = link(rate_bps=16e3)
    causes = [model.offer(bytes(972), 0) for _ in range(10)]  # 0.5 s each on the line
    assert causes == [""] * 4 + ["queue_full"] * 6
    assert model.offer(bytes(972), S // 2) == ""


def test_blackouts_lose_everything_in_their_minute_and_nothing_else():
    model = link(blackout_first_s=120, blackout_every_s=600, blackout_length_s=60)
    dark = [k for k in range(1000) if model.offer(b"x", k * S) == "blackout"]
    assert dark == list(range(120, 180)) + list(range(720, 780))


def test_jitter_keeps_the_order_and_stays_within_its_bound():
    model = link(one_way_s=0.3, jitter_s=0.02)
    for k in range(1000):
        model.offer(k.to_bytes(2, "big"), k * MS)
    got = arrivals(model, 2 * S)
    assert [int.from_bytes(d, "big") for _, d in got] == list(range(1000))
    assert all(300 <= now // MS - k <= 322 for k, (now, _) in enumerate(got))


def test_reordering_and_duplication_happen_as_often_as_asked():
    model, n = link(reorder=0.05, duplicate=0.02, one_way_s=0.1), 5000
    for k in range(n):
        model.offer(k.to_bytes(2, "big"), k * MS)
    got = [int.from_bytes(d, "big") for _, d in arrivals(model, 7 * S)]
    assert len(got) == n + model.counts.duplicated
    assert sorted(set(got)) == list(range(n))
    assert got != sorted(got)
    assert model.counts.duplicated == pytest.approx(n * 0.02, abs=3 * math.sqrt(n * 0.02))
    assert model.counts.reordered == pytest.approx(n * 0.05, abs=3 * math.sqrt(n * 0.05))


def test_nothing_arrives_at_the_instant_it_was_offered():
    model = link(rate_bps=1e10)
    model.offer(b"", 5)
    assert model.due(5) == []
    assert len(model.due(1000)) == 1


@pytest.mark.parametrize("name", ["ets8-shadow", "moon-bad", "stress"])
def test_same_seed_gives_the_same_drop_list(name):
    def drops(seed: int) -> list[str]:
        down, up = both_directions(load_profile(name), seed)
        return [m.offer(bytes(100), k * 50 * MS) for k in range(3000) for m in (down, up)]

    assert drops(7) == drops(7)
    assert drops(7) != drops(8)


def test_both_directions_lose_independently():
    down, up = both_directions(replace(load_profile("moon"), loss=0.3), 3)
    assert [down.offer(b"x", k * S) for k in range(200)] != [up.offer(b"x", k * S) for k in range(200)]


def test_a_profile_may_list_its_blackouts_as_pairs(tmp_path):
    path = tmp_path / "profiles.toml"
    path.write_text("[night]\nblackouts_s = [45.0, 105, 200, 201]\n")
    model = Impairment(load_profile("night", path), 1e9, np.random.default_rng(1))
    dark = [k for k in range(300) if model.offer(b"x", k * S) == "blackout"]
    assert dark == [*range(45, 105), 200]


@pytest.mark.parametrize("wrong", ["[45.0]", "[5, 1]", "3", "['a', 'b']"])
def test_blackouts_that_are_no_rising_pairs_are_refused(tmp_path, wrong):
    path = tmp_path / "profiles.toml"
    path.write_text(f"[night]\nblackouts_s = {wrong}\n")
    with pytest.raises(ConfigError, match=r"night\.blackouts_s` should be rising pairs"):
        load_profile("night", path)


def test_unknown_profile_is_refused_with_a_suggestion():
    with pytest.raises(ConfigError, match="did you mean `moon-bad`"):
        load_profile("moonbad")


def test_every_profile_of_the_design_loads():
    for name in ("lan", "ets8-a", "ets8-b", "ets8-c", "ets8-shadow", "moon", "moon-bad", "stress"):
        assert load_profile(name).note
