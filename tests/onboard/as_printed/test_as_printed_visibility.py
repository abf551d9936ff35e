"""Algorithm 1 as printed: each of its faults by its number, the others taken out where they would hide it."""

import math

import numpy as np
import pytest

from docs.as_printed.terrain import Mended as MendedTerrain
from docs.as_printed.terrain import eq_17, eq_20
from docs.as_printed.visibility import Fan, Mended, algorithm_1
from onboard.planning.sensing import visibility

CORRECTED = Mended(ray_advances=True, flat_is_seen=True, mast_m=0.7, plan_steps=True)
FLAT = np.zeros((200, 200), np.float32)
FAN = Fan(10.0, 0.1, 720)


@pytest.fixture(scope="module")
def rough():
    """20 m x 20 m of fractal ground with 60 half-buried balls of 0.1 to 0.5 m."""
    rng = np.random.default_rng(0)
    z = eq_17(eq_20(200, 0.1, 0.8, 0.007, MendedTerrain(True, True)), 0.1, rng).real
    y, x = np.mgrid[0:200, 0:200] * 0.1
    for _ in range(60):
        (b, a), r = rng.uniform(0, 20, 2), rng.uniform(0.1, 0.5)
        z = z + np.sqrt(np.maximum(r * r - (x - a) ** 2 - (y - b) ** 2, 0))
    return z.astype(np.float32)


def test_flat_ground_is_invisible_as_printed_and_seen_whole_as_corrected():
    assert algorithm_1(FLAT, (100, 100), FAN).vis == 0.0
    assert algorithm_1(FLAT, (100, 100), FAN, Mended(ray_advances=True, mast_m=0.7)).vis == 0.0
    assert algorithm_1(FLAT, (100, 100), FAN, CORRECTED).vis == 1.0
    assert visibility.from_node(visibility.scene(FLAT), visibility.beams(10.0, 0.1, 720), 0.7, (100, 100)).index == 1.0


def test_the_ray_is_never_advanced_so_only_the_8_neighbours_are_ever_sampled(rough):
    found = algorithm_1(rough, (100, 100), FAN)
    sampled = np.argwhere(found.noc + found.occ > 0)
    assert np.abs(sampled - 100).max() == 1 and len(sampled) == 8
    assert found.vis < 0.01  # each beam sees its one node at most once, then it is no longer higher than S_max
    advanced = algorithm_1(rough, (100, 100), FAN, Mended(ray_advances=True))
    assert (advanced.noc + advanced.occ > 0).sum() > 30_000


def test_only_what_rises_above_the_sensor_is_visible_with_s_max_0():
    z = FLAT.copy()
    z[100, 150] = 0.69
    below = algorithm_1(z, (100, 100), FAN, Mended(ray_advances=True, mast_m=0.7))
    z[100, 150] = 0.71
    above = algorithm_1(z, (100, 100), FAN, Mended(ray_advances=True, mast_m=0.7))
    assert below.noc.sum() == 0
    assert set(map(tuple, np.argwhere(above.noc))) == {(100, 150)}


def test_without_the_mast_a_step_of_5_cm_hides_all_behind_it():
    z = FLAT.copy()
    z[:, 120] = 0.05
    seen_all = {0.0: [], 0.7: []}
    for mast_m in seen_all:
        found = algorithm_1(z, (100, 100), FAN, Mended(ray_advances=True, flat_is_seen=True, mast_m=mast_m))
        seen_all[mast_m] = int((found.noc[:, 121:] > 0).sum())
    assert seen_all[0.0] == 0
    assert seen_all[0.7] > 10_000  # of 11,300; the shadow is 15 cm long


def test_less_or_equal_makes_one_step_too_many():
    samples = algorithm_1(FLAT, (100, 100), Fan(5.0, 0.1, 4), Mended(ray_advances=True))
    assert (samples.noc + samples.occ).sum() == 4 * 51
    right = algorithm_1(FLAT, (100, 100), Fan(5.0, 0.1, 4), CORRECTED)
    assert (right.noc + right.occ).sum() == 4 * 50


def test_a_step_along_a_3d_vector_is_short_in_the_plan():
    slope = np.tile(np.arange(200) * 0.1 * math.tan(math.radians(30)), (200, 1)).astype(np.float32)
    samples = algorithm_1(slope, (100, 100), Fan(5.0, 0.1, 4), Mended(ray_advances=True))
    taken = samples.noc + samples.occ
    assert taken[100, 101:].sum() == 58  # 5 m / cos 30 degrees and the one too many: 8 cells are sampled twice
    assert taken[101:, 100].sum() == 51


def test_cells_near_the_sensor_count_120_times():
    found = algorithm_1(FLAT, (100, 100), FAN, CORRECTED)
    samples = found.noc + found.occ
    assert samples.max() == 120  # 720 beams, and the node ahead takes those within 30 degrees
    assert samples[100, 101] == 120 and samples[100, 195] == 1


def test_counting_samples_misjudges_vis_and_weights_of_1_over_multiplicity_do_not(rough):
    # study A.4: r 0.924 and 0.9992 against the cardinality, mean 0.584, 0.423 and 0.458 on its ground
    rng = np.random.default_rng(1)
    found = [algorithm_1(rough, tuple(at), FAN, CORRECTED) for at in rng.integers(0, 200, (60, 2))]
    by_samples, by_shares, by_cells = np.array([(f.vis, f.vis_of_shares, f.vis_of_cells) for f in found]).T
    assert np.corrcoef(by_samples, by_cells)[0, 1] == pytest.approx(0.948, abs=0.002)
    assert np.corrcoef(by_shares, by_cells)[0, 1] == pytest.approx(0.9993, abs=0.0002)
    assert by_samples.mean() - by_cells.mean() == pytest.approx(0.107, abs=0.002)
    assert by_shares.mean() - by_cells.mean() == pytest.approx(-0.030, abs=0.002)


def test_with_every_fault_taken_out_it_is_what_flies(rough):
    flies = visibility.total(visibility.scene(rough), visibility.beams(10.0, 0.1, 720), 0.7).index
    for at in ((100, 100), (3, 180), (60, 20)):
        mended = algorithm_1(rough, at, FAN, CORRECTED).vis_of_shares
        assert mended == pytest.approx(flies[at], abs=1e-3)  # where beams meet borders of cells rounding decides
