"""The table of strategies: each by its name in the configuration, without hidden chance."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest

from onboard.config import Mission
from onboard.planning.sensing import next_position as nsp
from onboard.planning.sensing.gain import Eyes
from onboard.planning.sensing.next_position import Criterion, Question
from onboard.planning.sensing.strategies import STRATEGIES, next_position
from onboard.records import Grid

EYES = Eyes(range_m=0.6, beams=36)


def question(seed=0):
    rng = np.random.default_rng(seed)
    z = rng.normal(0, 0.15, (20, 20)).astype(np.float32)
    z[:, 14:] = np.nan
    cost = rng.uniform(0.5, 3.0, (20, 20)).astype(np.float32)
    return Question(Grid(0.0, 0.0, 0.1, 20, 20), z, rng.random((20, 20)) < 0.8, cost, (1.9, 1.0))


def test_table_and_configuration_name_the_same_strategies():
    row = next(f for f in dataclasses.fields(Mission) if f.name == "strategy")
    assert row.metadata["one_of"] == tuple(STRATEGIES)


def test_optimistic_scores_nothing():
    assert next_position(question(), EYES, Mission(), 1) is None


@pytest.mark.parametrize(("name", "gain"), [("explore", "newly-seen"), ("visibility", "visibility")])
def test_exhaustive_strategies_score_by_their_gain_and_the_weights_of_the_configuration(name, gain):
    mission = Mission(strategy=name, weight_occlusion=0.7, weight_distance=0.2)
    found = next_position(question(), EYES, mission, 1)
    wanted = nsp.choose(question(), EYES, Criterion(gain, 0.7, 0.2))
    assert found.best == wanted.best
    assert np.array_equal(found.score_map, wanted.score_map, equal_nan=True)


def test_hill_climb_depends_on_the_stop_and_the_map_alone():
    mission = Mission(strategy="hill-climb")
    first = next_position(question(), EYES, mission, 3)
    again = next_position(question(), EYES, mission, 3)
    assert np.array_equal(first.score_map, again.score_map, equal_nan=True)
    other = next_position(question(), EYES, mission, 4)
    assert not np.array_equal(np.isnan(first.score_map), np.isnan(other.score_map))
    fewer = replace(question(), free=question().free & (np.arange(20) != 2))
    moved = next_position(fewer, EYES, mission, 3)
    assert not np.array_equal(np.isnan(first.score_map), np.isnan(moved.score_map))


def test_hill_climb_scores_fewer_and_is_never_better():
    for seed in range(5):
        climbed = next_position(question(seed), EYES, Mission(strategy="hill-climb"), 1)
        whole = next_position(question(seed), EYES, Mission(strategy="visibility"), 1)
        assert climbed.scored < whole.scored
        assert climbed.best.score <= whole.best.score
