"""Tests of `make bench-link`: its statistics by published numbers, and a seed or two of each promise."""

import json

import pytest

from tests.bench_link import __main__ as bench
from tests.bench_link import asked, dark, emulated, figures, hostile, moved, sockets, told
from tests.bench_link.world import World, profile

pytestmark = pytest.mark.tool


def test_wilson_s_interval_is_that_of_the_tables():
    assert figures.wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)  # Newcombe 1998, table I
    assert figures.wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert figures.wilson(1, 29) == pytest.approx((0.0061, 0.1718), abs=5e-5)


def test_a_mean_is_held_to_its_worst_seed_and_a_share_to_itself():
    assert figures.mean("r", "l", "w", [0.9, 0.86], 0.85, at_least=True).holds
    assert not figures.mean("r", "l", "w", [0.99, 0.84], 0.85, at_least=True).holds
    assert figures.share("r", "l", "w", 69, 100, 0.68).holds and not figures.share("r", "l", "w", 67, 100, 0.68).holds
    assert not figures.count("r", "l", "w", 1, 0, 10_000).holds


def test_a_quantile_s_interval_comes_from_whole_seeds():
    one = figures.quantile("r", "l", "w", [[1.0] * 90 + [9.0] * 10, [1.0] * 100], 0.96, 2.0, "s")
    assert (one.value, one.low, one.high, one.holds) == (9.0, 1.0, 9.0, False)


def test_commands_are_executed_once_and_answered_in_time_at_30_percent_loss():
    run = asked.ask(3, 300)
    assert (run.lost, run.repeated, run.unknown) == (0, 0, 0)
    assert sorted(run.waits_rtt)[round(0.95 * 299)] <= asked.P95_RTT
    assert max(run.waits_rtt) <= asked.P999_RTT


@pytest.mark.parametrize("busy", [False, True])
@pytest.mark.parametrize("name", ["ets8-a", "stress"])
def test_telemetry_of_2_hz_comes_in_time_whatever_else_is_sent(name, busy):
    heard = told.listen(name, 1, 120.0, busy)
    link = profile(name)
    ages_s = sorted(heard.ages_s.values())
    assert ages_s[round(0.95 * (len(ages_s) - 1))] <= link.one_way_s + told.LATE_S
    assert len(ages_s) / heard.made >= 1 - link.loss - 0.1  # 240 draws: three sigma at 30 % are 0.09


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
def test_a_cloud_takes_its_share_of_what_the_bucket_left(loss):
    run = moved.move(profile("moon", loss=loss), 1, moved.SIZE_BYTES)
    assert run.right
    assert run.share >= (moved.LOSSY * (1 - loss) if loss else moved.CLEAN)


def test_a_blackout_of_a_minute_costs_nothing_but_its_minute():
    link = profile("moon-bad", blackout_first_s=dark.BEGIN_S, blackout_every_s=0.0)
    run = dark.pass_through(link, 2)
    assert run.wrong == ()
    assert run.fresh_s <= link.one_way_s + dark.FRESH_S


def test_hostile_frames_change_nothing():
    world, waits_s = hostile.siege(1, 4000, hostile.PER_TICK)
    assert world.accepted == 0 and world.thrown >= 4000
    assert len(world.executed) == len(waits_s) == 2
    assert {"tag", "length", "epoch", "boot", "replay", "jump"} <= set(world.rover.core.refused)


def test_on_real_sockets_a_new_station_stops_the_rover_besieged_and_the_enemy_holds_no_place():
    with sockets.Siege() as siege:
        siege.fires.set()
        assert siege.stop_s() is not None and siege.stop_s() is not None
        assert (siege.done, siege.places) == (2, 0) and siege.thrown > 0
        assert {"tag", "length"} <= set(siege.core.refused)


def test_the_enemy_would_be_noticed_if_a_check_were_left_out():
    world = World(profile("lan"), 1)
    world.run(1.0)
    enemy = hostile.Enemy(1)
    enemy.heard["er2/d"] = [b"x" * 60]
    far = enemy._far_counter("er2/d", 1)
    world.session._opener._count = lambda *_: None
    assert world.session._opener.open(far).boot_id == 1


@pytest.mark.parametrize("name", ["ets8-shadow", "moon-bad"])
def test_the_emulator_keeps_its_rate_and_its_loss(name):
    link = profile(name)
    assert emulated._rate_error(link, 60.0) <= emulated.RATE_RATIO
    assert emulated._sigmas(link, 1) <= emulated.SIGMAS
    assert emulated._differing(link) == 0


def test_rows_are_chosen_by_name_written_as_json_and_a_broken_promise_is_exit_code_1(tmp_path, monkeypatch, capsys):
    held = figures.count("a", "l", "w", 0, 0, 9)
    monkeypatch.setattr(
        bench,
        "ROWS",
        {"a": lambda *_: [held], "b": lambda *_: [figures.count("b", "l", "w", 1, 0, 9)], "c": lambda *_: 1 / 0},
    )
    out = tmp_path / "deep" / "figures.json"
    assert bench.main(["--out", str(out), "a"]) == 0
    assert [row["holds"] for row in json.loads(out.read_text())["figures"]] == [True]
    assert bench.main(["--out", str(out), "a", "b"]) == 1
    assert bench.main(["--out", str(out), "c"]) == 1
    assert "ZeroDivisionError" in json.loads(out.read_text())["failed"][0]
    with pytest.raises(SystemExit, match="2"):
        bench.main(["nothing"])
    assert "no row 'nothing'" in capsys.readouterr().err
