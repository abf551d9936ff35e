"""A drive by plain geometry, without any of the flight program's kinematics: what the sensors of a rover would log.

The rover moves exactly as asked; each wheel's hub is differenced between two poses, and the wheel is said to
have rolled by the length of that way and to have pointed along it. Nothing slips, nothing is noisy.
"""

import math
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from onboard.bringup.calibrate.evidence import Evidence, Pairs

PLACES = np.array([(0.375, 0.23), (-0.375, 0.23), (-0.375, -0.23), (0.375, -0.23)])
BLOCKS = 40


def drive(built, legs, gravity_mps2=9.81, lean_rad=(0.02, -0.03)):
    """Evidence of a rover as `built` on a leaning plane. legs: (x_m, y_m, yaw_rad) in the axes of their start."""
    ground = Rotation.from_euler("XY", lean_rad)
    mount = Rotation.from_euler("ZYX", (built.lidar_yaw_rad, built.lidar_pitch_rad, built.lidar_roll_rad))
    imu = Rotation.from_euler("ZYX", (built.imu_yaw_rad, built.imu_pitch_rad, built.imu_roll_rad))
    place = np.array([built.lidar_x_m, built.lidar_y_m, built.lidar_z_m])
    offsets = np.array([getattr(built, f"steer_{n}_offset_rad") for n in (1, 2, 3, 4)])
    stops, rolled, steer, yaws, leg = [(np.zeros(3), Rotation.identity())], [], [], [], []
    for number, (x, y, turn) in enumerate(legs):
        at, facing = stops[-1]
        path = [_pose(at, facing, share * np.array([x, y]), share * turn) for share in np.linspace(0, 1, BLOCKS + 1)]
        for (p, a), (q, b), share in zip(path, path[1:], (np.arange(BLOCKS) + 0.5) / BLOCKS):
            middle = a * Rotation.from_rotvec([0, 0, 0.5 * turn / BLOCKS])
            hubs = (q + b.apply(_flat(PLACES))) - (p + a.apply(_flat(PLACES)))
            way = middle.inv().apply(hubs)[:, :2]
            rolled.append(np.hypot(*way.T) / built.wheel_radius_m)
            steer.append(np.arctan2(way[:, 1], way[:, 0]) - offsets)
            yaws.append(share * turn)
            leg.append(number)
        stops.append(path[-1])
    turns = [(a.inv() * b) for (_, a), (_, b) in pairwise(stops)]
    eyes = [(ground.apply(p + r.apply(place)), ground * r * mount) for p, r in stops]
    pairs = [(i, j) for i in range(len(stops)) for j in range(i + 1, len(stops))]
    normal = mount.inv().apply([0.0, 0.0, 1.0])
    return Evidence(
        np.array([imu.inv().apply((ground * r).inv().apply([0, 0, gravity_mps2])) for _, r in stops]),
        np.array([(imu.inv() * turn * imu).as_matrix() for turn in turns]),
        np.array(leg),
        np.array(rolled),
        np.array(steer),
        np.array(yaws),
        Pairs(
            np.array([i for i, _ in pairs]),
            np.array([j for _, j in pairs]),
            np.array([(eyes[i][1].inv() * eyes[j][1]).as_matrix() for i, j in pairs]),
            np.array([eyes[i][1].inv().apply(eyes[j][0] - eyes[i][0]) for i, j in pairs]),
            np.array([np.diag([1000.0] * 3 + [500.0] * 3)] * len(pairs)),
        ),
        np.array([normal] * len(stops)),
        np.full(len(stops), built.lidar_z_m),
    )


def _pose(at, facing, way, turn):
    return at + facing.apply([*way, 0.0]), facing * Rotation.from_rotvec([0, 0, turn])


def _flat(places):
    return np.column_stack([places, np.zeros(len(places))])


SQUARE = ((1.5, 0.0, 0.0), (0.0, 0.0, math.pi / 2)) * 4 + ((0.0, 1.5, 0.0), (0.0, -1.5, 0.0))
