"""The scene, the watcher's process, its films: the browser shows what was written, and the run never hears of it."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import urllib.request
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from hil.__main__ import app
from hil.faults.ground_faults import KINDS
from hil.plant.engine import pybullet
from hil.plant.rover_model import urdf
from hil.processes import free_ports
from hil.run.options import conclude
from hil.run.run import run as run_scenario
from hil.scenarios.model import Scenario
from hil.terrain.field import truth_height
from hil.terrain.obstacle import Obstacle
from hil.view import video
from hil.view.browser.serve import Watcher, open_server
from hil.view.folder import Folder
from hil.view.live import RECORDS, watched
from hil.view.model import about, parts, turns_rad
from hil.view.story import Moment
from hil.view.tail import NoRunError
from hil.world.truth import Patch, TruthFile
from onboard.config import Rover
from pictures.film import Shot, Stage
from protocol.conventions import WHEELS
from tests.ground.synthetic_run import GOAL, LEGS, field, write_run, write_truth

pytestmark = pytest.mark.tool

EMPTY_SHOT = Shot((0.0, 0.0, 0.0), "", np.zeros((4, 3)), np.empty((0, 3)), np.empty((0, 2)), np.empty((0, 2)))
ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    write_run(folder, step=10)
    return folder


@pytest.fixture(scope="module")
def watcher(run):
    made = Watcher(Folder(run), open_server(free_ports(1)[0]))
    yield made
    made.close()


def shown_at(watcher, time_s):
    watcher.player.playing = False
    watcher.player.seek(time_s)
    watcher.step(0.1, 0.0)
    return watcher.scene.nodes


@pytest.mark.parametrize("time_s", [0.0, 14.0, 35.0, 80.0])
def test_the_rover_in_the_scene_stands_as_the_truth_says(watcher, time_s):
    nodes, moment = shown_at(watcher, time_s), watcher.folder.story.at(time_s).moment
    np.testing.assert_array_equal(nodes["/rover"].position, moment.position_m)
    np.testing.assert_array_equal(np.roll(nodes["/rover"].wxyz, -1), moment.quaternion_xyzw)
    angles = turns_rad(moment)
    for part in parts(Rover())[1:]:
        w, *xyz = nodes[f"/rover/{part.path}"].wxyz
        turned_rad = 2 * np.arctan2(np.dot(xyz, part.axis), w)
        assert np.exp(1j * turned_rad) == pytest.approx(np.exp(1j * angles[part.name]))


def test_the_scene_has_every_part_of_the_rover_the_ground_and_the_goal(watcher):
    nodes = shown_at(watcher, 0.0)
    names = {name.rsplit("/", 1)[-1] for name in nodes if name.startswith("/rover/")}
    assert names == {
        "chassis",
        "rocker_left",
        "rocker_right",
        *(f"{kind}_{wheel}" for kind in ("steer", "wheel") for wheel in WHEELS),
    }
    assert "/ground" in nodes
    assert nodes["/goal"].position[:2] == pytest.approx(GOAL)


def test_scan_map_and_paths_come_and_go_with_the_time(watcher):
    def extra(time_s):
        return {name for name in shown_at(watcher, time_s) if name.split("/")[1] in ("scan", "map", "paths")}

    layers = {"/scan", "/map", "/paths"}
    scanning = layers | {"/scan/points", "/scan/rays"}
    planned = {"/map/surface", "/paths/global", "/paths/local", "/paths/next", "/paths/driven", "/paths/believed"}
    assert extra(5.0) - {"/paths/believed"} == scanning
    assert extra(LEGS[0][0] + 8.0) == scanning | planned
    assert extra(5.0) - {"/paths/believed"} == scanning  # back again


@pytest.fixture(scope="module")
def dug(tmp_path_factory):
    """A run in which a trench is dug after 20 s; with the ground before and after."""
    folder, before = tmp_path_factory.mktemp("dug"), field()
    write_run(folder)
    trench = Obstacle(KINDS["trench"], 4.0, 0.0, 0.0)
    after = replace(before, soil_z=trench.dug(before))
    write_truth(folder / "truth.mcap", (20.0, after))
    return folder, truth_height(before), truth_height(after)


def test_a_trench_is_in_the_scene_from_when_it_was_dug(dug):
    folder, before_m, after_m = dug
    watcher = Watcher(Folder(folder), open_server(free_ports(1)[0]))
    try:
        for time_s, heights_m in ((10.0, before_m), (30.0, after_m), (15.0, before_m)):
            shown_at(watcher, time_s)
            np.testing.assert_array_equal(watcher.scene.ground.heights_m, heights_m)
        assert "/ground" in watcher.scene.nodes
    finally:
        watcher.close()


def test_a_film_shows_the_trench_from_when_it_was_dug(dug):
    folder, _, after_m = dug
    run = Folder(folder)
    run.read()
    grounds = {round(float(shot.title.split()[0])): shot.ground for shot in video.shots(run, Rover())}
    assert grounds[19] is None
    np.testing.assert_array_equal(grounds[21].heights_m, after_m)
    first = Stage(video.drawn(run.ground), GOAL, (0.8, 0.5))
    pictures = [first.draw(replace(EMPTY_SHOT, ground=ground)) for ground in (None, grounds[21])]
    assert (pictures[0] != pictures[1]).any()


def test_a_change_of_the_ground_beyond_it_is_named_as_damage(run, tmp_path):
    for name in ("field.npz", "onboard.mcap"):
        shutil.copy(run / name, tmp_path)
    truth = TruthFile(tmp_path / "truth.mcap")
    truth.add_ground(0, Patch(10**6, 0, np.zeros((2, 2), np.float32)))
    truth.close()
    with pytest.raises(NoRunError, match="damaged"):
        Folder(tmp_path).read()


def test_clicks_reach_the_player_in_the_next_step(watcher):
    shown_at(watcher, 20.0)
    watcher.panel.clicks.put(lambda player, end_s: player.toggle(end_s))
    watcher.player.speed = 2.0
    watcher.step(1.5, 0.0)
    assert watcher.player.time_s == pytest.approx(23.0)


def test_the_parts_stand_where_the_physics_engine_has_them(tmp_path):
    rover, client = Rover(), pybullet.connect(pybullet.DIRECT)
    angles = {
        "rocker_left": 0.11,
        "rocker_right": -0.07,
        **{f"steer_{w}": 0.3 * w - 0.8 for w in WHEELS},
        **{f"wheel_{w}": 0.4 * w for w in WHEELS},
    }
    moment = Moment(
        0.0,
        (0.0,) * 3,
        (0.0, 0.0, 0.0, 1.0),
        *(tuple(v for k, v in angles.items() if k.startswith(kind)) for kind in ("rocker", "steer", "wheel")),
        "",
    )
    (tmp_path / "rover.urdf").write_text(urdf(rover))
    try:
        body = pybullet.loadURDF(str(tmp_path / "rover.urdf"), physicsClientId=client)
        for joint in range(pybullet.getNumJoints(body, physicsClientId=client)):
            name = pybullet.getJointInfo(body, joint, physicsClientId=client)[1].decode()
            pybullet.resetJointState(body, joint, angles[name], physicsClientId=client)
        theirs = {
            pybullet.getJointInfo(body, k, physicsClientId=client)[12].decode(): pybullet.getLinkState(
                body, k, computeForwardKinematics=1, physicsClientId=client
            )[4]
            for k in range(pybullet.getNumJoints(body, physicsClientId=client))
        }
        base = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)[0]
        inertial = pybullet.getDynamicsInfo(body, -1, physicsClientId=client)[3]
    finally:
        pybullet.disconnect(client)
    assert turns_rad(moment) == angles
    for name, place in placed(parts(rover), angles).items():
        if name != "chassis":
            np.testing.assert_allclose(place, np.array(theirs[name]) - np.array(base) + np.array(inertial), atol=1e-6)


def placed(found, angles):
    """Each part's origin in base_link, by matrices."""
    frames, places = {"": np.eye(4)}, {}
    for part in found:
        w, x, y, z = about(part.axis, angles.get(part.name, 0.0))
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = turn, part.origin_m
        frames[part.path] = frames[part.path.rpartition("/")[0]] @ T
        places[part.name] = frames[part.path][:3, 3]
    return places


# -- the process -------------------------------------------------------------------------------------------------------


def start(folder, port):
    """`hil watch` as a process that has told its address."""
    child = subprocess.Popen(
        [sys.executable, "-m", "hil", "watch", str(folder), "--port", str(port)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert f"http://127.0.0.1:{port}" in child.stdout.readline()
    return child


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_page_is_served_until_ctrl_c_which_leaves_nothing(run, number):
    (port,) = free_ports(1)
    child = start(run, port)
    page = urllib.request.urlopen(f"http://127.0.0.1:{port}").read()
    child.send_signal(number)
    out, err = child.communicate(timeout=60)
    assert b"<html" in page.lower()
    assert (child.returncode, out, err) == (130, "", "")
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", port))


def test_a_film_of_a_long_run_has_no_more_pictures_than_are_allowed_and_still_its_end(run, monkeypatch):
    monkeypatch.setattr(video, "MOST_FRAMES", 7)
    folder = Folder(run)
    folder.read()
    times_s = [float(shot.title.split()[0]) for shot in video.shots(folder, Rover())]
    assert len(times_s) == 7 and times_s[-1] == pytest.approx(folder.story.end_s, abs=0.05)
    assert np.ptp(np.diff(times_s)) < 0.2  # as long one after the other, but for rounding


@pytest.mark.parametrize("command", [["watch", "{run}"], ["run", "hil/scenarios/data/wheel_stuck.toml", "--watch"]])
def test_a_port_in_use_is_one_line_that_says_what_to_do(run, tmp_path, command, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = [word.format(run=run).replace("hil/scenarios", str(ROOT / "hil" / "scenarios")) for word in command]
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = CliRunner().invoke(app, [*words, "--port", str(port)])
    assert done.exit_code == 69
    assert done.stderr == f"hil: port {port} of 127.0.0.1 is in use; choose another with --port\n"


def test_a_folder_without_a_run_is_one_line_and_66(tmp_path):
    done = CliRunner().invoke(app, ["watch", str(tmp_path / "nothing")])
    assert done.exit_code == 66
    assert done.stderr.startswith(f"hil: no {tmp_path / 'nothing' / 'field.npz'}: ")
    assert done.stderr.count("\n") == 1


# -- the run -----------------------------------------------------------------------------------------------------------


@pytest.mark.mission
def test_a_run_that_is_watched_gives_the_same_certificate(tmp_path):
    scenario, (*_, port) = Scenario(terrain="flat", link="lan", end_s=4.0), free_ports(16)  # runs take the first ones
    certificates = []
    for folder in (tmp_path / "alone", tmp_path / "watched"):
        conclude(scenario, run_scenario(scenario, folder, lambda progress, wall_s: None))
        certificates.append((folder / "certificate.json").read_text())
    with watched(tmp_path / "watched", port) as address:
        assert not any((tmp_path / "watched" / name).exists() for name in RECORDS)  # no picture of the earlier run
        conclude(scenario, run_scenario(scenario, tmp_path / "watched", lambda progress, wall_s: None))
        certificates.append((tmp_path / "watched" / "certificate.json").read_text())
        assert served(tmp_path / "watched" / "watch.log", address)
    assert certificates[0] == certificates[1] == certificates[2]


def served(log, address):
    """Whether the watcher has come to serve; it may still be loading its libraries."""
    while not log.read_text():
        os.sched_yield()
    return address in log.read_text()


# -- films -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["webp", "gif"])
def test_a_film_has_a_picture_for_each_second_of_the_run_and_the_last(run, tmp_path, kind, monkeypatch):
    monkeypatch.setattr(video, "SPEED", 100.0)  # ten seconds a picture: 0, 10, ... 80, and the end at 89.9
    video.write(run, tmp_path / f"film.{kind}")
    with Image.open(tmp_path / f"film.{kind}") as film:
        assert film.n_frames == 10
        assert all(side % 2 == 0 for side in film.size)
        pictures = []
        for k in range(10):
            film.seek(k)
            pictures.append(np.asarray(film.convert("RGB")).astype(int))
    changed = [np.abs(b - a).max(axis=2).max() for a, b in pairwise(pictures)]
    assert min(changed) > 100


@pytest.mark.parametrize("command", [["watch", "{run}"], ["run", "{root}/hil/scenarios/data/wheel_stuck.toml"]])
def test_a_film_of_a_kind_that_is_none_names_those_that_are_before_anything_runs(run, tmp_path, command):
    words = [word.format(run=run, root=ROOT) for word in command]
    done = CliRunner().invoke(app, [*words, "--video", str(tmp_path / "film.avi")])
    assert done.exit_code == 64
    assert "a film is one of .webp, .gif, .mp4" in done.stderr


def test_an_mp4_without_ffmpeg_says_so(run, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    done = CliRunner().invoke(app, ["watch", str(run), "--video", str(tmp_path / "film.mp4")])
    assert done.exit_code == 64
    assert "needs ffmpeg" in done.stderr


def test_a_film_for_rerun_without_the_extra_says_what_brings_it(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    monkeypatch.delitem(sys.modules, "hil.view.rrd", raising=False)
    done = CliRunner().invoke(app, ["watch", str(run), "--rrd", str(tmp_path / "run.rrd")])
    assert done.exit_code == 69
    assert done.stderr == "hil: rerun is not installed: `pip install .[rerun]` brings it\n"


def test_a_file_for_rerun_holds_what_the_browser_shows(run, tmp_path):
    pytest.importorskip("rerun", reason="an extra: pip install .[rerun]")
    done = CliRunner().invoke(app, ["watch", str(run), "--rrd", str(tmp_path / "run.rrd")])
    assert done.exit_code == 0
    data = (tmp_path / "run.rrd").read_bytes()
    assert data.startswith(b"RRF")
    assert all(
        name in data
        for name in (
            b"/ground",
            b"/rover/chassis/rocker_left/steer_1/wheel_1",
            b"/scan/points",
            b"/paths/local",
            b"/map",
            b"/events",
        )
    )
