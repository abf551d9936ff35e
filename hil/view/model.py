"""Parts of the rover for a picture, from the same URDF text that the physics engine reads; wheels as cylinders."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from hil.plant.rover_model import urdf
from hil.view.story import Moment
from onboard.config import Rover
from onboard.records import F64
from protocol.conventions import WHEELS


class Box(NamedTuple):
    """Box of a part.

    centre_m, size_m: (3,) in the part's frame
    """

    centre_m: tuple[float, ...]
    size_m: tuple[float, ...]


class Part(NamedTuple):
    """Link of the rover.

    path: its name after those of the links that carry it ("chassis/rocker_left/steer_1")
    origin_m: place of its joint in the carrier's frame
    axis: axis of its joint
    boxes: its boxes
    """

    path: str
    origin_m: tuple[float, ...]
    axis: tuple[float, ...]
    boxes: tuple[Box, ...]

    @property
    def name(self) -> str:
        """Name of the link itself."""
        return self.path.rsplit("/", 1)[-1]

    @property
    def is_wheel(self) -> bool:
        """True for wheel_1 to wheel_4."""
        return self.name.startswith("wheel_")


def parts(rover: Rover) -> tuple[Part, ...]:
    """Parts of the rover, carriers before carried parts; the first is the chassis, whose frame is base_link."""
    tree = ElementTree.fromstring(urdf(rover))
    boxes = {link.attrib["name"]: tuple(_boxes(link)) for link in tree.iter("link")}
    found = {"chassis": Part("chassis", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), boxes["chassis"])}
    for joint in tree.iter("joint"):
        name = joint.attrib["name"]
        parent, origin, axis = (joint.find(tag) for tag in ("parent", "origin", "axis"))
        carrier = found[parent.attrib["link"]].path
        place = (0.0, 0.0, 0.0) if origin is None else _numbers(origin.attrib["xyz"])
        found[name] = Part(f"{carrier}/{name}", place, _numbers(axis.attrib["xyz"]), boxes[name])
    return tuple(found.values())


def turns_rad(moment: Moment) -> dict[str, float]:
    """Angle of each link about its axis."""
    rockers = dict(zip(("rocker_left", "rocker_right"), moment.rockers_rad))
    steers = {f"steer_{wheel}": angle for wheel, angle in zip(WHEELS, moment.steer_rad)}
    return {**rockers, **steers, **{f"wheel_{wheel}": angle for wheel, angle in zip(WHEELS, moment.wheel_rad)}}


def about(axis: tuple[float, ...], angle_rad: float) -> F64:
    """Rotation about an axis as a unit quaternion w x y z."""
    return np.array([np.cos(angle_rad / 2), *(np.sin(angle_rad / 2) * np.asarray(axis))])


def _boxes(link: ElementTree.Element) -> Iterator[Box]:
    for collision in link.iter("collision"):
        box = collision.find("geometry/box")
        if box is not None:
            yield Box(_numbers(collision.find("origin").attrib["xyz"]), _numbers(box.attrib["size"]))


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split()))
