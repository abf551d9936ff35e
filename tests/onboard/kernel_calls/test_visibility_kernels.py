"""The visibility kernels: every build gives the bits of the scalar loop, and the door says what is wrong."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.kernel_calls import visibility as door
from onboard.kernel_calls.progress import CancelledError, Progress
from onboard.native import variant
from onboard.planning.sensing import visibility
from tests.oracles import visibility as oracles

TABLE = visibility.beams(2.3, 0.1, 77)


@pytest.fixture(params=variant.available())
def build(request, monkeypatch):
    """Each build of the kernels that runs on this machine."""
    monkeypatch.setattr(door, "kernels", variant.load(request.param))


def scene(rng: np.random.Generator, shape: tuple[int, int], kind: int) -> visibility.Scene:
    """Rough ground: all known, or with unknown cells that never or always hide."""
    z = rng.normal(0, 0.15, shape).astype(np.float32)
    if kind:
        z[rng.random(shape) < 0.15] = np.nan
    return visibility.scene(z, optimistic=kind == 1)


def request(rng: np.random.Generator, ground: visibility.Scene, count: int) -> door.Request:
    """Any question: some nodes or all, some sector or all round, fresh cells or not."""
    shape, few = ground.height_m.shape, rng.random(4) < 0.5
    return door.Request(
        float(rng.uniform(0.1, 1.5)),
        rng.random(shape) < 0.4 if few[0] else None,
        rng.integers(0, count, shape).astype(np.int32) if few[1] else None,
        int(rng.integers(1, count + 1)),
        rng.random(shape) < 0.3 if few[2] else ground.unknown if few[3] else None,
        int(rng.integers(1, count + 1)),
    )


def same(a: door.Sums, b: door.Sums) -> None:
    for name in ("seen", "in_range", "fresh", "heading"):
        if getattr(b, name) is None:
            assert getattr(a, name) is None
        else:
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


@pytest.mark.parametrize("kind", [0, 1, 2])
@pytest.mark.parametrize(
    "shape", [(1, 1), (1, 2), (2, 1), (1, 300), (300, 1), (3, 7), (4, 8), (5, 17), (16, 64), (31, 65), (67, 129)]
)
def test_total_has_the_bits_of_the_scalar_loop(build, shape, kind):
    rng = np.random.default_rng(shape[0] * 1000 + shape[1] * 3 + kind)
    ground = scene(rng, shape, kind)
    for _ in range(4):
        asked = request(rng, ground, len(TABLE.dj))
        same(
            door.total(TABLE, ground.height_m, ground.veil, asked),
            door.scalar(TABLE, ground.height_m, ground.veil, asked),
        )


def test_total_has_the_bits_of_the_scalar_loop_on_a_large_map(build):
    rng = np.random.default_rng(9)
    ground = scene(rng, (300, 300), 1)
    asked = door.Request(0.7, rng.random((300, 300)) < 0.05, None, 0, ground.unknown, 30)
    table = visibility.beams(8.0, 0.1, 90)
    same(
        door.total(table, ground.height_m, ground.veil, asked), door.scalar(table, ground.height_m, ground.veil, asked)
    )


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_any_map_table_and_question_give_equal_bits_in_every_build(seed):
    rng = np.random.default_rng(seed)
    ground = scene(rng, (int(rng.integers(1, 50)), int(rng.integers(1, 140))), int(rng.integers(3)))
    table = visibility.beams(float(rng.uniform(0.1, 4.0)), 0.1, int(rng.integers(1, 60)))
    asked = request(rng, ground, len(table.dj))
    chosen = door.kernels
    try:
        door.kernels = variant.load("baseline")
        want = door.scalar(table, ground.height_m, ground.veil, asked)
        for name in variant.available():
            door.kernels = variant.load(name)
            same(door.total(table, ground.height_m, ground.veil, asked), want)
    finally:
        door.kernels = chosen


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_sums_are_those_of_numpy_in_single_precision(build, kind):
    ground = scene(np.random.default_rng(kind), (33, 40), kind)
    sums = door.total(TABLE, ground.height_m, ground.veil, door.Request(0.7, target=ground.unknown, heading_width=77))
    look = oracles.Look(ground, TABLE, 0.7)
    for node in [(0, 0), (16, 20), (32, 39), (7, 31)]:
        seen, in_range, fresh = look.sums(node)
        assert (sums.seen[node], sums.in_range[node]) == (seen, in_range)
        assert sums.fresh is not None
        assert sums.fresh[node] == fresh.sum()


@pytest.mark.parametrize(("range_m", "count"), [(0.1, 1), (2.3, 77), (10.0, 720), (30.0, 720)])
def test_the_shares_of_each_cell_sum_to_a_whole_one(range_m, count):
    table = visibility.beams(range_m, 0.1, count)
    cells = (table.dj.astype(np.int64) << 32) + table.di
    _, at = np.unique(cells, return_inverse=True)
    np.testing.assert_array_equal(np.bincount(at.ravel(), table.share.ravel()), table.whole)
    assert table.whole & (table.whole - 1) == 0
    assert 2**30 <= 2 * table.whole * table.cells < 2**32


def test_a_view_has_the_sums_of_total(build):
    ground = scene(np.random.default_rng(2), (20, 30), 1)
    sums = door.total(TABLE, ground.height_m, ground.veil, door.Request(0.7))
    seen, sees, in_range = door.view(TABLE, (ground.height_m, ground.veil), (4, 9), 0.7, (0, 77))
    assert (sees, in_range) == (sums.seen[4, 9], sums.in_range[4, 9])
    assert not seen[4, 9] and seen.sum() >= sees / TABLE.whole


def test_progress_counts_every_node_and_a_set_flag_stops_the_run(build):
    z = np.zeros((50, 130), np.float32)
    watch = Progress()
    for work in (door.total, door.scalar):
        watch.done[0] = 0
        work(TABLE, z, None, door.Request(0.7), watch)
        assert watch.done[0] == z.size
    watch.cancel()
    for work in (door.total, door.scalar):
        with pytest.raises(CancelledError, match="stopped after"):
            work(TABLE, z, None, door.Request(0.7), watch)


def test_another_thread_can_stop_a_long_run(build):
    z, watch = np.zeros((400, 400), np.float32), Progress()
    table = visibility.beams(30.0, 0.1, 720)

    def stop() -> None:
        while watch.done[0] == 0:
            pass
        watch.cancel()

    stopper = threading.Thread(target=stop)
    stopper.start()
    with pytest.raises(CancelledError):
        door.total(table, z, None, door.Request(0.7), watch)
    stopper.join()
    assert 0 < watch.done[0] < z.size


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"height_m": np.zeros((3, 4))}, r"height_m: expected float32 \(any, any\), given float64"),
        ({"height_m": np.zeros((3, 8), np.float32)[:, ::2]}, "height_m: expected contiguous rows"),
        ({"height_m": np.zeros((4, 3), np.float32, order="F")}, "height_m: expected contiguous rows"),
        ({"height_m": np.full((3, 4), np.nan, np.float32)}, "height_m: expected finite heights"),
        ({"veil": np.zeros((4, 4), np.float32)}, r"veil: expected float32 \(3, 4\)"),
        ({"veil": np.full((3, 4), np.nan, np.float32)}, "veil: expected 0, -inf or \\+inf"),
        ({"asked": door.Request(np.inf)}, "eye_m: expected a finite height"),
        (
            {"asked": door.Request(0.7, first=np.full((3, 4), 77, np.int32), width=3)},
            "sector: expected a first beam of 0 to 76",
        ),
        ({"asked": door.Request(0.7, first=np.zeros((3, 4), np.int32), width=0)}, "sector: expected"),
        ({"asked": door.Request(0.7, first=np.zeros((3, 4)), width=1)}, "first: expected int32"),
        ({"asked": door.Request(0.7, heading_width=78)}, "heading_width: expected 1 to 77 beams, given 78"),
    ],
)
def test_the_door_names_what_is_wrong(changed, words):
    good = {"height_m": np.zeros((3, 4), np.float32), "veil": None, "asked": door.Request(0.7)}
    with pytest.raises(ValueError, match=words):
        door.total(TABLE, **{**good, **changed})


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"dj": TABLE.dj[::-1]}, "dj: expected contiguous rows"),
        ({"di": TABLE.di.astype(np.int64)}, "di: expected int32"),
        ({"dj": np.ascontiguousarray(TABLE.dj[:, ::-1])}, "dj: expected cells that never come nearer"),
        ({"share": TABLE.share + 1}, "share: expected >= 0"),
        ({"dj": np.zeros((0, 3), np.int32)}, "dj: expected"),
    ],
)
def test_a_table_that_would_lead_off_the_map_cannot_be_built(changed, words):
    with pytest.raises(ValueError, match=words):
        replace(TABLE, **changed)
