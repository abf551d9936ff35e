"""Path follower: drives a path stage by stage with a law of `laws`, within the limits of speed, steering and wheels.

A stage is a leg or a turn on the spot (`route`). On a leg the carrot is at look-ahead L from the rover; L shrinks in
bends until the leg deviates by at most 6 mm from the chord, and grows until the circle meets the leg. A heading error
above 45 degrees stops the rover, which turns on the spot until the error is below 5 degrees. A leg ends at its place,
then its turn at its heading. Lengths are measured in the plane on which the rover stands.

A wheel that does not work is dragged along the same path, with the same turns. Where the wheels lack the force
(`degraded.load_ratio`), the rover rolls a wheel of fixed steering for the rest of the path: each leg begins with a turn
on the spot, after which the wheel's rim points along the path and the body aside.
"""

from __future__ import annotations

import math

from onboard.config import Motion, Rover
from onboard.motion.degraded import DRAG_LIMIT, fixed_wheel, load_ratio, rolling, speed_ratio
from onboard.motion.kinematics import wheel_angles
from onboard.motion.laws import LAWS, Aim, Sight, in_plane, roll
from onboard.motion.route import Leg, Turn, route
from onboard.motion.speed import Conditions, speed_limit
from onboard.motion.wheel_health import SOUND, Wheels
from onboard.native.elementary import acos, cos, hypot, sin
from onboard.records import Path, Pose, Twist
from protocol.conventions import wrap_rad

LEG_END_M = 0.01  # a leg is driven to within this of its end
BRAKE_MPS2 = 0.06  # slowing before the end of a leg; the wheels manage 0.1 (1 rad/s2 on 0.1 m)
CREEP_MPS = 0.015
SLOWEST_TURN_RADPS = 0.03  # of a turn on the spot, so that its end is not too slow
STEER_RATE_RADPS = 0.4  # demanded from the steering units (they manage 0.5)
JUMP_RAD = math.radians(15.0)  # a larger change of steering is left to steering before driving


class Follower:
    """Path follower. A path other than the last call's starts from its beginning. Call at about 20 Hz.

    done: True when the last station and its yaw are reached.
    cross_track_m: distance to the left of the leg.

    A jump of the pose along the leg only moves the carrot; the part of the path that was passed stays passed.
    """

    def __init__(self, rover: Rover, motion: Motion) -> None:
        self._rover, self._motion = rover, motion
        self._path: Path | None = None
        self._wheels = SOUND
        self._start(())

    def _start(self, stages: tuple[Leg | Turn, ...]) -> None:
        self.done = False
        self.cross_track_m = 0.0
        self._stages, self._stage, self._place, self._along_m = stages, 0, 0, 0.0
        self._length_m = max((leg.before_m + leg.s_m[-1] for leg in stages if isinstance(leg, Leg)), default=0.0)
        self._spinning = self._rolling = False
        self._last, self._last_ns = Twist(), -1

    @property
    def progress_ratio(self) -> float:
        """Driven ratio of the path's length, 0 to 1."""
        if self.done:
            return 1.0
        return min(1.0, self._along_m / self._length_m) if self._length_m > 0.0 else 0.0

    def twist(self, path: Path, pose: Pose, now_ns: int, wheels: Wheels = SOUND) -> Twist:
        """Return the twist to command now; zero, with `done` set, once the last station and its yaw are reached.

        wheels: state of each wheel; may change on the way.
        """
        self._wheels = wheels
        if path is not self._path:
            self._path = path
            motion = self._motion
            within = (motion.point_turn_end_rad, motion.arrive_yaw_rad, 0.5 * motion.arrive_yaw_rad)
            self._start(tuple(route(path, within, one_leg=motion.law == "carrot")))
        wanted = self._wanted(pose)
        return self._feasible(wanted, now_ns)

    def turn(self, to_yaw_rad: float, pose: Pose, wheels: Wheels = SOUND) -> Twist:
        """Turn on the spot to a heading and drop the path; zero, with `done` set, once the heading is reached."""
        self._path, self._wheels = None, wheels
        error = wrap_rad(to_yaw_rad - pose.yaw_rad)
        self.done = abs(error) <= 0.5 * self._motion.arrive_yaw_rad
        return Twist() if self.done else self._spin(error)

    def _wanted(self, pose: Pose) -> Twist:
        while self._stage < len(self._stages):
            stage = self._stages[self._stage]
            twist = self._turn(stage, pose) if isinstance(stage, Turn) else self._drive(stage, pose)
            if twist is not None:
                return twist
            self._stage, self._place, self._spinning = self._stage + 1, 0, self._rolling
        self.done = True
        return Twist()

    def _turn(self, turn: Turn, pose: Pose) -> Twist | None:
        error, self._place = turn.error_rad(pose.yaw_rad, self._place)
        return None if abs(error) <= turn.within_rad else self._spin(error)

    def _drive(self, leg: Leg, pose: Pose) -> Twist | None:
        motion = self._motion
        self._place, along, self.cross_track_m = leg.nearest(pose.x_m, pose.y_m, self._place)
        along = max(along, self._along_m - leg.before_m)
        self._along_m = leg.before_m + along
        stretch = _stretch(pose, leg.bearing_rad(along))
        off = hypot(pose.x_m - leg.x_m[-1], pose.y_m - leg.y_m[-1])
        left = leg.s_m[-1] - along
        if left <= LEG_END_M and (off <= motion.arrive_m or self._rolling):
            return None
        brake = math.sqrt(2.0 * BRAKE_MPS2 * max(left * stretch, min(off, 0.1)))
        speed = max(CREEP_MPS, min(self._speed_limit(leg, along, pose), brake))
        carrot = leg.carrot_m(self._place, along, _ahead(leg, along, pose, motion.look_ahead_m / stretch))
        aim = self._aim(Sight(leg, along, carrot, self.cross_track_m, pose, speed))
        self._spinning = abs(aim.error_rad) > (
            motion.point_turn_end_rad if self._spinning else motion.point_turn_start_rad
        )
        return self._spin(aim.error_rad) if self._spinning else aim.twist

    def _speed_limit(self, leg: Leg, along_m: float, pose: Pose) -> float:
        """Speed limit for this place, this slope and these wheels, m/s."""
        conditions = Conditions(_tilt_rad(pose), leg.near_m(along_m), leg.turning_pm(along_m))
        return speed_ratio(self._wheels) * speed_limit(conditions, self._motion)

    def _aim(self, sight: Sight) -> Aim:
        """Aim of the configured law; if the wheels lack the force, of the rolling law or the closest rolling twist."""
        aim = LAWS[self._motion.law](sight, self._motion)
        if all(wheel.steer_fixed_rad is None for wheel in self._wheels):
            return aim
        if not self._rolling and load_ratio(aim.twist, self._wheels, self._rover, _tilt_rad(sight.pose)) > DRAG_LIMIT:
            self._rolling = self._spinning = True
        if not self._rolling:
            return aim
        fixed = fixed_wheel(self._wheels, self._rover)
        if fixed is None:
            return aim._replace(twist=rolling(aim.twist, self._wheels, self._rover))
        return roll(sight, fixed)

    def _spin(self, error_rad: float) -> Twist:
        fastest = speed_ratio(self._wheels) * self._motion.yaw_rate_limit_radps
        rate = max(SLOWEST_TURN_RADPS, min(fastest, self._motion.heading_gain_hz * abs(error_rad)))
        return Twist(0.0, 0.0, math.copysign(rate, error_rad))

    def _feasible(self, wanted: Twist, now_ns: int) -> Twist:
        """Return the part of a change of twist that the steering can follow while driving; slower during the change."""
        last, elapsed_s = self._last, (now_ns - self._last_ns) * 1e-9
        first, self._last, self._last_ns = self._last_ns < 0, wanted, now_ns
        change = 0.0
        for old, new in zip(wheel_angles(last, self._rover), wheel_angles(wanted, self._rover)):
            if old is not None and new is not None:
                change = max(change, abs(math.remainder(new - old, math.pi)))
        allowed = STEER_RATE_RADPS * elapsed_s
        if first or change <= allowed or change > JUMP_RAD:
            return wanted
        share = allowed / change
        vx, vy, yaw = (a + share * (b - a) for a, b in zip(last, wanted))
        self._last = Twist(vx, vy, yaw)
        slow = max(0.3, share)
        return Twist(slow * vx, slow * vy, slow * yaw)


def _tilt_rad(pose: Pose) -> float:
    """Steepest slope of the plane on which the rover stands."""
    return acos(cos(pose.roll_rad) * cos(pose.pitch_rad))


def _stretch(pose: Pose, bearing_rad: float) -> float:
    """Metres in the plane on which the rover stands per metre in the map, in a direction of the map."""
    return hypot(*in_plane(pose, cos(bearing_rad), sin(bearing_rad)))


def _ahead(leg: Leg, along_m: float, pose: Pose, look_ahead_m: float) -> float:
    """Distance along the leg at which the circle of the look-ahead meets it; 0 if it must grow to the nearest point."""
    x, y, _ = leg.at(along_m)
    off = hypot(pose.x_m - x, pose.y_m - y)
    return math.sqrt(max(0.0, look_ahead_m * look_ahead_m - off * off))
