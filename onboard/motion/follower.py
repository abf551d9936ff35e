"""Following a path: a carrot ahead on it, and a twist that goes there (Eq. 38 to 40, for four steered wheels).

`pose-carrot`: the carrot is the point of the leg at look-ahead L from the rover. The velocity points at it in body axes
(crab and backwards allowed); the body turns to the path's own yaw, read v / K_p ahead, which takes out the lag.
L shrinks in bends until the leg bows by at most 6 mm from the chord, and grows until the circle meets the leg.

`carrot`: the chapter's law without its mixing of body heading and wheel angle (Eq. 38 to 40 corrected): the body drives
ahead at cruise speed and turns by omega = clip(K_p * wrap(bearing - theta)). For a small distance y from a straight
path y'' + K_p y' + (K_p v / L) y = 0: damping 1/2 sqrt(K_p L / v). It drives the path as one leg, cuts corners,
and looks at the stations' yaw only at the end.

Both: an error of heading above 45 degrees stops the rover, which turns on the spot until it is below 5 degrees.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from onboard.config import Motion, Rover
from onboard.motion.kinematics import wheel_angles
from onboard.motion.route import Leg, Turn, route
from onboard.motion.wheel_health import SOUND, Wheels
from onboard.records import Path, Pose, Twist
from protocol.conventions import wrap_rad

LEG_END_M = 0.01  # a leg is driven to within this of its end
BRAKE_MPS2 = 0.06  # slowing before the end of a leg; the wheels manage 0.1 (1 rad/s2 on 0.1 m)
CREEP_MPS = 0.015
SLOWEST_TURN_RADPS = 0.03  # of a turn on the spot, so that its end does not crawl
STEER_RATE_RADPS = 0.4  # what the follower asks of the steering units (they manage 0.5)
JUMP_RAD = math.radians(15.0)  # a change of steering larger than this is left to steering before driving


class Follower:
    """Drives one path after the other: a path other than the last call's starts afresh. Call at about 20 Hz.

    done: the last station and its yaw are reached. cross_track_m: distance to the left of the leg. A jump of the pose
    along the leg only moves the carrot; the way that is behind stays behind.
    """

    def __init__(self, rover: Rover, motion: Motion) -> None:
        self._rover, self._motion = rover, motion
        self._path: Path | None = None
        self._start(())

    def _start(self, stages: tuple[Leg | Turn, ...]) -> None:
        self.done = False
        self.cross_track_m = 0.0
        self._stages, self._stage, self._place, self._along_m = stages, 0, 0, 0.0
        self._length_m = max((leg.before_m + leg.s_m[-1] for leg in stages if isinstance(leg, Leg)), default=0.0)
        self._spinning = False
        self._last, self._last_ns = Twist(), -1

    @property
    def progress_ratio(self) -> float:
        """Share of the path's way behind the rover, 0 to 1."""
        if self.done:
            return 1.0
        return min(1.0, self._along_m / self._length_m) if self._length_m > 0.0 else 0.0

    def twist(self, path: Path, pose: Pose, now_ns: int, wheels: Wheels = SOUND) -> Twist:
        """The motion to order now. Zero, with `done` set, once the last station and its yaw are reached."""
        if path is not self._path:
            self._path = path
            motion = self._motion
            within = (motion.point_turn_end_rad, motion.arrive_yaw_rad, 0.5 * motion.arrive_yaw_rad)
            self._start(tuple(route(path, within, one_leg=motion.law == "carrot")))
        wanted = self._wanted(pose)
        return self._feasible(wanted, now_ns)

    def turn(self, to_yaw_rad: float, pose: Pose, wheels: Wheels = SOUND) -> Twist:
        """Turns on the spot to a heading and forgets the path; zero, with `done` set, once it is reached."""
        self._path = None
        error = wrap_rad(to_yaw_rad - pose.yaw_rad)
        self.done = abs(error) <= 0.5 * self._motion.arrive_yaw_rad
        return Twist() if self.done else self._spin(error)

    def _wanted(self, pose: Pose) -> Twist:
        while self._stage < len(self._stages):
            stage = self._stages[self._stage]
            twist = self._turn(stage, pose) if isinstance(stage, Turn) else self._drive(stage, pose)
            if twist is not None:
                return twist
            self._stage, self._place, self._spinning = self._stage + 1, 0, False
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
        left = leg.s_m[-1] - along
        off = math.hypot(pose.x_m - leg.x_m[-1], pose.y_m - leg.y_m[-1])
        if left <= LEG_END_M and off <= motion.arrive_m:
            return None
        speed = min(motion.cruise_mps, max(CREEP_MPS, math.sqrt(2.0 * BRAKE_MPS2 * max(left, min(off, 0.1)))))
        carrot = leg.carrot_m(self._place, along, _ahead(leg, along, pose, motion.look_ahead_m))
        direction, error = LAWS[motion.law](leg, (along, carrot), pose, speed / motion.heading_gain_hz)
        self._spinning = abs(error) > (motion.point_turn_end_rad if self._spinning else motion.point_turn_start_rad)
        if self._spinning:
            return self._spin(error)
        if motion.law != "carrot":
            speed *= max(0.3, 1.0 - abs(error) / motion.point_turn_start_rad)
        return Twist(speed * math.cos(direction), speed * math.sin(direction), self._yaw_rate(error))

    def _spin(self, error_rad: float) -> Twist:
        rate = self._yaw_rate(error_rad)
        return Twist(0.0, 0.0, math.copysign(max(abs(rate), SLOWEST_TURN_RADPS), rate))

    def _yaw_rate(self, error_rad: float) -> float:
        limit = self._motion.yaw_rate_limit_radps
        return max(-limit, min(limit, self._motion.heading_gain_hz * error_rad))

    def _feasible(self, wanted: Twist, now_ns: int) -> Twist:
        """The part of a change that the steering can follow while driving; slower while it does."""
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


def _ahead(leg: Leg, along_m: float, pose: Pose, look_ahead_m: float) -> float:
    """How far along the leg the circle of the look-ahead meets it; 0 where it has to grow to the nearest point."""
    x, y, _ = leg.at(along_m)
    off = math.hypot(pose.x_m - x, pose.y_m - y)
    return math.sqrt(max(0.0, look_ahead_m * look_ahead_m - off * off))


def pose_carrot(leg: Leg, ways_m: tuple[float, float], pose: Pose, lead_m: float) -> tuple[float, float]:
    """(direction of the velocity in body axes, error of heading). ways_m: along the leg, of the rover and the carrot.

    lead_m: how far ahead the path's yaw is read.
    """
    along, carrot = ways_m
    x, y, _ = leg.at(carrot)
    yaw = leg.at(along + lead_m)[2]
    return math.atan2(y - pose.y_m, x - pose.x_m) - pose.yaw_rad, wrap_rad(yaw - pose.yaw_rad)


def chapter_carrot(leg: Leg, ways_m: tuple[float, float], pose: Pose, lead_m: float) -> tuple[float, float]:
    """(0: straight ahead, error of heading to the carrot), Eq. 39 with the body's heading."""
    x, y, _ = leg.at(ways_m[1])
    return 0.0, wrap_rad(math.atan2(y - pose.y_m, x - pose.x_m) - pose.yaw_rad)


Law = Callable[[Leg, tuple[float, float], Pose, float], tuple[float, float]]
LAWS: dict[str, Law] = {"pose-carrot": pose_carrot, "carrot": chapter_carrot}
