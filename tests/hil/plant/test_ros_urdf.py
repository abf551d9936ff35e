"""The URDF for RViz is the rover that the bench drives: read by a URDF loader that is not ours."""

import math
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from hil.__main__ import app
from hil.plant.engine import pybullet
from hil.plant.plant import Plant
from hil.plant.ros_urdf import CORNERS, ros_urdf
from hil.records import WheelDrive
from onboard.config import Rover
from tests.hil.small_fields import rough

CORNER_JOINTS = {f"{corner}_{part}_joint" for corner in CORNERS for part in ("steer", "wheel")}


@pytest.fixture
def loaded(tmp_path):
    """Joint infos by name, and the body and client, of a rover's URDF read by pybullet."""
    client = pybullet.connect(pybullet.DIRECT)

    def read(rover):
        (tmp_path / "rover.urdf").write_text(ros_urdf(rover))
        body = pybullet.loadURDF(str(tmp_path / "rover.urdf"), useFixedBase=True, physicsClientId=client)
        count = pybullet.getNumJoints(body, client)
        rows = [pybullet.getJointInfo(body, k, client) for k in range(count)]
        return {row[1].decode(): row for row in rows}, body, client

    yield read
    pybullet.disconnect(client)


def test_it_has_the_joints_of_a_rocker_rover_with_ros_names_and_base_link_as_root(loaded):
    joints, body, client = loaded(Rover())
    rockers = {"left_rocker_joint", "right_rocker_joint"}
    assert set(joints) == {"base_joint", "scanner_tilt_joint", *rockers, *CORNER_JOINTS}
    assert pybullet.getBodyInfo(body, client)[0] == b"base_link"
    assert {row[12].decode() for row in joints.values()} >= {"chassis", "laser", "front_left_wheel"}


def test_wheels_and_scanner_stand_where_the_configuration_says(loaded):
    rover = replace(Rover(), half_wheelbase_m=0.5, half_track_m=0.3, wheel_radius_m=0.12, lidar_z_m=0.8)
    joints, body, client = loaded(rover)

    def place(joint):
        return pybullet.getLinkState(body, joints[joint][0], computeForwardKinematics=1, physicsClientId=client)[4]

    assert place("rear_right_wheel_joint") == pytest.approx((-0.5, -0.3, 0.12), abs=1e-6)
    assert place("front_left_wheel_joint") == pytest.approx((0.5, 0.3, 0.12), abs=1e-6)
    assert place("scanner_tilt_joint") == pytest.approx((0.3, 0.0, 0.8), abs=1e-6)


def test_a_positive_tilt_looks_down(loaded):
    joints, body, client = loaded(Rover())
    pybullet.resetJointState(body, joints["scanner_tilt_joint"][0], 0.3, physicsClientId=client)
    turn = pybullet.getLinkState(
        body, joints["scanner_tilt_joint"][0], computeForwardKinematics=1, physicsClientId=client
    )[5]
    ahead = pybullet.rotateVector(turn, (1, 0, 0))
    assert ahead == pytest.approx((math.cos(0.3), 0, -math.sin(0.3)), abs=1e-6)


def test_it_weighs_what_the_bench_s_rover_weighs():
    masses = [float(each.get("value")) for each in ElementTree.fromstring(ros_urdf(Rover())).iter("mass")]
    assert sum(masses) == pytest.approx(40.0)


def test_the_right_rocker_turns_against_the_left_as_its_mimic_says():
    right = next(
        joint
        for joint in ElementTree.fromstring(ros_urdf(Rover())).iter("joint")
        if joint.get("name") == "right_rocker_joint"
    )
    assert right.find("mimic").attrib == {"joint": "left_rocker_joint", "multiplier": "-1"}
    plant = Plant(rough(2, ratio=0.0), step_ns=5_000_000)
    plant.apply((WheelDrive(0.0, 1.1),) * 4)
    turned = []
    for _ in range(400):
        plant.step()
        turned.append([pybullet.getJointState(plant._body, each, plant._client)[0] for each in plant._rockers])
    plant.close()
    assert max(abs(left) for left, _ in turned) > 0.01
    assert max(abs(left + right) for left, right in turned) < 0.001


def test_the_command_writes_the_urdf_of_a_configuration(tmp_path):
    config = tmp_path / "rover.toml"
    config.write_text("[rover]\nwheel_radius_m = 0.15\n")
    said = CliRunner().invoke(app, ["urdf", "--config", str(config)])
    assert said.exit_code == 0 and said.stdout == ros_urdf(replace(Rover(), wheel_radius_m=0.15))


def test_a_configuration_that_is_not_there_or_wrong_is_told_in_a_line(tmp_path):
    assert CliRunner().invoke(app, ["urdf", "--config", str(tmp_path / "none.toml")]).exit_code == 66
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("[rover]\nwheel_radius_m = 9.0\n")
    said = CliRunner().invoke(app, ["urdf", "--config", str(wrong)])
    assert said.exit_code == 78 and "wheel_radius_m" in said.output
