"""A unit that is bolted on askew and a configuration that knows it: points, samples and orders are the rover's."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hil.devices.can.nodes import build_nodes
from hil.faults.build_errors import BuildErrors
from hil.records import PlantState, WheelTruth
from onboard.config import Can, Rover, Scanning
from onboard.devices.nodes import Nodes
from onboard.extrinsics import imu_rotation, lidar_rotation, rotated, rotation
from onboard.perception.map.live import mount_of, turn_of
from onboard.perception.scan.cloud import cloud
from onboard.perception.scan.scan3d import gather, points
from onboard.records import BeamStatus, Scan, TiltTrack, WheelCommand, WheelMode

ASKEW = BuildErrors(1.0, (0.03, -0.02, 0.01, 0.0), (0.0, 0.02, -0.03), (0.03, -0.02, 0.05), (0.02, -0.01, 0.3))
BUILT = ASKEW.built(Rover())
TICK_NS = 10_000_000


@pytest.mark.parametrize("angles", [(0.1, -0.2, 0.3), (-2.0, 1.0, 3.0), (0.0, 0.0, 0.0)])
def test_a_mounting_turns_about_x_then_y_then_z(angles):
    assert rotation(*angles) == pytest.approx(Rotation.from_euler("xyz", angles).as_matrix())


def test_a_mounting_without_rotation_is_left_out():
    vector = (0.1, -0.0, 9.81)
    assert lidar_rotation(Rover()) is None and imu_rotation(Rover()) is None and rotated(None, vector) is vector


def sweep():
    ranges_m = np.repeat(np.random.default_rng(1).uniform(2.0, 7.0, 361), 3)[:1081].astype(np.float32)
    track = np.arange(0, 60_000_000, 5_000_000, np.int64)
    scan = Scan(TICK_NS, 25e6 / 1440, -0.75 * math.pi, math.pi / 720, ranges_m, np.zeros(1081, np.uint8))
    return scan, TiltTrack(track, np.linspace(0.5, 0.45, len(track)))


def by_hand(scan, tilt):
    """Beam by beam, by scipy's rotations."""
    mount = Rotation.from_euler("xyz", (BUILT.lidar_roll_rad, BUILT.lidar_pitch_rad, BUILT.lidar_yaw_rad))
    place = (BUILT.lidar_x_m, BUILT.lidar_y_m, BUILT.lidar_z_m)
    made = []
    for k, range_m in enumerate(scan.ranges_m.astype(float)):
        angle = np.interp(scan.start_ns + k * scan.beam_ns, tilt.times_ns, tilt.angles_rad)
        beam = Rotation.from_euler("z", scan.first_angle_rad + k * scan.step_rad).apply([range_m, 0.0, 0.0])
        made.append(place + mount.apply(Rotation.from_euler("y", angle).apply(beam)))
    return np.array(made)


def test_a_scanner_bolted_on_askew_gives_the_same_points_in_cloud_scan_and_live_turn():
    scan, tilt = sweep()
    expected = by_hand(scan, tilt)
    whole = points(gather([scan], tilt), BUILT)
    assert whole.xyz_m == pytest.approx(expected[whole.beam], abs=1e-6)
    ahead = np.abs(scan.first_angle_rad + np.arange(1081) * scan.step_rad) <= Scanning().sector_rad
    seen = cloud([scan], tilt, np.eye(4), BUILT, Scanning(), 0.02)
    assert seen.ends_m == pytest.approx(expected[ahead], abs=1e-5)
    turn, mount = turn_of(scan, tilt, Scanning()), mount_of(np.eye(4), BUILT)
    (cosine, sine), (across, down) = turn.azimuths, turn.tilts
    beams = turn.ranges_m[:, None] * np.column_stack([cosine * across, sine, -cosine * down])
    live = (mount.scanner_m + beams) @ mount.T_map_base[:3, :3].T + mount.T_map_base[:3, 3]
    assert live == pytest.approx(expected[ahead], abs=1e-5)
    assert (scan.status == BeamStatus.OK).all()


def test_what_the_bench_builds_askew_a_configuration_that_knows_it_reads_straight():
    bench, computer = build_nodes(3, BUILT), Nodes(BUILT, Can())
    steers, force = (0.4, -0.3, 0.2, 0.0), np.array([0.5, -0.2, 1.5])
    wheels = tuple(WheelTruth(steer, 0.0, 0.0, 0.0) for steer in steers)
    truth = PlantState(
        TICK_NS, np.zeros(3), np.array([0, 0, 0, 1.0]), np.zeros(3), np.array([0.1, 0.2, -0.3]), force, wheels
    )
    read, rates, forces = [], [], []
    for tick in range(1, 101):
        bench.step(tick * TICK_NS, truth)
        computer.receive(bench.send(), tick * TICK_NS)
        read.append([wheel.steer_rad for wheel in computer.wheels])
        rates.append(computer.imu[-1].gyro_radps)
        forces.append(computer.imu[-1].accel_mps2)
    assert np.mean(read, axis=0) == pytest.approx(steers, abs=0.004)  # the pots' own offsets: 1 mrad
    assert np.mean(rates, axis=0) == pytest.approx([0.1, 0.2, -0.3], abs=0.003)
    assert np.mean(forces, axis=0) == pytest.approx(force, abs=0.04)


def test_an_order_reaches_the_angle_that_was_meant():
    bench, computer = build_nodes(3, BUILT), Nodes(BUILT, Can())
    computer.set_wheels([WheelCommand(WheelMode.RUN, 0.2, 0.0)] * 4)
    for frame in computer.send(TICK_NS, 1):
        bench.receive(frame, TICK_NS)
    wheels = (WheelTruth(0.0, 0.0, 0.0, 0.0),) * 4
    bench.step(TICK_NS, PlantState(TICK_NS, *([np.zeros(3)] * 5), wheels))
    assert [drive.steer_rad for drive in bench.drives()] == pytest.approx([0.2] * 4, abs=2e-4)
