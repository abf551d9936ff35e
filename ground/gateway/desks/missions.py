"""Missions as lists of goals: MAVLink's mission protocol in both directions. An upload stays here until it is started.

ground program                        gateway
  MISSION_COUNT 2  ------------------>            an upload begins; one of another client's is cancelled
  <---- MISSION_REQUEST_INT 0 (again each 0.5 s, at most 10 times)
  MISSION_ITEM_INT 0 ---------------->
  <---- MISSION_REQUEST_INT 1 ...
  <------------------ MISSION_ACK                 the new goals replace the old ones whole, or not at all
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ground.gateway.desks.orders import place_m
from ground.gateway.frames import mavlink as m
from ground.gateway.origin import Origin, e7
from protocol.tables.commands import command

_MOST = next(a.most for a in command("mission").arguments if a.name == "goals_m")
_FAR_M = next(a.high for a in command("mission").arguments if a.name == "goals_m")
_AGAIN_NS, _TRIES = 500_000_000, 10
_MISSION = m.MAV_MISSION_TYPE_MISSION
ClientKey = tuple[str, tuple[str, int]]  # door and address


class Asker(NamedTuple):
    """Client that sends a request.

    key: door and address.
    target: its system and component.
    """

    key: ClientKey
    target: tuple[int, int]

    @property
    def words(self) -> str:
        """The client as the archive names it: `gateway 127.0.0.1:14555 system 255, unsigned`."""
        door, (host, port) = self.key
        return f"gateway {host}:{port} system {self.target[0]}, {door}"


class To(NamedTuple):
    """Message for one client; client None: for all."""

    client: ClientKey | None
    message: Any


class RefusedItemError(ValueError):
    """An item is not a goal. result: the MAV_MISSION_RESULT."""

    def __init__(self, result: int, text: str) -> None:
        super().__init__(text)
        self.result = result


@dataclass(slots=True)
class _Upload:
    """An upload in progress."""

    client: ClientKey
    target: tuple[int, int]
    count: int
    goals_m: list[tuple[float, float]] = field(default_factory=list)
    due_ns: int = 0
    tries: int = 0


class Missions:
    """The uploaded mission and the transfers. home_first: True if item 0 of a mission is a home, not a goal."""

    def __init__(self, origin: Origin, home_first: bool = False) -> None:
        self._origin, self._home_first = origin, home_first
        self._upload: _Upload | None = None
        self.goals_m: tuple[tuple[float, float], ...] = ()
        self.begin = 0  # first goal of a start that names no item
        self.at = 0  # the goal to which the rover drives
        self.problem = ""  # why the last upload was refused; reported once

    # -- what clients send ----------------------------------------------------------------------------------

    def count(self, client: ClientKey, target: tuple[int, int], message: Any, now_ns: int) -> list[To]:
        """Process MISSION_COUNT: begin an upload."""
        if message.mission_type != _MISSION:
            return [_ack(client, target, m.MAV_MISSION_UNSUPPORTED, message.mission_type)]
        if message.count > _MOST + self._home_first:
            self.problem = f"a mission has at most {_MOST} goals, found {message.count - self._home_first}"
            return [_ack(client, target, m.MAV_MISSION_NO_SPACE)]
        out = []
        if self._upload is not None and self._upload.client != client:
            out.append(_ack(self._upload.client, self._upload.target, m.MAV_MISSION_OPERATION_CANCELLED))
        if message.count == 0:
            self._upload = None
            self._take(())
            return [*out, _ack(client, target, m.MAV_MISSION_ACCEPTED)]
        self._upload = _Upload(client, target, message.count)
        return [*out, *self._ask(now_ns)]

    def item(self, client: ClientKey, target: tuple[int, int], message: Any, now_ns: int) -> list[To]:
        """Process MISSION_ITEM or MISSION_ITEM_INT of an upload."""
        upload = self._upload
        if upload is None or upload.client != client:
            return [_ack(client, target, m.MAV_MISSION_INVALID_SEQUENCE)]
        if message.seq < len(upload.goals_m):
            return []  # a retransmission: the next one has been requested
        if message.seq != len(upload.goals_m):
            return self._ask(now_ns)
        try:
            upload.goals_m.append(self._goal_m(message))
        except RefusedItemError as error:
            self._upload, self.problem = None, f"mission item {message.seq}: {error}"
            return [_ack(client, target, error.result)]
        if len(upload.goals_m) < upload.count:
            upload.tries = 0
            return self._ask(now_ns)
        self._upload = None
        self._take(tuple(upload.goals_m[1:] if self._home_first else upload.goals_m))
        return [_ack(client, target, m.MAV_MISSION_ACCEPTED)]

    def clear(self, client: ClientKey, target: tuple[int, int], message: Any) -> list[To]:
        """Process MISSION_CLEAR_ALL."""
        if message.mission_type in (_MISSION, m.MAV_MISSION_TYPE_ALL):
            self._upload = None
            self._take(())
        return [_ack(client, target, m.MAV_MISSION_ACCEPTED, message.mission_type)]

    def listed(self, client: ClientKey, target: tuple[int, int], message: Any) -> list[To]:
        """Answer MISSION_REQUEST_LIST with the number of items; zero for fences and rally points."""
        count = self._items if message.mission_type == _MISSION else 0
        return [To(client, m.MAVLink_mission_count_message(*target, count, message.mission_type))]

    def asked(self, client: ClientKey, target: tuple[int, int], message: Any) -> list[To]:
        """Answer MISSION_REQUEST or MISSION_REQUEST_INT with the item, as floats or as integers."""
        if message.mission_type != _MISSION or message.seq >= self._items:
            return [_ack(client, target, m.MAV_MISSION_INVALID_SEQUENCE, message.mission_type)]
        goals_m = ((0.0, 0.0), *self.goals_m) if self._home_first else self.goals_m
        lat, lon, height_m = self._origin.globe(*goals_m[message.seq], 0.0)
        now = int(message.seq == self.at + self._home_first)
        head = (*target, message.seq)
        tail = (m.MAV_CMD_NAV_WAYPOINT, now, 1, 0.0, 0.0, 0.0, float("nan"))
        if message.get_type() == "MISSION_REQUEST_INT":
            return [
                To(
                    client,
                    m.MAVLink_mission_item_int_message(
                        *head, m.MAV_FRAME_GLOBAL_INT, *tail, e7(lat), e7(lon), height_m
                    ),
                )
            ]
        return [To(client, m.MAVLink_mission_item_message(*head, m.MAV_FRAME_GLOBAL, *tail, lat, lon, height_m))]

    def set_current(self, message: Any) -> list[To]:
        """Process MISSION_SET_CURRENT: set the first goal of a start that names no item."""
        goal = message.seq - self._home_first
        if 0 <= goal < len(self.goals_m):
            self.begin = self.at = goal
        return [To(None, self.current())]

    # -- what is known --------------------------------------------------------------------------------------

    def poll(self, now_ns: int) -> list[To]:
        """Request a missing item again; cancel the upload after ten attempts."""
        upload = self._upload
        if upload is None or now_ns < upload.due_ns:
            return []
        if upload.tries > _TRIES:
            self._upload = None
            return [_ack(upload.client, upload.target, m.MAV_MISSION_OPERATION_CANCELLED)]
        return self._ask(now_ns)

    def next_due_ns(self) -> int | None:
        """Return the time at which `poll` has work."""
        return None if self._upload is None else self._upload.due_ns

    def current(self) -> Any:
        """Make MISSION_CURRENT."""
        return m.MAVLink_mission_current_message(self.at + self._home_first)

    def heading_for(self, goal_m: tuple[float, float] | None) -> list[To]:
        """Match the rover's goal to an item: MISSION_CURRENT, and MISSION_ITEM_REACHED if it went on to the next."""
        if goal_m is None or not self.goals_m:
            return []
        near = [
            i
            for i, (x_m, y_m) in enumerate(self.goals_m)
            if abs(x_m - goal_m[0]) < 0.01 and abs(y_m - goal_m[1]) < 0.01
        ]
        if not near or self.at in near:
            return []
        before, self.at = self.at, next((i for i in near if i > self.at), near[0])
        out = [To(None, self.current())]
        if self.at == before + 1:
            out.insert(0, self.reached(before))
        return out

    def reached(self, goal: int) -> To:
        """Make MISSION_ITEM_REACHED."""
        return To(None, m.MAVLink_mission_item_reached_message(goal + self._home_first))

    @property
    def _items(self) -> int:
        return len(self.goals_m) + (self._home_first and bool(self.goals_m))

    def _take(self, goals_m: tuple[tuple[float, float], ...]) -> None:
        self.goals_m, self.begin, self.at = goals_m, 0, 0

    def _ask(self, now_ns: int) -> list[To]:
        upload = self._upload
        assert upload is not None
        upload.due_ns, upload.tries = now_ns + _AGAIN_NS, upload.tries + 1
        asks = m.MAVLink_mission_request_int_message(*upload.target, len(upload.goals_m), _MISSION)
        return [To(upload.client, asks)]

    def _goal_m(self, message: Any) -> tuple[float, float]:
        if self._home_first and message.seq == 0:
            return 0.0, 0.0
        return goal_of(message, self._origin)


def goal_of(message: Any, origin: Origin) -> tuple[float, float]:
    """Return the goal of a mission item in the map frame, m. Raises RefusedItemError."""
    if message.command != m.MAV_CMD_NAV_WAYPOINT:
        raise RefusedItemError(m.MAV_MISSION_UNSUPPORTED, f"command {message.command} is no goal: use NAV_WAYPOINT")
    scale = 1.0
    if message.get_type() == "MISSION_ITEM_INT":
        scale = 1e-4 if message.frame in (m.MAV_FRAME_LOCAL_NED, m.MAV_FRAME_LOCAL_ENU) else 1e-7
    try:
        x_m, y_m = place_m(message.frame, message.x * scale, message.y * scale, origin)
    except ValueError as error:
        raise RefusedItemError(m.MAV_MISSION_UNSUPPORTED_FRAME, str(error)) from None
    for value, result in ((x_m, m.MAV_MISSION_INVALID_PARAM5_X), (y_m, m.MAV_MISSION_INVALID_PARAM6_Y)):
        if abs(value) > _FAR_M:
            raise RefusedItemError(result, f"{x_m:.0f} {y_m:.0f} m is over {_FAR_M:.0f} m from the map's origin")
    return x_m, y_m


def _ack(client: ClientKey, target: tuple[int, int], result: int, kind: int = _MISSION) -> To:
    return To(client, m.MAVLink_mission_ack_message(*target, result, kind))
