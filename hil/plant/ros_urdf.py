"""Rover's URDF for RViz and other ROS tools: that of the engine (hil.plant.rover_model) with ROS names.

    base_link -(fixed)- chassis -+- left_rocker, right_rocker - <corner>_steer - <corner>_wheel
                                 +- scanner_tilt - laser                corner: front_left, rear_left, ...

Added for RViz: an empty root base_link on the ground, visual shapes, the axis of the scanner (scanner_tilt_joint,
positive looks down; frame laser at the scanner's centre), and the differential: the right rocker mimics the left one
with the opposite sign. Joints are named LINK_joint, as users of robot_state_publisher expect.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

from hil.plant import rover_model
from onboard.config import Rover

CORNERS = ("front_left", "rear_left", "rear_right", "front_right")  # wheels 1 to 4
NAMES = {
    "chassis": "chassis", "rocker_left": "left_rocker", "rocker_right": "right_rocker",
    **{f"{part}_{n}": f"{corner}_{part}" for part in ("steer", "wheel") for n, corner in enumerate(CORNERS, start=1)},
}  # fmt: skip
COLOURS = {"chassis": "0.80 0.80 0.78 1", "wheel": "0.25 0.25 0.27 1", "laser": "0.10 0.10 0.10 1"}


def ros_urdf(rover: Rover) -> str:
    """URDF text; geometry from the configuration."""
    robot = fromstring(rover_model.urdf(rover))
    robot.set("name", "el_dorado")
    for each in robot.iter():
        if each.tag in ("link", "joint") and "name" in each.attrib:
            each.set("name", NAMES[each.attrib["name"]] + ("_joint" if each.tag == "joint" else ""))
        elif each.tag in ("parent", "child"):
            each.set("link", NAMES[each.attrib["link"]])
    for link in robot.findall("link"):
        _show(link, rover)
    right = next(joint for joint in robot.findall("joint") if joint.get("name") == "right_rocker_joint")
    SubElement(right, "mimic", joint="left_rocker_joint", multiplier="-1")
    robot.insert(0, Element("link", name="base_link"))
    robot.insert(1, _joint("base", "fixed", "base_link", "chassis", "0 0 0"))
    robot.extend(_scanner(rover))
    indent(robot)
    return '<?xml version="1.0"?>\n' + tostring(robot, encoding="unicode") + "\n"


def _show(link: Element, rover: Rover) -> None:
    """Add a visual to a link with a collision shape: the same boxes, a cylinder for a wheel."""
    name = str(link.get("name"))
    if name.endswith("_wheel"):
        cylinder = {"radius": str(rover.wheel_radius_m), "length": str(rover.wheel_width_m)}
        _look(link, Element("origin", rpy="1.5707963267948966 0 0"), ("cylinder", cylinder), "wheel")
        return
    for shape in link.findall("collision"):
        box = shape.find("geometry/box")
        origin = shape.find("origin")
        if box is not None and origin is not None:
            _look(link, origin, ("box", dict(box.attrib)), "chassis")


def _look(link: Element, origin: Element, shape: tuple[str, dict[str, str]], colour: str) -> None:
    visual = SubElement(link, "visual")
    SubElement(visual, "origin", dict(origin.attrib))
    SubElement(SubElement(visual, "geometry"), shape[0], shape[1])
    SubElement(SubElement(visual, "material", name=colour), "color", rgba=COLOURS[colour])


def _joint(name: str, kind: str, parent: str, child: str, place: str) -> Element:
    joint = Element("joint", name=f"{name}_joint", type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    SubElement(joint, "origin", xyz=place)
    return joint


def _scanner(rover: Rover) -> list[Element]:
    """Tilt joint through the scanner's centre, and the scanner's link."""
    tilt = _joint("scanner_tilt", "revolute", "chassis", "laser", f"{rover.lidar_x_m} 0 {rover.lidar_z_m}")
    SubElement(tilt, "axis", xyz="0 1 0")
    SubElement(tilt, "limit", lower="-1.429", upper="1.429", effort="10", velocity="0.6")
    laser = Element("link", name="laser")
    _look(laser, Element("origin", xyz="0 0 0"), ("box", {"size": "0.06 0.06 0.06"}), "laser")
    return [tilt, laser]
