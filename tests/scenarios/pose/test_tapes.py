"""A tape has all inputs of the estimator: run over it, the estimator gives the flight's results, bit for bit."""

from dataclasses import replace

import numpy as np
import pytest

from hil.run.in_process import InMemory
from hil.scenarios.model import Scenario
from onboard.perception.pose.localisation import Localisation
from tests.scenarios.pose.localisation import Watch, ground_of
from tests.scenarios.pose.tapes import Player, Recorder, load

pytestmark = [pytest.mark.mission, pytest.mark.xdist_group("tape")]  # flown once


@pytest.fixture(scope="module")
def tape(tmp_path_factory):
    """The looks of the first stop, the turn between them, the way to the second and its scan: stored and read back."""
    bench = InMemory(Scenario(seed=1), ground=ground_of(1)[1], step_ns=5_000_000)
    recorder, config = Recorder(), bench.rover.config
    watch = Watch(Localisation(config.rover, config.localisation), recorder)
    recorder.attach(bench)
    while len(recorder.scans) < 3:
        bench.step(watch)
    for _ in range(50):
        bench.step(watch)
    bench.free()
    path = tmp_path_factory.mktemp("tapes") / "1.npz"
    recorder.tape().save(path)
    return load(path)


def test_the_estimate_over_a_tape_is_that_of_the_flight(tape):
    assert [scan.again for scan in tape.scans] == [False, True, False]
    played = Player(tape, tape.figures).run()
    assert np.array_equal(played.said, tape.said)
    assert len(played.after) == 1


def test_other_figures_give_another_estimate(tape):
    played = Player(tape, replace(tape.figures, slope_slip_ratio=0.0)).run()
    assert np.abs(played.said - tape.said).max() > 0.005
