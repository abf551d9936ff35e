"""What outlives the program: the pose in flight, the number of the start, and what the disk says of them."""

import json
import math
import os
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard import app
from onboard.config import Localisation, State
from onboard.core.pose_store import STEP_M, STEP_RAD
from onboard.core.rover import Rover
from onboard.drivers.storage import map_tiles as disk
from onboard.drivers.storage.map_tiles import Keeper, write_whole
from onboard.drivers.storage.state_folder import StateFolder, count_boot, read_kept
from onboard.journal import Level
from onboard.perception.map.stop_map import NO_POINTS, StopMap
from onboard.perception.pose.pose_filter import RESUME_SIGMA
from onboard.records.status import Save, SaveResult
from protocol.tables.modes import Mode
from tests.onboard.core_bench import QUICK, CoreBench
from tests.onboard.drivers.test_disk import seen

KEEPS = replace(QUICK, state=State(folder="somewhere"))


def driven(settings=KEEPS, seconds=10.0, **order):
    """A rover that was ordered to drive, and every pose that it asked to be kept; the disk answers at once."""
    rover = CoreBench(settings=settings)
    rover.settle()
    words = {"vx_mps": 0.1, "vy_mps": 0.0, "yaw_radps": 0.0, "duration_s": 30.0, "distance_m": 2.0} | order
    rover.order("drive", **words)
    kept = []
    for _ in range(round(seconds * 100)):
        rover.step()
        saves = [save for save in rover.outputs.saves if save.name == "pose"]
        kept += [(json.loads(save.data), rover.rover.localisation.pose) for save in saves]
        rover.saved = tuple(SaveResult(save.name) for save in saves)
    return rover, kept


# -- the pose ----------------------------------------------------------------------------------------------------


def test_the_pose_is_kept_whenever_it_has_moved_five_centimetres():
    rover, kept = driven()
    ways = [math.dist((0.0, 0.0), tree["place"][:2]) for tree, _ in kept]
    assert len(ways) >= 10 and all(STEP_M <= b - a < STEP_M + 0.005 for a, b in zip([0.0, *ways], ways))
    assert rover.rover.localisation.pose.x_m - ways[-1] < STEP_M


def test_the_pose_is_kept_whenever_it_has_turned_three_degrees():
    _, kept = driven(vx_mps=0.0, yaw_radps=0.2)
    turns = [tree["place"][3] for tree, _ in kept]
    assert len(turns) > 10 and all(STEP_RAD <= b - a < STEP_RAD + 0.01 for a, b in zip([0.0, *turns], turns))


def test_a_standing_rover_writes_nothing_and_one_without_a_folder_never():
    assert driven(vx_mps=0.0, yaw_radps=0.0)[1] == []
    assert driven(settings=QUICK)[1] == []


def test_a_slow_disk_thins_the_poses_out_and_one_is_written_at_a_time():
    rover = CoreBench(settings=KEEPS)
    rover.settle()
    rover.order("drive", vx_mps=0.1, vy_mps=0.0, yaw_radps=0.0, duration_s=30.0, distance_m=2.0)
    asked = []
    for n in range(1000):
        rover.step()
        asked += [n for save in rover.outputs.saves if save.name == "pose"]
        rover.saved = (SaveResult("pose"),) if asked and n == asked[-1] + 200 else ()
    assert len(asked) >= 4 and min(b - a for a, b in pairwise(asked)) > 200


def kept_in(tree):
    return {"pose": json.dumps(tree).encode()}


def test_the_next_start_is_where_the_last_pose_was_and_as_unsure_as_that_and_a_step():
    _, kept = driven()
    tree, was = kept[-1]
    rover = Rover(KEEPS, None, None, kept_in(tree))
    now = rover.localisation.pose
    assert (now.x_m, now.y_m, now.z_m, now.yaw_rad) == (was.x_m, was.y_m, was.z_m, was.yaw_rad)
    for sigma, before, step in zip(rover.localisation.sigmas, tree["sigma"], RESUME_SIGMA, strict=True):
        assert sigma == pytest.approx(math.hypot(before, step))
    assert [event.text[:23] for event in rover.keeping.events] == ["the rover is where it w"]
    assert rover.executive.mode is Mode.STANDBY


def test_what_the_rover_moved_after_the_last_kept_pose_is_put_right_by_a_registration_and_the_map_keeps_its_doubt():
    """The kept sigma is an error of the map as well: no look at that map can take it away."""
    tree = {"place": [5.0, 1.0, 0.0, 0.5], "sigma": [0.1, 0.1, 0.02, 0.01], "start": [0.0, 0.0, 0.0]}
    filter_ = Rover(KEEPS, None, None, kept_in(tree)).localisation._filter
    truth = [5.06, 0.97, 0.01, 0.53]
    filter_.see_pose(np.array(truth), np.diag([0.004] * 3 + [4e-4]) ** 2)
    assert filter_.state[:4] == pytest.approx(truth, abs=2e-3)
    assert math.sqrt(filter_.covariance[0, 0]) == pytest.approx(0.1, rel=0.05)


def test_a_rover_that_was_carried_is_where_the_configuration_says():
    _, kept = driven()
    carried = replace(KEEPS, localisation=Localisation(start_x_m=7.0))
    rover = Rover(carried, None, None, kept_in(kept[-1][0]))
    assert rover.localisation.pose.x_m == 7.0
    assert "another start" in rover.keeping.events[0].text


@given(st.one_of(
    st.binary(max_size=80),
    st.fixed_dictionaries({"place": st.lists(st.floats() | st.text(max_size=3), max_size=5),
                           "sigma": st.lists(st.floats(), max_size=5), "start": st.just([0.0, 0.0, 0.0])})
    .map(lambda tree: json.dumps(tree).encode()),
))  # fmt: skip
@settings(max_examples=60, deadline=None)
def test_whatever_lies_in_the_file_the_rover_starts_at_a_finite_pose_and_says_what_it_took(data):
    rover = Rover(KEEPS, None, None, {"pose": data})
    pose = rover.localisation.pose
    assert all(math.isfinite(v) and abs(v) <= 1e5 for v in (pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad))
    assert all(math.isfinite(sigma) for sigma in rover.localisation.sigmas)
    assert len(rover.keeping.events) == bool(data)


# -- the disk fails ----------------------------------------------------------------------------------------------


def test_a_disk_that_takes_nothing_is_told_once_and_again_when_it_does_and_the_rover_drives_on():
    rover = CoreBench(settings=KEEPS)
    rover.settle()
    request = rover.order("drive", vx_mps=0.1, vy_mps=0.0, yaw_radps=0.0, duration_s=12.0, distance_m=2.0)
    for n in range(1400):
        rover.step()
        full = "not kept: No space left on device" if n < 700 else ""
        rover.saved = tuple(SaveResult(save.name, full) for save in rover.outputs.saves)
    told = [event.text for event in rover.events if event.name == "STATE"]
    assert told == ["pose: not kept: No space left on device", "pose: kept again"]
    assert rover.states(request)[-1].name == "COMPLETED" and rover.pose[0] > 1.0


@pytest.mark.parametrize("number", [28, 30], ids=["full", "read-only"])
def test_on_a_disk_that_is_full_or_read_only_parameters_pose_and_map_are_not_kept_and_nothing_raises(
    tmp_path, monkeypatch, number
):
    """Every call that changes the disk fails as the kernel has it fail; root may write to read-only folders."""

    def fails(*_, **__):
        raise OSError(number, os.strerror(number))

    for name in ("open", "mkdir", "unlink", "replace"):
        monkeypatch.setattr(disk.Path, name, fails)
    why = f"not kept: {os.strerror(number)}"
    folder = StateFolder(str(tmp_path / "state"), wait=True)
    folder.start([Save("pose", b"{}"), Save("parameters", b"{}")])
    assert folder.collect() == (SaveResult("pose", why), SaveResult("parameters", why))
    folder.close()
    told = []
    keeper = Keeper(str(tmp_path / "map"), None, told.append, wait=True)
    keeper.keep(StopMap(seen(0.5), NO_POINTS))
    assert keeper.collect() == (SaveResult("map", why),) and len(told) == 2
    keeper.close()
    boot, trouble = count_boot(str(tmp_path / "state"), 3)
    assert boot == 3 and os.strerror(number) in trouble


# -- power cuts --------------------------------------------------------------------------------------------------


class PowerCut(BaseException):
    """The power is gone."""


class Medium:
    """What the disk itself holds: a file's bytes as its last fsync left them, a folder's names as its last one did.

    `after_cut` are all the contents that a file may have when the power comes back.
    """

    def __init__(self, monkeypatch, path):
        self.path, self.names = path, {path.name: path.read_bytes()} if path.exists() else {}
        self.forced, self.pending = dict(self.names), []
        force, replace_ = os.fsync, Path.replace

        def fsync(descriptor):
            at = Path(os.readlink(f"/proc/self/fd/{descriptor}"))
            if at.is_dir():
                self.pending.clear()
                self.names = {name: self.forced.get(name, self.names.get(name)) for name in os.listdir(at)}
            else:
                self.forced[at.name] = at.read_bytes()
            force(descriptor)

        def rename(source, target):
            self.pending.append((source.name, target.name))
            self.forced[target.name] = self.forced.pop(source.name, None)
            return replace_(source, target)

        monkeypatch.setattr(os, "fsync", fsync)
        monkeypatch.setattr(Path, "replace", rename)

    def after_cut(self):
        """Contents of the path if the power goes now: with the pending rename on the disk, or without."""
        with_it = {self.forced.get(self.path.name)} if self.pending else set()
        return with_it | {self.names.get(self.path.name)}


def careless(path, data):
    """As write_whole, but nothing is forced: what a model of power cuts must find."""
    temporary = path.with_suffix(".new")
    temporary.write_bytes(data)
    temporary.replace(path)


@pytest.mark.parametrize("first", [b"", b"old state"])
def test_a_power_cut_between_any_two_steps_leaves_the_old_state_or_the_new_one(tmp_path, monkeypatch, first):
    path = tmp_path / "parameters.json"
    if first:
        path.write_bytes(first)
    medium, seen = Medium(monkeypatch, path), set()
    steps = [("open", Path), ("replace", Path), ("fsync", os)]
    for name, owner in steps:
        whole = getattr(owner, name)

        def stepped(*words, whole=whole, **named):
            seen.update(medium.after_cut())
            made = whole(*words, **named)
            seen.update(medium.after_cut())
            return made

        monkeypatch.setattr(owner, name, stepped)
    write_whole(path, b"new state")
    assert seen == {first or None, b"new state"} and medium.after_cut() == {b"new state"}


def test_the_model_of_power_cuts_sees_a_writer_that_forces_nothing(tmp_path, monkeypatch):
    path = tmp_path / "parameters.json"
    path.write_bytes(b"old")
    medium = Medium(monkeypatch, path)
    careless(path, b"new")
    assert medium.after_cut() == {None, b"old"}  # the name without its bytes


OLD, NEW = b'{"version": 1}', b'{"version": 2, "values": {"motion.cruise_mps": "0.09"}}'


@pytest.mark.parametrize("cut", range(len(NEW) + 1))
def test_a_temporary_file_cut_at_any_byte_is_not_read_and_does_not_hinder_the_next_save(tmp_path, cut):
    write_whole(tmp_path / "parameters.json", OLD)
    (tmp_path / "parameters.new").write_bytes(NEW[:cut])  # the power went here; a lost one is test 0 of none
    assert read_kept(str(tmp_path)) == {"parameters": OLD}
    folder = StateFolder(str(tmp_path), wait=True)
    folder.start([Save("parameters", NEW)])
    assert folder.collect() == (SaveResult("parameters"),)
    folder.close()
    assert read_kept(str(tmp_path)) == {"parameters": NEW} and not list(tmp_path.glob("*.new"))


# -- the number of the start ---------------------------------------------------------------------------------------


def test_every_start_has_a_number_of_its_own_and_it_is_on_the_disk_before_it_is_used(tmp_path):
    folder = str(tmp_path / "state")
    assert [count_boot(folder, 1) for _ in range(3)] == [(1, ""), (2, ""), (3, "")]
    assert count_boot(folder, 40) == (40, "") and count_boot(folder, 1) == (41, "")
    assert (tmp_path / "state" / "boots.json").read_text() == "41"


def test_without_a_folder_the_configuration_says_the_number_and_an_unreadable_one_is_told(tmp_path):
    assert count_boot("", 5) == (5, "") and not list(tmp_path.iterdir())
    (tmp_path / "boots.json").write_text("many")
    number, trouble = count_boot(str(tmp_path), 5)
    assert number == 5 and "boots.json" in trouble
    assert count_boot(str(tmp_path), 5) == (6, "")


@pytest.mark.parametrize("number", [2**32 - 1, 10**30, -1])
def test_a_number_of_a_start_that_the_link_cannot_carry_is_told_as_unreadable(tmp_path, number):
    (tmp_path / "boots.json").write_text(str(number))
    assert count_boot(str(tmp_path), 5)[0] == 5 and count_boot(str(tmp_path), 5) == (6, "")
    (tmp_path / "boots.json").write_text(str(2**32 - 2))
    assert count_boot(str(tmp_path), 5) == (2**32 - 1, "")


def test_the_flight_program_takes_the_number_for_its_link_and_tells_trouble_as_an_error(tmp_path, monkeypatch):
    config = replace(KEEPS, state=State(folder=str(tmp_path)))
    told = []
    assert [app._counted(config, lambda *words: told.append(words)).link.boot_count for _ in range(2)] == [1, 2]
    monkeypatch.setattr(disk.Path, "replace", _refuse)
    assert app._counted(config, lambda *words: told.append(words)).link.boot_count == 3
    assert [level for _, level in told] == [Level.ERROR] and "Read-only" in told[0][0]


def _refuse(*_):
    raise OSError(30, "Read-only file system")
