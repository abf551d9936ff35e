"""Tests of errors on an ideal sweep: the required number and kind, and equal errors for equal seeds."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.config import load
from onboard.records import BeamStatus, Scan
from tests.missions.guard.guarded import line_scanner
from tests.missions.world.scan_errors import CLUMP, EDGE_M, ScanErrors, lost, mixed, outliers
from tests.missions.world.small import world

LINES, BEAMS = 200, 500


def sweep(ranges_m):
    status = np.full(ranges_m.shape, BeamStatus.OK, np.uint8)
    return tuple(Scan(0, 1.0, 0.0, 0.01, r.astype(np.float32), s) for r, s in zip(ranges_m, status))


def runs_of(gone):
    """Lengths of the runs of lost beams, line by line."""
    edges = np.diff(np.pad(gone.astype(int), ((0, 0), (1, 1))), axis=1)
    return np.nonzero(edges == -1)[1] - np.nonzero(edges == 1)[1]


@pytest.mark.parametrize("ratio", [0.001, 0.01, 0.05])
@pytest.mark.parametrize("clump", [(1, 1), CLUMP])
def test_the_share_of_lost_beams_is_the_one_asked_for(ratio, clump):
    gone = lost((LINES, BEAMS), ratio, clump, np.random.default_rng(1))
    assert ratio <= gone.mean() <= ratio + clump[1] / gone.size


def test_clumps_have_3_to_30_beams_side_by_side():
    lengths = runs_of(lost((LINES, BEAMS), 0.002, CLUMP, np.random.default_rng(2)))
    whole = lengths[lengths >= CLUMP[0]]
    assert len(whole) >= 0.9 * len(lengths)  # those at a line's end are cut
    assert whole.min() < 8 and 25 < whole.max() <= 2 * CLUMP[1]  # two may touch
    assert whole.mean() == pytest.approx(16.5, abs=5.0)


def test_a_lost_beam_has_the_code_of_no_return_and_no_range():
    made = ScanErrors(lost_ratio=0.05).apply(sweep(np.full((20, 100), 4.0)), np.random.default_rng(3))
    gone = np.array([scan.status for scan in made]) == BeamStatus.NO_RETURN
    assert gone.sum() == 100
    assert np.isnan(np.array([scan.ranges_m for scan in made]))[gone].all()
    assert (np.array([scan.ranges_m for scan in made])[~gone] == 4.0).all()


def test_outliers_are_as_many_as_asked_both_ways_and_within_their_bound():
    true_m = np.full((LINES, BEAMS), 3.0, np.float32)
    off = outliers(true_m, np.zeros(true_m.shape, np.uint8), 0.01, 0.5, np.random.default_rng(4)) - true_m
    wrong = off[off != 0]
    assert len(wrong) == pytest.approx(0.01 * off.size, rel=0.15)
    assert np.abs(wrong).max() <= 0.5 + 1e-6 and wrong.min() < -0.4 and wrong.max() > 0.4


def test_only_the_farther_beam_at_an_edge_is_mixed_and_lies_between_both_surfaces():
    true_m = np.full((LINES, BEAMS), 5.0, np.float32)
    true_m[:, 100:200] = 2.0
    true_m[:, 300:] = 5.0 + EDGE_M / 2  # no edge
    found = mixed(true_m, np.zeros(true_m.shape, np.uint8), 1.0, np.random.default_rng(5))
    changed = np.unique(np.nonzero(found != true_m)[1])
    assert changed.tolist() == [99, 200]
    assert ((found[:, changed] >= 2.0) & (found[:, changed] <= 5.0)).all()
    tenth = mixed(true_m, np.zeros(true_m.shape, np.uint8), 0.1, np.random.default_rng(5)) != true_m
    assert tenth.sum() == pytest.approx(0.1 * 2 * LINES, rel=0.4)


def test_the_same_seed_gives_the_same_sweep():
    errors = ScanErrors(0.01, CLUMP, 0.001, 0.5, 0.1)
    ideal = sweep(np.random.default_rng(0).uniform(1.0, 8.0, (20, 100)))
    first, again, other = (errors.apply(ideal, np.random.default_rng(seed)) for seed in (6, 6, 7))
    assert all(np.array_equal(a.ranges_m, b.ranges_m, equal_nan=True) for a, b in zip(first, again))
    assert any(not np.array_equal(a.status, b.status) for a, b in zip(first, other))


def test_a_line_of_the_held_scanner_has_errors_as_asked_and_no_range_without_a_witness():
    config, ground = load(None, {}), world(half_m=12.0)
    pose = ground.stand(0.0, 0.0, 0.0, config.rover)
    ideal = line_scanner(config)
    lossy, wrong = (replace(ideal, errors=ScanErrors(**of)) for of in ({"lost_ratio": 0.2}, {"outlier_ratio": 0.01}))
    whole, few, off = (made.line(ground, pose, pose, np.random.default_rng(8)) for made in (ideal, lossy, wrong))
    assert whole.hit.mean() > 0.99
    assert few.hit.sum() == pytest.approx(0.8 * whole.hit.sum(), rel=0.1) and len(few.ends_m) > few.hit.sum()
    high_m = np.abs(off.ends_m[off.hit, 2] - whole.ends_m[:, 2].mean())
    assert off.hit.sum() < whole.hit.sum() and high_m.max() < 0.15
