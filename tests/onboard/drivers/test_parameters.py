"""Parameters in flight: one source with the configuration, refused with what is allowed, kept whole or not at all."""

import dataclasses
import json
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard import config
from onboard.config import AT_ONCE, NEXT_MISSION, RESTART, Config
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.drivers.storage import map_tiles as disk
from onboard.drivers.storage.state_folder import StateFolder, read_kept
from onboard.parameters import MOST_CHANGES, TABLE, ParameterSet, listing, recalled
from onboard.record.replay import replay
from onboard.record.writer import Recorder
from onboard.records import Inputs, LinkMessage
from onboard.records.status import Save, SaveResult
from protocol.link.datagrams import DatagramKind
from protocol.link.transactions import RequestState
from protocol.tables import commands
from tests.onboard.core_bench import QUICK, CoreBench, quick

WHO = (1_000_000_000, 4, 2)
SETTABLE = [row for row in TABLE.values() if row.takes != RESTART]
KEEPING = quick(state=config.State(folder="somewhere"))


def numbers(row):
    field = next(f for f in dataclasses.fields(getattr(Config(), row.section)) if f.name == row.key)
    return field.metadata["low"], field.metadata["high"], type(getattr(getattr(Config(), row.section), row.key))


# -- the table -------------------------------------------------------------------------------------------------


def test_every_key_of_the_configuration_is_a_parameter_and_there_is_no_other():
    keys = {
        f"{s.name}.{k.name}" for s in dataclasses.fields(Config) for k in dataclasses.fields(getattr(Config(), s.name))
    }
    assert set(TABLE) == keys
    assert {row.takes for row in TABLE.values()} == {AT_ONCE, NEXT_MISSION, RESTART}


def test_geometry_ports_keys_and_clock_change_with_a_restart_only():
    for section in ("rover", "can", "lidar", "link", "clock", "localisation", "record", "state"):
        assert {row.takes for row in TABLE.values() if row.section == section} == {RESTART}
    assert {TABLE[name].takes for name in ("mapping.cell_m", "mapping.folder", "mission.gdem")} == {RESTART}


@pytest.mark.parametrize("row", SETTABLE, ids=lambda row: row.name)
def test_a_settable_number_takes_its_bounds_and_nothing_beyond(row):
    low, high, kind = numbers(row)
    before = ParameterSet(Config())
    if low is None:
        return
    for bound in (low, high):
        made = before.set(row.name, repr(kind(bound)), WHO)
        assert getattr(getattr(made.config, row.section), row.key) == kind(bound)
    with pytest.raises(ValueError, match="out of range"):
        before.set(row.name, repr(kind(high * 2 + 1)), WHO)
    with pytest.raises(ValueError, match="should be"):
        before.set(row.name, "fast", WHO)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("motion.cruise", "0.1", "unknown parameter `motion.cruise`; did you mean `motion.cruise_mps`?"),
        ("rover.half_track_m", "0.3", "changes with a restart only"),
        ("mission.strategy", "optimist", "did you mean 'optimistic'?"),
        ("drive_guard.on", "1", "should be bool"),
        ("motion.cruise_mps", "nan", "out of range 0.005 to 2"),
    ],
)
def test_a_refusal_says_what_is_allowed(name, text, words):
    with pytest.raises(ValueError) as caught:
        ParameterSet(Config()).set(name, text, WHO)
    assert words in str(caught.value)


def test_a_change_knows_its_version_what_it_was_when_and_who_made_it():
    made = ParameterSet(Config()).set("motion.cruise_mps", "0.09", WHO).set("mission.strategy", "explore", (5, 4, 1))
    assert made.version == 2 and made.config.mission.strategy == "explore"
    assert str(made.last("motion.cruise_mps")) == (
        "version 1: motion.cruise_mps 0.11 -> 0.09 at 1.0 s of boot 4 by station 2"
    )


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["motion.cruise_mps", "safety.tilt_limit_rad", "planning.step_m"]), st.floats(0.1, 0.9)
        ),
        max_size=12,
    )
)
@settings(max_examples=50, deadline=None, derandomize=True)
def test_what_is_kept_comes_back_whole_with_its_history(changes):
    made = ParameterSet(Config())
    for name, value in changes:
        made = made.set(name, repr(value), WHO)
    again, dropped = recalled(Config(), made.to_json())
    assert again == made and not dropped


def test_the_history_is_bounded_and_the_values_outlive_it():
    made = ParameterSet(Config()).set("mission.strategy", "explore", WHO)
    for n in range(MOST_CHANGES):
        made = made.set("motion.cruise_mps", repr(0.1 + n / 1000), WHO)
    assert len(made.changes) == MOST_CHANGES and made.last("mission.strategy") is None
    assert recalled(Config(), made.to_json())[0].config.mission.strategy == "explore"


def test_what_is_kept_and_no_longer_allowed_is_dropped_alone_and_said():
    kept = {
        "version": 9,
        "changes": [],
        "values": {"motion.cruise_mps": "99.0", "motion.gone": "1", "mission.strategy": '"explore"'},
    }
    made, dropped = recalled(Config(), json.dumps(kept).encode())
    assert made.config == replace(Config(), mission=config.Mission(strategy="explore")) and made.version == 9
    assert [line.split(":")[0] for line in dropped] == ["dropped motion.cruise_mps", "dropped motion.gone"]


@given(st.binary(max_size=80) | st.sampled_from([b"{}", b"[]", b'{"version": {}, "values": 1, "changes": [1]}']))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_damaged_bytes_are_said_and_the_configuration_stands(data):
    made, dropped = recalled(Config(), data)
    assert made == ParameterSet(Config()) and bool(dropped) is bool(data)


def test_the_listing_has_every_parameter_its_range_and_when_it_changes():
    text = listing(ParameterSet(Config()).set("motion.cruise_mps", "0.09", WHO))
    assert "* motion.cruise_mps = 0.09  # 0.005 to 2; speed on a path; with the next mission" in text
    assert sum(not line.startswith("#") for line in text.splitlines()) == len(TABLE)


# -- the orders ------------------------------------------------------------------------------------------------


def said(rover, name, **arguments):
    request = rover.order(name, **arguments)
    rover.run(0.05)
    return request, rover.states(request)[-1], rover.text(request)


def test_a_parameter_is_set_told_and_in_effect_at_once_where_it_says_so():
    rover = CoreBench(settings=KEEPING)
    rover.settle()
    _, state, text = said(rover, "param_set", parameter="safety.tilt_limit_rad", value="0.2")
    assert state is RequestState.COMPLETED and text.endswith("-> 0.2, at once; version 1, not saved")
    assert rover.told("PARAMETER")
    _, _, text = said(rover, "param_get", parameter="safety.tilt_limit_rad")
    assert text.startswith("safety.tilt_limit_rad = 0.2, at once; ")
    rover.tilt_rad = 0.3
    rover.until(lambda: rover.told("FAULT") != [], 10.0)
    assert rover.told("FAULT")[0][1].startswith("TILT_ANGLE")


def test_a_refused_parameter_changes_nothing():
    rover = CoreBench(settings=KEEPING)
    rover.settle()
    for name, value in (("motion.cruise_mps", "9"), ("rover.belly_m", "0.2"), ("no.such", "1")):
        assert said(rover, "param_set", parameter=name, value=value)[1] is RequestState.FAILED
    assert rover.rover.config == KEEPING and not rover.told("PARAMETER")


def test_a_save_is_an_output_and_is_completed_by_its_result():
    rover = CoreBench(settings=KEEPING)
    rover.settle()
    said(rover, "param_set", parameter="motion.cruise_mps", value="0.09")
    request = rover.order("param_save")
    while not rover.step().saves:
        pass
    (save,) = rover.outputs.saves
    assert recalled(KEEPING, save.data)[0].config.motion.cruise_mps == 0.09
    rover.run(0.1)
    assert rover.states(request) == [RequestState.STARTED]
    rover.saved = (SaveResult("parameters"),)
    rover.run(0.1)
    assert rover.states(request)[-1] is RequestState.COMPLETED and rover.text(request) == "version 1 is kept"


def test_a_save_that_fails_says_why_and_may_be_asked_again():
    rover = CoreBench(settings=KEEPING)
    rover.settle()
    for error in ("not kept: No space left on device", ""):
        request = rover.order("param_save")
        rover.run(0.05)
        rover.saved = (SaveResult("parameters", error),)
        rover.run(0.1)
        assert rover.states(request)[-1] is (RequestState.FAILED if error else RequestState.COMPLETED)


def test_without_a_folder_a_save_is_refused():
    rover = CoreBench(settings=QUICK)
    rover.settle()
    assert said(rover, "param_save")[1:] == (RequestState.FAILED, "no folder to keep them in: state.folder is empty")


# -- the disk --------------------------------------------------------------------------------------------------


def test_what_was_saved_is_there_at_the_next_start(tmp_path):
    folder = StateFolder(str(tmp_path / "state"), wait=True)
    folder.start([Save("parameters", ParameterSet(Config()).set("motion.cruise_mps", "0.09", WHO).to_json())])
    assert folder.collect() == (SaveResult("parameters"),) and folder.collect() == ()
    folder.close()
    rover = Rover(Config(), None, None, read_kept(str(tmp_path / "state")))
    assert rover.config.motion.cruise_mps == 0.09


@pytest.mark.parametrize("broken", ["fsync", "replace"])
def test_a_write_that_breaks_leaves_the_old_file_whole_and_no_other(tmp_path, monkeypatch, broken):
    folder = StateFolder(str(tmp_path), wait=True)
    folder.start([Save("parameters", b"old")])
    folder.collect()

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(*((disk.os, "fsync") if broken == "fsync" else (disk.Path, "replace")), fail)
    folder.start([Save("parameters", b"new")])
    assert folder.collect() == (SaveResult("parameters", "not kept: No space left on device"),)
    folder.close()
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"parameters.json": b"old"}


def test_a_run_that_began_with_kept_parameters_and_saved_more_replays_to_the_same_bytes(tmp_path):
    tree = config.load(None, {"record.path": str(tmp_path / "run.mcap"), "state.folder": str(tmp_path)})
    kept = {"parameters": ParameterSet(tree).set("motion.cruise_mps", "0.09", WHO).to_json()}
    rover, saved = Rover(tree, None, None, kept), ()
    orders = {5: ("param_set", {"parameter": "motion.cruise_mps", "value": "0.08"}), 8: ("param_save", {})}
    with Recorder(tree, None, kept=kept) as recorder:
        for number in range(1, 40):
            now_ns, heard = number * 10_000_000, ()
            if number in orders:
                payload = commands.encode(commands.Telecommand(number, 0, 0, *orders[number]))
                heard = (LinkMessage(now_ns, True, "ok", 1, DatagramKind.TELECOMMAND, payload),)
            inputs = Inputs(number, now_ns, link_messages=heard, saved=saved)
            outputs = tick(rover, inputs)
            saved = tuple(SaveResult(save.name) for save in outputs.saves)
            recorder.write(inputs, outputs)
    assert rover.config.motion.cruise_mps == 0.08
    verdict = replay(tmp_path / "run.mcap")
    assert verdict.identical and verdict.bytes_compared["/out/disk"] > 100
