"""Tests of hostilities: each reaches the flight program, and a chaos flight is judged by each of its promises."""

from dataclasses import replace

import numpy as np
import pytest

from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory
from hil.scenarios.model import Scenario
from onboard.record.replay import replay
from protocol import WireError
from protocol.link.datagrams import DatagramKind
from protocol.link.transactions import Executor
from protocol.tables.modes import Mode
from tests.scenarios import __main__ as command
from tests.scenarios.hostile import chaos
from tests.scenarios.hostile.chaos import COUNT, Row, broken, drawn, named, summary
from tests.scenarios.hostile.hostilities import HOSTILITIES, absurd_payloads
from tests.scenarios.hostile.siege import Attack, Siege

pytestmark = pytest.mark.tool

FLAT = Scenario(name="chaos", terrain="flat", seed=3)
BEGIN_S, SWEEP_S, AFTER_S = 2.5, 5.0, 1.5  # the operator has given its order; the scanner sweeps


def besieged(*names, end_s, observe=None, record=None):
    """Fly on level ground under these, from BEGIN_S or SWEEP_S on, each for its `felt_s`."""
    attacks = [
        Attack(
            name, SWEEP_S if HOSTILITIES[name].in_sweep else BEGIN_S, HOSTILITIES[name].felt_s, np.random.default_rng(n)
        )
        for n, name in enumerate(names)
    ]
    siege = Siege(FLAT, attacks, record)
    try:
        while siege.tick < end_s * 100:
            siege.step(observe)
    finally:
        siege.free()
    return siege


@pytest.mark.parametrize("name", HOSTILITIES)
def test_a_hostility_is_felt_by_the_flight_program_and_raises_no_fault_but_its_own(name, tmp_path):
    row = HOSTILITIES[name]
    siege = besieged(
        name, end_s=(SWEEP_S if row.in_sweep else BEGIN_S) + row.felt_s + AFTER_S, record=tmp_path / "chaos.mcap"
    )
    (attack,) = siege.attacks
    assert attack.felt > 0 and attack.over
    told = {event.text.partition(":")[0] for event in siege.events if event.name == "FAULT"}
    assert told <= row.raises


def test_without_a_hostility_nothing_is_felt_and_the_flight_is_the_bench_s_own_to_the_byte():
    felt, digests = {}, []

    def look(tick, inputs, outputs, rover, state):
        digests.append(outputs.state_digest)
        for name, row in HOSTILITIES.items():
            felt.setdefault(name, set()).add(row.felt(rover, inputs))

    besieged(end_s=6.0, observe=look)
    assert {name for name, seen in felt.items() if len(seen) > 1} == set()
    bench, plain = InMemory(FLAT, step_ns=CAMPAIGN_STEP_NS), []
    for _ in digests:
        bench.step(lambda tick, inputs, outputs, rover, state: plain.append(outputs.state_digest))
    bench.free()
    assert plain == digests


def test_the_record_of_a_flight_under_hostilities_replays_to_the_byte(tmp_path):
    names, record = ("scanner_garbage", "can_recorded", "link_absurd", "disk_full"), tmp_path / "chaos.mcap"
    siege = besieged(*names, end_s=BEGIN_S + 1.0, record=record)
    assert all(attack.felt for attack in siege.attacks)
    verdict = replay(record)
    assert verdict.first_difference == "" and verdict.ticks == siege.tick


def test_what_waited_in_a_blackout_comes_at_its_end_among_forged_datagrams():
    heard = []
    siege = besieged(
        "link_blackout",
        end_s=BEGIN_S + 9.0,
        observe=lambda tick, inputs, *_: heard.append((tick, inputs.link_messages)),
    )
    begin, end = BEGIN_S * 100, siege.attacks[0].ended_s * 100
    assert not any(messages for tick, messages in heard if begin <= tick < end)
    after = [message for tick, messages in heard if tick >= end for message in messages]
    assert sum(message.verdict == "tag" for message in after) == 5000
    assert any(message.accepted for message in after)


def test_budgets_of_the_ports_bound_what_a_flood_brings_into_a_tick():
    most = {"lidar": 0, "frames": 0, "messages": 0}

    def look(tick, inputs, outputs, rover, state):
        most["lidar"] = max(most["lidar"], sum(len(chunk.data) for chunk in inputs.lidar_chunks))
        most["frames"] = max(most["frames"], len(inputs.can_frames))
        most["messages"] = max(most["messages"], len(inputs.link_messages))

    besieged("scanner_feeds", "can_flood", "link_blackout", end_s=BEGIN_S + 9.0, observe=look)
    assert 20_000 < most["lidar"] <= 131_072
    assert 1_000 < most["frames"] <= 4_000
    assert most["messages"] == 512


def test_no_absurd_payload_becomes_an_order():
    rng = np.random.default_rng(1)
    payloads = [
        payload for _ in range(20) for kind, payload in absurd_payloads(rng) if kind is DatagramKind.TELECOMMAND
    ]
    for mode in Mode:
        executor, orders = Executor(), []
        for payload in payloads:
            try:
                orders.append(executor.receive(3, payload, 10**9, mode))
            except WireError:
                continue
        orders += executor.due(1 << 62, mode)
        assert not any(orders)


# -- the draw and the judgement --------------------------------------------------------------------------------------


def test_each_seed_draws_three_kinds_and_30_seeds_draw_them_all():
    for seed in chaos.SEEDS:
        attacks = drawn(seed)
        assert len({attack.name for attack in attacks}) == COUNT
        assert [(a.name, a.begin_s, a.lasts_s) for a in attacks] == [
            (a.name, a.begin_s, a.lasts_s) for a in drawn(seed)
        ]
    assert {attack.name for seed in chaos.SEEDS for attack in drawn(seed)} == set(HOSTILITIES)


GONE_ON = Row(4, ("can_flood", "scanner_feeds", "link_forged"), (10.0, 40.0, 60.0), (14.0, 44.0, 64.0), (5, 6, 7),
              "arrived", (), 300.0, 0.02, 0.05, (), ("LIDAR_GARBLED",), (41.0,), 30_000, (), 17.0, 6)  # fmt: skip
STOPPED = replace(GONE_ON, outcome="goto: CAN_BABBLE: the bus is over 80 % full", reasons=("CAN_BABBLE",), over_s=11.0,
                  faults=("CAN_BABBLE",), told_s=(11.0,), to_goal_m=9.0)  # fmt: skip


@pytest.mark.parametrize(("row", "changes", "told"), [
    (GONE_ON, {"to_goal_m": 0.31}, "arrived 0.31 m from the goal"),
    (GONE_ON, {"contacts": ("7.0 s: body",)}, "touched 1 times, first 7.0 s: body"),
    (GONE_ON, {"faults": ("WHEEL_STUCK",)}, "WHEEL_STUCK at 41.0 s, which no hostility raises"),
    (GONE_ON, {"told_s": (39.0,)}, "LIDAR_GARBLED at 39.0 s, which no hostility raises"),
    (GONE_ON, {"told_s": (54.5,)}, "LIDAR_GARBLED at 54.5 s, which no hostility raises"),
    (GONE_ON, {"felt": (5, 6, 0)}, "link_forged was not felt"),
    (GONE_ON, {"different": ("its replay is different",)}, "its replay is different"),
    (GONE_ON, {"replayed": 0}, "its replay compared no tick"),
    (STOPPED, {"outcome": "goto: no way is left", "reasons": ()}, "not for the reason told: goto: no way is left"),
    (STOPPED, {"over_s": 30.0}, "not for the reason told"),
    (STOPPED, {"reasons": ("CAN_BABBLE", "LOOP")}, "not for the reason told"),
])  # fmt: skip
def test_chaos_falls_short_by_each_of_its_promises_alone(row, changes, told):
    assert broken(row) == []
    said = broken(replace(row, **changes))
    assert len(said) == 1 and told in said[0] and "seed 4" in said[0]


def test_a_mission_may_not_end_by_what_it_has_to_go_on_in_spite_of():
    row = replace(
        STOPPED,
        kinds=("can_forged", *STOPPED.kinds[1:]),
        outcome="goto: CAN_CORRUPT: over 20",
        reasons=("CAN_CORRUPT",),
        faults=("CAN_CORRUPT",),
    )
    assert not HOSTILITIES["can_forged"].ends
    assert [text for text in broken(row) if "not for the reason told" in text]


def test_a_reason_names_rows_of_the_fault_table():
    assert named("goto: LIDAR_GARBLED: over 20 % of the NOT_A_ROW frames, LIDAR_SILENT") == (
        "LIDAR_GARBLED",
        "LIDAR_SILENT",
    )


def test_the_summary_has_a_line_for_each_hostility_and_one_for_all():
    lines = [dict(zip(chaos.HEADS, line, strict=True)) for line in summary([GONE_ON, STOPPED])]
    assert [line["hostility"] for line in lines] == [*(f"`{name}`" for name in HOSTILITIES), "all"]
    flood = next(line for line in lines if line["hostility"] == "`can_flood`")
    assert (flood["flown"], flood["arrived"], flood["stopped by it"], flood["felt, least"]) == ("2", "1", "1", "5")
    assert (lines[-1]["flown"], lines[-1]["arrived"], lines[-1]["stopped by it"]) == ("2", "1", "1")
    assert "replays identical: 2 of 2" in lines[-1]["what it does"]


def test_the_page_takes_the_table_of_a_whole_campaign_under_its_own_heads(tmp_path, monkeypatch):
    page = tmp_path / "campaigns.md"
    page.write_text(command.PAGE.read_text())
    monkeypatch.setattr(command, "PAGE", page)
    command._put({"chaos": [replace(GONE_ON, seed=seed) for seed in chaos.SEEDS]})
    made = page.read_text().partition("<!-- begin chaos")[2]
    assert "| " + " | ".join(chaos.HEADS) + " |" in made and "`scanner_feeds`" in made
