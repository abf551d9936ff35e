"""A registration is an input of the core: recorded, computed again by a replay, compared, and taken from the record."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from onboard.perception.map.stop_map import Look
from onboard.perception.pose.registration import RegistrationResult
from onboard.perception.scan.lost_beams import LostBeams
from onboard.record import registrations
from onboard.record.rows import ROWS
from onboard.record.schema import decode_inputs, encode_inputs
from onboard.records import Inputs, JobDone, Pose

NOTHING = LostBeams(*[np.zeros((2, 2), np.int64)] * 3, 1.0)


def found(**changed):
    """A registration as they come."""
    root = np.random.default_rng(1).normal(size=(4, 4)) * 0.01
    T_map_base = Pose(1.0, 2.0, 0.3, 0.01, -0.02, 0.7).matrix()
    made = RegistrationResult(True, "", T_map_base, root @ root.T, True, 0.83, 0.0041, 0.021, 0.003, ("z",))
    return replace(made, **changed)


def done(registration, job_id=7):
    return JobDone(job_id, Look(SimpleNamespace(), registration, NOTHING, np.empty((0, 3), np.float32)))


def recorded(*jobs):
    return encode_inputs(Inputs(1, 10, jobs=jobs)).get("/in/registration", b"")


def test_a_recorded_registration_comes_back_to_the_bit():
    refused = found(accepted=False, reason="did not converge", apart_m=math.inf, degenerate=("x", "rotation about z"))
    for registration in (found(), refused):
        (kept,) = registrations.decode(recorded(JobDone(3, "a plan"), done(registration)))
        assert kept.job_id == 7
        for name, value in kept.fields.items():
            assert np.array_equal(value, getattr(registration, name))


def test_jobs_without_a_registration_leave_no_message():
    assert recorded(JobDone(3, "a plan"), done(None)) == b""
    inputs, ids = decode_inputs(encode_inputs(Inputs(1, 10, jobs=(done(found()),))))
    assert inputs.jobs == () and ids == (7,)


def test_a_registration_that_is_off_in_its_last_digits_is_replaced_by_the_recorded_one():
    raw = recorded(done(found()))
    off = found()
    off.T_map_base[:3, 3] += 1e-9
    off.covariance[:] *= 1.0 + 1e-9
    (taken,), apart = registrations.taken((done(off),), raw)
    assert apart == ""
    assert taken.value.registration.T_map_base.tobytes() == found().T_map_base.tobytes()
    assert taken.value.registration.covariance.tobytes() == found().covariance.tobytes()


@pytest.mark.parametrize(("changed", "word"), [
    ({"accepted": False}, "job 7: accepted: recorded True, now False"),
    ({"degenerate": ()}, "job 7: degenerate: recorded ('z',), now ()"),
    ({"T_map_base": Pose(1.0 + 2e-6, 2.0, 0.3, 0.01, -0.02, 0.7).matrix()}, "job 7: T_map_base: apart by 2e-06 m"),
    ({"T_map_base": Pose(1.0, 2.0, 0.3, 0.01, -0.02, 0.70001).matrix()}, "job 7: T_map_base: apart by 0 m, "),
    ({"covariance": np.eye(4)}, "job 7: covariance: apart by "),
    ({"inlier_ratio": 0.84}, "job 7: inlier_ratio: recorded 0.83, now 0.84"),
])  # fmt: skip
def test_a_registration_that_is_another_is_named(changed, word):
    _, apart = registrations.taken((done(found(**changed)),), recorded(done(found())))
    assert apart.startswith(word)


def test_a_registration_that_only_one_of_the_runs_has_is_named():
    raw = recorded(done(found()))
    assert registrations.taken((done(None),), raw)[1] == "job 7: recorded a registration, now none"
    assert registrations.taken((done(found()),), b"")[1] == "job 7: recorded none, now a registration"
    assert registrations.taken((), raw)[1] == "job 7: recorded a registration, not taken now"


def test_the_row_of_a_recorded_registration_is_plain_values():
    (row,) = ROWS["/in/registration"](recorded(done(found())))
    assert row["job_id"] == 7 and row["accepted"] is True and len(row["covariance"]) == 16
