"""Rover model for the physics engine, as URDF text.

          mast  |  +0.70 scanner's centre
        ___deck_|_ 0.50
          [chassis] 0.15 .. 0.35      base_link: on the ground in the middle; the URDF's root frame is base_link itself
        o--rocker--o 0.18 pivot       left and right rocker, joined by a gear constraint in hil.plant.plant

Names are chassis, rocker_left, rocker_right, steer_1..4, wheel_1..4 (joints have their link's name). A wheel's
collision shape is the tyre's cylinder, for rocks only: soil acts through soil.py (a cylinder rolling on triangles
shakes by 0.5 m/s2). Spheres would extend beyond the tyre's side, by 0.08 m at the axle, and report contacts with rocks
that no tyre touches.
"""

from __future__ import annotations

import math

from onboard.config import Rover
from protocol.conventions import WHEEL_SIGNS, WHEELS

CENTRE_OF_MASS_M = 0.29  # of the chassis above the wheel plane
PIVOT_M = 0.18
CHASSIS_KG, ROCKER_KG, STEER_KG, WHEEL_KG = 24.0, 1.0, 1.5, 2.0


def urdf(rover: Rover) -> str:
    """URDF text; geometry from the configuration, masses from the table of `10-navigation`, section 2 (40 kg)."""
    links = [_chassis(rover)]
    for side, sign in (("left", 1), ("right", -1)):
        links.append(_rocker(rover, side, sign))
    links += [_corner(rover, wheel, *signs) for wheel, signs in zip(WHEELS, WHEEL_SIGNS)]
    return f'<?xml version="1.0"?>\n<robot name="rover">\n{"".join(links)}</robot>\n'


def _inertia(mass: float, centre: tuple[float, float, float], size: tuple[float, float, float]) -> str:
    xx, yy, zz = (s * s for s in size)
    ixx, iyy, izz = (mass / 12 * pair for pair in (yy + zz, xx + zz, xx + yy))
    return (
        f'<inertial><origin xyz="{centre[0]} {centre[1]} {centre[2]}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def _box(centre: tuple[float, float, float], size: tuple[float, float, float]) -> str:
    return (
        f'<collision><origin xyz="{centre[0]} {centre[1]} {centre[2]}"/>'
        f'<geometry><box size="{size[0]} {size[1]} {size[2]}"/></geometry></collision>'
    )


def _chassis(rover: Rover) -> str:
    belly = rover.belly_m
    return (
        '<link name="chassis">'
        + _inertia(CHASSIS_KG, (0, 0, CENTRE_OF_MASS_M), (0.55, 0.30, 0.20))
        + _box((0, 0, belly + 0.10), (0.55, 0.30, 0.20))
        + _box((0, 0, 0.49), (2 * rover.half_wheelbase_m, 2 * rover.half_track_m, 0.02))
        + _box((rover.lidar_x_m, 0, 0.57), (0.06, 0.06, 0.14))
        + "</link>\n"
    )


def _rocker(rover: Rover, side: str, sign: int) -> str:
    length = 2 * rover.half_wheelbase_m
    return (
        f'<link name="rocker_{side}">'
        + _inertia(ROCKER_KG, (0, 0, 0.07), (length, 0.04, 0.04))
        + _box((0, 0, 0.07), (length, 0.04, 0.04))
        + f'</link>\n<joint name="rocker_{side}" type="revolute"><parent link="chassis"/><child link="rocker_{side}"/>'
        f'<origin xyz="0 {sign * rover.half_track_m} {PIVOT_M}"/><axis xyz="0 1 0"/>'
        '<limit lower="-0.5" upper="0.5" effort="1000" velocity="10"/><dynamics damping="0" friction="0"/></joint>\n'
    )


def _corner(rover: Rover, wheel: int, ahead: int, left: int) -> str:
    side, radius, limit = ("left" if left > 0 else "right"), rover.wheel_radius_m, rover.steer_limit_rad + 0.02
    tyre_shape = f'<cylinder radius="{radius}" length="{rover.wheel_width_m}"/>'
    shape = f'<collision><origin rpy="{math.pi / 2} 0 0"/><geometry>{tyre_shape}</geometry></collision>'
    tyre = WHEEL_KG * (3 * radius * radius + rover.wheel_width_m * rover.wheel_width_m) / 12
    roll = WHEEL_KG * radius * radius / 2
    return (
        f'<link name="steer_{wheel}">'
        + _inertia(STEER_KG, (0, 0, 0.06), (0.08, 0.08, 0.12))
        + f'</link>\n<joint name="steer_{wheel}" type="revolute">'
        f'<parent link="rocker_{side}"/><child link="steer_{wheel}"/>'
        f'<origin xyz="{ahead * rover.half_wheelbase_m} 0 {radius - PIVOT_M}"/><axis xyz="0 0 1"/>'
        f'<limit lower="-{limit}" upper="{limit}" effort="60" velocity="10"/>'
        '<dynamics damping="0" friction="0"/></joint>\n'
        f'<link name="wheel_{wheel}"><inertial><mass value="{WHEEL_KG}"/>'
        f'<inertia ixx="{tyre}" iyy="{roll}" izz="{tyre}" ixy="0" ixz="0" iyz="0"/></inertial>'
        f"{shape}</link>\n"
        f'<joint name="wheel_{wheel}" type="continuous"><parent link="steer_{wheel}"/><child link="wheel_{wheel}"/>'
        '<axis xyz="0 1 0"/><dynamics damping="0" friction="0"/></joint>\n'
    )
