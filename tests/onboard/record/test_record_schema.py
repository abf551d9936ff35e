"""What the record keeps of a tick is all of it."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.record.reader import DamagedRecordError, time_ns_of
from onboard.record.schema import TICK, decode_inputs, encode_inputs, encode_outputs, input_checks
from onboard.records import (
    BusStatus,
    BusTrouble,
    Chunk,
    Frame,
    Health,
    Inputs,
    JobDone,
    JobRequest,
    LinkMessage,
    Machine,
    Outputs,
    PortState,
    Timing,
)
from onboard.records.status import SaveResult

TIMES = st.integers(0, 2**50)
STATES = st.sampled_from(PortState)
INPUTS = st.builds(
    Inputs,
    tick=st.integers(0, 2**40),
    now_ns=TIMES,
    can_frames=st.lists(st.builds(Frame, st.integers(0, 2047), st.binary(max_size=8), TIMES), max_size=5).map(tuple),
    can=st.builds(
        BusStatus,
        STATES,
        st.text(max_size=40),
        st.integers(0, 2**31),
        st.integers(0, 2**31),
        st.tuples(*[st.integers(0, 2**31)] * len(BusTrouble)),
    ),
    lidar_chunks=st.lists(st.builds(Chunk, TIMES, st.binary(max_size=100)), max_size=4).map(tuple),
    lidar_state=STATES,
    link_messages=st.lists(
        st.builds(
            LinkMessage,
            TIMES,
            st.booleans(),
            st.sampled_from(["ok", "tag"]),
            st.integers(0, 9),
            st.integers(0, 5),
            st.binary(max_size=50),
        ),
        max_size=3,
    ).map(tuple),
    link_state=STATES,
    health=st.builds(Health, TIMES, TIMES, TIMES),
    machine=st.none() | st.builds(Machine, *[st.floats(allow_nan=False)] * len(Machine._fields)),
    saved=st.lists(
        st.builds(SaveResult, st.sampled_from(["parameters", "fences"]), st.text(max_size=50)), max_size=3
    ).map(tuple),
    timing=st.builds(Timing, TIMES, st.lists(TIMES, max_size=10).map(tuple), st.lists(TIMES, max_size=3).map(tuple)),
)


@given(INPUTS, st.lists(st.integers(1, 2**30), max_size=3))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_inputs_come_back_as_they_were(inputs, job_ids):
    jobs = tuple(JobDone(job_id, None) for job_id in job_ids)
    messages = encode_inputs(Inputs(**{**{n: getattr(inputs, n) for n in inputs.__slots__}, "jobs": jobs}))
    read, ids = decode_inputs(messages)
    assert read == inputs
    assert list(ids) == job_ids


def test_outputs_guard_the_inputs_they_came_from():
    before = encode_inputs(Inputs(1, 10, lidar_chunks=(Chunk(3, b"abc"),)))
    checks = input_checks(encode_outputs(Outputs(state_digest=bytes(8)), before)["/out/tick"])
    flipped = {**before, "/in/lidar": before["/in/lidar"][:-1] + b"d"}
    again = input_checks(encode_outputs(Outputs(state_digest=bytes(8)), flipped)["/out/tick"])
    assert [topic for topic in checks if checks[topic] != again[topic]] == ["/in/lidar"]


def test_in_lock_step_the_record_holds_no_times():
    assert "/in/time" not in encode_inputs(Inputs(1, 10))


def test_cancelled_jobs_are_told_from_new_ones():
    before = encode_inputs(Inputs(1, 10))
    new = encode_outputs(Outputs(state_digest=bytes(8), jobs=(JobRequest(5, "", "", (), 9),)), before)["/out/tick"]
    gone = encode_outputs(Outputs(state_digest=bytes(8), cancelled=(5,)), before)["/out/tick"]
    assert len(new) == len(gone) and new != gone


def test_a_time_before_the_start_is_damage_and_not_a_message_of_an_export():
    with pytest.raises(DamagedRecordError, match=r"tick 7, channel /in/tick: .* -1 ns"):
        time_ns_of(7, {"/in/tick": TICK.pack(7, -1, 0, 0, 0, 0, 0)})
