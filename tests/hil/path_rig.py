"""Drives a path on the plant, through CAN frames and emulated nodes; the pose is the truth, the rest is onboard's."""

import math

from hil.devices.can.nodes import build_nodes
from hil.plant.plant import Plant
from onboard.config import Can, Motion, Rover
from onboard.devices.nodes import Nodes
from onboard.motion.follower import Follower
from onboard.motion.kinematics import stopped, wheel_commands
from onboard.motion.wheel_health import SOUND, DriveHealth
from onboard.records import Pose, Twist, WheelCommand, WheelMode
from protocol.tables.modes import Mode

ROVER = Rover()
TICK_NS = 10_000_000


def true_pose(state):
    """The plant's base_link as onboard would say it."""
    x, y, z, w = state.quaternion_xyzw
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return Pose(*state.position_m.tolist(), roll, pitch, yaw)


class PathRig:
    """One rover on one field with its nodes, of which one may `fail`."""

    def __init__(self, field, motion=None, seed=1):
        self.plant, self.emulated = Plant(field, step_ns=5_000_000), build_nodes(seed)
        self.nodes, self.motion, self.wheels, self._told = Nodes(ROVER, Can()), motion or Motion(), SOUND, None
        self.follower, self.held, self.tick = Follower(ROVER, self.motion), False, 0
        self.orders = stopped([WheelCommand(WheelMode.HOLD, 0.0, 0.0)] * 4)
        self.state, self.truth = self.plant.reset(field.start), []

    def fail(self, n, health, told_s):
        """Wheel n has this health from now on (a fixed steering gets to its angle first); onboard hears it later."""
        node = self.emulated.wheels[n - 1]
        node.steer_stuck_rad, node.drive_stuck = health.steer_fixed_rad, health.drive is DriveHealth.STUCK
        self.plant.jam(n, health.drive is DriveHealth.STUCK)
        if health.drive is DriveHealth.FREE:
            self.plant.set_motor(n, 0.0)
        if health.steer_fixed_rad is not None:
            for _ in range(100 + int(abs(health.steer_fixed_rad) * 200)):
                self._step(Twist())
        self._told = (self.tick + int(told_s * 100), (*SOUND[: n - 1], health, *SOUND[n:]))

    def drive(self, path, limit_s):
        """To the end of the path or of the time; returns the true (x, y, yaw), twenty times a second."""
        twist = Twist()
        for _ in range(int(limit_s * 100)):
            if self._told is not None and self.tick >= self._told[0]:
                self.wheels, self._told = self._told[1], None
            if self.tick % 5 == 0:
                pose = true_pose(self.state)
                self.truth.append((pose.x_m, pose.y_m, pose.yaw_rad))
                twist = self.follower.twist(path, pose, self.tick * TICK_NS, self.wheels)
                if self.follower.done:
                    break
            self._step(twist)
        return self.truth

    def _step(self, twist):
        now_ns = self.tick * TICK_NS
        self.nodes.receive(self.emulated.send(), now_ns)
        if self.tick % 2 == 0:
            if twist == Twist():
                self.orders, self.held = stopped(self.orders), False
            else:
                self.orders, self.held = wheel_commands(
                    twist, self.nodes.wheels, self.orders, ROVER, self.motion, self.held, self.wheels
                )
            self.nodes.set_wheels(self.orders)
        for frame in self.nodes.send(now_ns, int(Mode.AUTONOMOUS)):
            self.emulated.receive(frame, now_ns)
        self.plant.apply(self.emulated.drives())
        self.state = self.plant.step()
        self.tick += 1
        self.emulated.step(self.tick * TICK_NS, self.state)
