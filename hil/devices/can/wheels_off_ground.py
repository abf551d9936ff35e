"""Rover on a stand: its emulated nodes with the wheels off the ground, for any program on a bus.

No physics: a wheel steers at STEER_RADPS to the target of its node, turns at the rate of its node, and its load is the
friction of its bearings. The inertial sensor measures the Earth's gravity.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np

from hil.devices.can.nodes import Nodes, WheelNode, build_nodes
from hil.records import PlantState, WheelTruth
from onboard.records import Frame
from protocol.generated.can_codec import StopReason
from protocol.generated.can_frames import FRAMES

TICK_NS = 10_000_000
STEER_RADPS, BEARING_NM, DRAG_NMS = 0.5, 0.15, 0.05
EARTH_MPS2 = 9.81
FOREIGN_VERSION = 99


class StandFault(NamedTuple):
    """One fault of a node: `begin(stand, node's name)`."""

    means: str
    begin: Callable[[Stand, str], None]


class Stand:
    """Emulated nodes on a stand; call `step` once a tick."""

    def __init__(self, seed: int = 1) -> None:
        self.nodes: Nodes = build_nodes(seed)
        self.by_name = {node.name: node for node in self.nodes.all}
        self.damaged: set[str] = set()
        self.reversed: set[str] = set()
        self.twins: list[Nodes] = []
        self._wheels = [WheelTruth(0.0, 0.0, 0.0, 0.0)] * 4
        self._seed = seed
        self._then_ns = 0

    def step(self, heard: Iterable[Frame], now_ns: int) -> list[Frame]:
        """Run one tick of all nodes with the received frames; returns their frames in the order of arbitration."""
        for frame in heard:
            self.nodes.receive(frame, now_ns)
        dt_s, self._then_ns = (now_ns - self._then_ns) / 1e9, now_ns
        truth = _standing(now_ns, tuple(self._wheels))
        made: list[Frame] = []
        for nodes in (self.nodes, *self.twins):
            nodes.step(now_ns, truth)
            made += nodes.send()
        self._wheels = [self._turned(node, wheel, dt_s) for node, wheel in zip(self.nodes.wheels, self._wheels)]
        return [self._damaged(frame) for frame in sorted(made, key=lambda f: (f.stamp_ns, f.can_id))]

    def double(self, name: str) -> None:
        """Add a second node of this name to the bus, started at another time."""
        twin = build_nodes(self._seed + 1)
        for node in twin.all:
            node.silent = node.name != name
            node.sender = type(node.sender)()
        twin.step(0, _standing(0, tuple(self._wheels)))
        twin.send()
        self.twins.append(twin)

    def _turned(self, node: WheelNode, wheel: WheelTruth, dt_s: float) -> WheelTruth:
        drive = node.drive()
        way_rad = max(-STEER_RADPS * dt_s, min(STEER_RADPS * dt_s, drive.steer_rad - wheel.steer_rad))
        rate_radps = 0.0 if node.drive_stuck else drive.rate_radps
        if node.name in self.reversed:
            rate_radps = -rate_radps
        friction_nm = math.copysign(BEARING_NM, rate_radps) + DRAG_NMS * rate_radps if rate_radps else 0.0
        return WheelTruth(wheel.steer_rad + way_rad, wheel.position_rad + rate_radps * dt_s, rate_radps, friction_nm)

    def _damaged(self, frame: Frame) -> Frame:
        if FRAMES[frame.can_id].sender not in self.damaged or frame.data[6] >> 4 != 5:
            return frame
        return frame._replace(data=bytes([frame.data[0] ^ 0x40]) + frame.data[1:])


def _standing(now_ns: int, wheels: tuple[WheelTruth, ...]) -> PlantState:
    zero = np.zeros(3)
    return PlantState(
        now_ns, zero, np.array([0.0, 0.0, 0.0, 1.0]), zero, zero, np.array([0.0, 0.0, EARTH_MPS2]), wheels
    )


def _silent(stand: Stand, name: str) -> None:
    stand.by_name[name].silent = True


def _foreign(stand: Stand, name: str) -> None:
    stand.by_name[name].dbc_version = FOREIGN_VERSION


def _stuck(stand: Stand, name: str) -> None:
    stand.by_name[name].drive_stuck = True


def _stop(stand: Stand, name: str) -> None:
    stand.by_name[name].assert_stop(StopReason.BUTTON)


FAULTS: Mapping[str, StandFault] = {
    "silent": StandFault("it sends nothing and hears nothing", _silent),
    "foreign": StandFault(f"it was built with version {FOREIGN_VERSION} of the DBC", _foreign),
    "twice": StandFault("there are two of it", Stand.double),
    "damaged": StandFault("one of its frames in 16 has a bit turned over", lambda stand, name: stand.damaged.add(name)),
    "stuck": StandFault("its wheel does not turn", _stuck),
    "reversed": StandFault("its wheel turns the other way", lambda stand, name: stand.reversed.add(name)),
    "stop": StandFault("it asserts an EMERGENCY_STOP, as if its button were pressed", _stop),
}
