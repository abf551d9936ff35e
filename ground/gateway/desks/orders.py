"""TABLE of MAVLink commands. Each row returns a request of tables.commands, an answer of the gateway, or a refusal.

Nothing else in the gateway knows the parameters of the commands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

from ground.gateway.desks.modes import Auto, asked_mode, custom_mode, unpacked
from ground.gateway.frames import mavlink as m
from ground.gateway.origin import Origin
from protocol.conventions import wrap_rad
from protocol.mavlink_frames import enu_angles, ned_from_enu
from protocol.tables.arguments import Value
from protocol.tables.modes import Mode

CANCELLED = 6  # MAV_RESULT_CANCELLED, which this message set lacks
_GLOBAL = (
    m.MAV_FRAME_GLOBAL,
    m.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    m.MAV_FRAME_GLOBAL_INT,
    m.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
    m.MAV_FRAME_GLOBAL_TERRAIN_ALT,
    m.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT,
)
_FORCE = 21196  # parameter value with which ground programs force the command at once
_RELATIVE_YAW = 2


@dataclass(frozen=True, slots=True)
class MavCommand:
    """Command from COMMAND_LONG or COMMAND_INT, in one form.

    command: MAV_CMD.
    params: parameters 1 to 4.
    x, y: the place as sent, in degrees or m.
    z: as sent.
    frame: MAV_FRAME.
    """

    command: int
    params: tuple[float, float, float, float]
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    frame: int = m.MAV_FRAME_GLOBAL

    @staticmethod
    def of(message: Any) -> MavCommand:
        """Build from the message. COMMAND_INT carries a place as integers: 1e-7 degrees, or 1e-4 m."""
        params = (message.param1, message.param2, message.param3, message.param4)
        if message.get_type() == "COMMAND_LONG":
            return MavCommand(message.command, params, message.param5, message.param6, message.param7)
        scale = 1e-7 if message.frame in _GLOBAL else 1e-4
        return MavCommand(message.command, params, message.x * scale, message.y * scale, message.z, message.frame)

    @staticmethod
    def of_set_mode(message: Any) -> MavCommand:
        """Build from SET_MODE, the older message for DO_SET_MODE."""
        custom, sub = unpacked(message.custom_mode)
        return MavCommand(m.MAV_CMD_DO_SET_MODE, (float(message.base_mode), float(custom), float(sub), 0.0))


class Request(NamedTuple):
    """Request to the rover.

    name, arguments: of protocol.tables.commands.
    begun: True: acknowledged when it has begun, not when it ends, because it takes minutes.
    urgent: True: it waits for nothing, and the requests before it are cancelled.
    enables: value of the enabling after success; None: unchanged.
    """

    name: str
    arguments: Mapping[str, Value] = MappingProxyType({})
    begun: bool = False
    urgent: bool = False
    enables: bool | None = None


class GatewayAnswer(NamedTuple):
    """Answer of the gateway itself.

    result: MAV_RESULT.
    text: the reason.
    messages: names of the messages that follow.
    enables: new value of the enabling; None: unchanged.
    """

    result: int
    text: str = ""
    messages: tuple[str, ...] = ()
    enables: bool | None = None


@dataclass(frozen=True, slots=True)
class RoverState:
    """State that the rows may use.

    origin: of the map frame on the globe.
    mode, yaw_rad: of the rover; None: not known.
    enabled: True if the rover may be moved.
    goals_m: the uploaded mission, x and y in the map frame, m.
    begin: index of its first goal.
    home: number of items before goal 0.
    sends: messages that are made on request.
    """

    origin: Origin
    mode: Mode | None
    yaw_rad: float | None
    enabled: bool
    goals_m: tuple[tuple[float, float], ...] = ()
    begin: int = 0
    home: int = 0
    sends: tuple[str, ...] = ()


Row = Callable[[MavCommand, RoverState], "Request | GatewayAnswer"]


def place_m(frame: int, x: float, y: float, origin: Origin) -> tuple[float, float]:
    """Return x and y in the map frame, m. Raises ValueError for an unknown frame or for numbers that are no place."""
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError("a place needs numbers")
    if frame in _GLOBAL:
        return origin.map(x, y)
    if frame == m.MAV_FRAME_LOCAL_NED:
        east, north, _ = ned_from_enu(x, y, 0.0)
        return east, north
    if frame == m.MAV_FRAME_LOCAL_ENU:
        return x, y
    raise ValueError(f"frame {frame} is not mapped: use a global one, LOCAL_NED or LOCAL_ENU")


def goals_of(goals_m: tuple[tuple[float, float], ...]) -> dict[str, Value]:
    """Return the arguments of our `mission`."""
    return {"goals_m": tuple(value for goal in goals_m for value in goal)}


_STOP = Request("stop", urgent=True)
_RETURN = Request("return", begun=True)


def _arm(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    if asked.params[0] == 0:
        force = asked.params[1] == _FORCE
        return Request("emergency_stop" if force else "stop", urgent=True, enables=False)
    if asked.params[0] != 1:
        return GatewayAnswer(m.MAV_RESULT_DENIED, "arm with 1, disarm with 0")
    if known.mode is None:
        return GatewayAnswer(m.MAV_RESULT_TEMPORARILY_REJECTED, "nothing heard of the rover yet")
    if known.mode is Mode.SAFE:
        return Request("resume", enables=True)
    if known.mode in (Mode.ESTOP, Mode.BOOT):
        return GatewayAnswer(m.MAV_RESULT_TEMPORARILY_REJECTED, f"the rover is in {known.mode.name}")
    return GatewayAnswer(m.MAV_RESULT_ACCEPTED, enables=True)


def _terminate(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    if asked.params[0] < 0.5:
        return GatewayAnswer(m.MAV_RESULT_DENIED, "the latch is released by `ground reset`")
    return Request("emergency_stop", urgent=True, enables=False)


def _heading(asked: MavCommand, known: RoverState) -> dict[str, Value]:
    yaw_rad = asked.params[3]
    if not math.isfinite(yaw_rad):
        return {}
    if int(asked.params[1]) & _RELATIVE_YAW:
        if known.yaw_rad is None:
            raise ValueError("the rover's heading is not known, so none can be relative to it")
        return {"heading_rad": wrap_rad(known.yaw_rad - yaw_rad)}
    return {"heading_rad": enu_angles(0.0, 0.0, wrap_rad(yaw_rad))[2]}


def _reposition(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    x_m, y_m = place_m(asked.frame, asked.x, asked.y, known.origin)
    return Request("goto", {"x_m": x_m, "y_m": y_m, **_heading(asked, known)}, begun=True)


def _yaw(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    angle_deg, _, direction, relative = asked.params
    if relative == 1:
        if known.yaw_rad is None:
            raise ValueError("the rover's heading is not known, so none can be relative to it")
        turned_rad = math.radians(angle_deg) * (-1 if direction >= 0 else 1)
        return Request("turn", {"heading_rad": wrap_rad(known.yaw_rad + turned_rad)}, begun=True)
    return Request("turn", {"heading_rad": enu_angles(0.0, 0.0, wrap_rad(math.radians(angle_deg)))[2]}, begun=True)


def _start(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    first, last = (int(value) if math.isfinite(value) else 0 for value in asked.params[:2])
    begin = max(0, first - known.home) if first or last else known.begin
    goals_m = known.goals_m[begin : last + 1 - known.home if last > 0 else None]
    if not goals_m:
        return GatewayAnswer(m.MAV_RESULT_DENIED, "no mission item to begin with: upload a mission first")
    return Request("mission", goals_of(goals_m), begun=True)


def _pause(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    if asked.params[0] == 0:
        return _STOP
    return GatewayAnswer(m.MAV_RESULT_DENIED, "a stop gives the goal up: start the mission or send the goal again")


def _hold(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    if asked.params[0] == m.MAV_GOTO_DO_HOLD:
        return _STOP
    return GatewayAnswer(m.MAV_RESULT_DENIED, "a stop gives the goal up: send the goal again")


_TO_MODE = {
    Mode.SAFE: Request("safe", urgent=True, enables=False),
    Mode.ESTOP: Request("emergency_stop", urgent=True, enables=False),
}
_TO_STANDBY = {Mode.SAFE: Request("resume"), Mode.ESTOP: Request("reset")}


def _auto_mission(known: RoverState) -> Request | GatewayAnswer:
    if not known.goals_m:
        return GatewayAnswer(m.MAV_RESULT_DENIED, "no mission item to begin with: upload a mission first")
    return Request("mission", goals_of(known.goals_m[known.begin :]), begun=True)


def _mode(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    mode = asked_mode(*asked.params[:3])
    if mode is Auto.MISSION:
        return _auto_mission(known)
    if mode is Auto.RTL:
        return _RETURN
    if mode is Auto.LOITER:
        return _STOP
    if mode is Mode.STANDBY:
        return _STOP if known.mode is None else _TO_STANDBY.get(known.mode, _STOP)
    return _TO_MODE[mode]


def _reboot(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    if asked.params[0] != 1:
        return GatewayAnswer(m.MAV_RESULT_DENIED, "only the restart of the flight program (1) is mapped")
    return Request("reboot", enables=False)


def _storage(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    if asked.params[0] != 1:
        return GatewayAnswer(m.MAV_RESULT_DENIED, "only writing the parameters (1) is mapped")
    return Request("param_save")


def _message(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    number = int(asked.params[0]) if math.isfinite(asked.params[0]) else -1
    found = m.mavlink_map.get(number)
    name = found.msgname if found is not None else str(number)
    if name not in known.sends:
        return GatewayAnswer(m.MAV_RESULT_UNSUPPORTED)
    return GatewayAnswer(m.MAV_RESULT_ACCEPTED, messages=(name,))


def _home(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    return GatewayAnswer(m.MAV_RESULT_ACCEPTED, messages=("HOME_POSITION", "GPS_GLOBAL_ORIGIN"))


def _version(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    return GatewayAnswer(m.MAV_RESULT_ACCEPTED, messages=("AUTOPILOT_VERSION",))


def _always(request: Request) -> Row:
    return lambda asked, known: request


class Mapped(NamedTuple):
    """One row. means: its effect in words, for the docs page."""

    row: Row
    means: str


ROWS: dict[int, Mapped] = {
    m.MAV_CMD_COMPONENT_ARM_DISARM: Mapped(
        _arm, "1: enable (`resume` where the rover is in SAFE); 0: `stop`; 0 with 21196: `emergency-stop`"
    ),
    m.MAV_CMD_DO_REPOSITION: Mapped(_reposition, "`goto` there, with the heading of parameter 4 where it is a number"),
    m.MAV_CMD_MISSION_START: Mapped(_start, "`mission` with the uploaded items from parameter 1 to parameter 2"),
    m.MAV_CMD_DO_PAUSE_CONTINUE: Mapped(_pause, "0: `stop`; 1 is denied: a stop gives the goal up"),
    m.MAV_CMD_OVERRIDE_GOTO: Mapped(_hold, "hold: `stop`; continue is denied"),
    m.MAV_CMD_NAV_RETURN_TO_LAUNCH: Mapped(_always(_RETURN), "`return`, the way that was driven"),
    m.MAV_CMD_CONDITION_YAW: Mapped(_yaw, "`turn` to a heading, or by an angle"),
    m.MAV_CMD_DO_SET_MODE: Mapped(
        _mode,
        f"custom mode {custom_mode(Mode.SAFE)}: `safe`; {custom_mode(Mode.ESTOP)}: `emergency-stop`; "
        f"{custom_mode(Mode.STANDBY)}: `resume`, `reset` or `stop`, as the mode is; PX4's AUTO (4) with sub mode 3, "
        "LOITER: `stop`, 4, MISSION: the uploaded mission, 5, RTL: `return`; every other is denied with this list",
    ),
    m.MAV_CMD_DO_FLIGHTTERMINATION: Mapped(_terminate, "1: `emergency-stop`"),
    m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: Mapped(_reboot, "1: `reboot`"),
    m.MAV_CMD_PREFLIGHT_STORAGE: Mapped(_storage, "1: `param save`"),
    m.MAV_CMD_REQUEST_MESSAGE: Mapped(_message, "sends that message once"),
    m.MAV_CMD_GET_HOME_POSITION: Mapped(_home, "sends HOME_POSITION and GPS_GLOBAL_ORIGIN"),
    m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: Mapped(_version, "sends AUTOPILOT_VERSION"),
    m.MAV_CMD_USER_1: Mapped(_always(Request("safe", urgent=True, enables=False)), "`safe`"),
    m.MAV_CMD_USER_2: Mapped(_always(Request("scan", begun=True)), "`scan`"),
}
NEEDS_ENABLING = ("goto", "mission", "return", "turn", "scan")
GIVES_WAY = (*NEEDS_ENABLING, "resume", "reset")  # must not be executed after a stop that was requested later


def order(asked: MavCommand, known: RoverState) -> Request | GatewayAnswer:
    """Return the request to the rover for a command, or the immediate answer."""
    mapped = ROWS.get(asked.command)
    if mapped is None:
        return GatewayAnswer(m.MAV_RESULT_UNSUPPORTED)
    try:
        made = mapped.row(asked, known)
    except (ValueError, OverflowError) as error:
        return GatewayAnswer(m.MAV_RESULT_DENIED, str(error))
    if isinstance(made, Request) and made.name in NEEDS_ENABLING and not known.enabled:
        return GatewayAnswer(m.MAV_RESULT_TEMPORARILY_REJECTED, f"{made.name}: arm first")
    return made
