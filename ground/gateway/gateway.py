"""The gateway without I/O: datagrams of local clients, news of the session and time in, datagrams out.

    clients.accept(door, address, datagram, stamp) -> messages that pass the checks; nothing is done yet
    clients.marks()                                -> signing times to store on disk before acting on the messages
    act(heard, now), turn(news, now)               -> requests to the session, messages into the outbox
    send(stamp)                                    -> (door, address, datagram) for each client

Telemetry goes to all clients, an answer to the client that asked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from ground.gateway.clients import Address, Client, ClientMessage, Clients
from ground.gateway.desks.desk import CommandQueue, Outcome, acknowledgement
from ground.gateway.desks.missions import Missions, RefusedItemError, To, goal_of
from ground.gateway.desks.orders import MavCommand, RoverState
from ground.gateway.desks.parameter_desk import ParameterDesk
from ground.gateway.frames import COMPONENT_ID, SYSTEM_ID
from ground.gateway.frames import mavlink as m
from ground.gateway.origin import Origin
from ground.gateway.texts import Texts
from ground.gateway.vehicle import MESSAGES, heartbeat, told_by
from ground.gateway.vehicle_state import VehicleState
from ground.link.contact import SILENT_NS, Contact
from ground.link.news import EventHeard, Item, News
from ground.link.session import Session
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode

Handler = Callable[[Client, Any, int], Iterable[To]]
_HEARTBEAT_NS = 1_000_000_000
_HELD = (Mode.SAFE, Mode.ESTOP, Mode.BOOT)


class Gateway:
    """All clients on one session."""

    def __init__(self, session: Session, origin: Origin, *, home_first: bool = False) -> None:
        self._session, self._origin, self._home_first = session, origin, home_first
        self.clients = Clients()
        self.desk, self.parameters = CommandQueue(session), ParameterDesk(session)
        self.missions = Missions(origin, home_first)
        self._outbox: list[To] = []
        self._texts, self._contact = Texts(), Contact()
        self._heartbeat_ns = 0
        self._mode: Mode | None = None
        self._boot_id = session.boot_id
        self._handlers: Mapping[str, Handler] = self._table()

    # -- in -------------------------------------------------------------------------------------------------

    def act(self, heard: ClientMessage, now_ns: int) -> None:
        """Execute an accepted message if it is addressed to the rover."""
        message = heard.message
        source = (message.get_srcSystem(), message.get_srcComponent())
        client = self.clients.of(heard, now_ns)
        if client is None or source == (SYSTEM_ID, COMPONENT_ID):
            return
        client.target = source
        self._watch_boot(now_ns)
        handler = self._handlers.get(message.get_type())
        if handler is not None and _meant_for_the_rover(message):
            self._outbox += handler(client, message, now_ns)

    def turn(self, news: Iterable[News], now_ns: int) -> None:
        """Convert news of the session into messages for all clients, and advance all waiting work."""
        fresh: set[str] = set()
        for one in news:
            if isinstance(one, Item):
                fresh.add(one.name)
            elif isinstance(one, EventHeard):
                self.parameters.hear(one)
                if one.severity != "debug":
                    self._tell(one.severity, f"{one.name}: {one.text}")
        self.clients.forget(now_ns)
        self._watch_boot(now_ns)
        seen = self._seen()
        if fresh:
            self._outbox += [To(None, message) for message in told_by(seen, fresh)]
            self._watch_mode(seen.mode)
            goal = seen.all("goal_x_m", "goal_y_m")
            self._outbox += self.missions.heading_for((goal[0], goal[1]) if goal else None)
        said, ended = self.desk.poll(now_ns)
        self._outbox += [*said, *self._wanted(), *self.missions.poll(now_ns), *self.parameters.poll(now_ns)]
        for outcome in ended:
            self._end(outcome)
        self._beat(seen, now_ns)
        self._say_all()

    # -- out ------------------------------------------------------------------------------------------------

    def send(self, stamp: int) -> list[tuple[str, Address, bytes]]:
        """Return door, address and datagram of each waiting message, in order."""
        outbox, self._outbox = self._outbox, []
        return self.clients.addressed(outbox, stamp)

    def next_due_ns(self) -> int:
        """Return the time at which `turn` has work without news; 0: at once."""
        if self.parameters.busy or self._outbox:
            return 0
        dues = (self._heartbeat_ns, self.desk.next_due_ns(), self.missions.next_due_ns(), self._contact.next_due_ns())
        return min(due for due in dues if due is not None)

    # -- what messages do -----------------------------------------------------------------------------------

    def _table(self) -> dict[str, Handler]:
        missions, parameters = self.missions, self.parameters

        def parameter(client: Client, message: Any, now_ns: int) -> Iterable[To]:
            parameters.receive(client.key, client.target, message, now_ns)
            return ()

        return {
            "COMMAND_LONG": self._command,
            "COMMAND_INT": self._command,
            "SET_MODE": self._set_mode,
            "PARAM_REQUEST_LIST": parameter,
            "PARAM_REQUEST_READ": parameter,
            "PARAM_SET": parameter,
            "MISSION_COUNT": lambda c, message, now_ns: missions.count(c.key, c.target, message, now_ns),
            "MISSION_ITEM": self._item,
            "MISSION_ITEM_INT": self._item,
            "MISSION_REQUEST_LIST": lambda c, message, _: missions.listed(c.key, c.target, message),
            "MISSION_REQUEST": lambda c, message, _: missions.asked(c.key, c.target, message),
            "MISSION_REQUEST_INT": lambda c, message, _: missions.asked(c.key, c.target, message),
            "MISSION_CLEAR_ALL": lambda c, message, _: missions.clear(c.key, c.target, message),
            "MISSION_SET_CURRENT": lambda _c, message, _: missions.set_current(message),
        }

    def _command(self, client: Client, message: Any, now_ns: int) -> Iterable[To]:
        out = self.desk.command(client.asker, message, self._known(), now_ns)
        return [*out, *self._wanted()]

    def _wanted(self) -> list[To]:
        """Return the messages that clients have requested by a command."""
        seen = self._seen()
        made = [To(key, MESSAGES[name].make(seen)) for key, name in self.desk.wanted]
        self.desk.wanted.clear()
        return [to for to in made if to.message is not None]

    def _set_mode(self, client: Client, message: Any, now_ns: int) -> Iterable[To]:
        ack = acknowledgement(m.MAV_CMD_DO_SET_MODE, client.target)
        return self.desk.ask(client.asker, MavCommand.of_set_mode(message), ack, self._known(), now_ns)

    def _item(self, client: Client, message: Any, now_ns: int) -> Iterable[To]:
        """Process an item of an upload, or the single goal that older programs send as an item with current = 2."""
        if message.current != 2:
            return self.missions.item(client.key, client.target, message, now_ns)
        try:
            x_m, y_m = goal_of(message, self._origin)
        except RefusedItemError as error:
            self._tell("warning", str(error))
            return [To(client.key, m.MAVLink_mission_ack_message(*client.target, error.result))]
        asked = MavCommand(m.MAV_CMD_DO_REPOSITION, (-1.0, 0.0, 0.0, math.nan), x_m, y_m, 0.0, m.MAV_FRAME_LOCAL_ENU)
        return self.desk.ask(client.asker, asked, _mission_ack(client.target), self._known(), now_ns)

    # -- what is known of the rover -------------------------------------------------------------------------

    def _seen(self) -> VehicleState:
        items = self._session.items
        onboard_ns = max((item.onboard_ns for item in items.values()), default=0)
        return VehicleState(
            {name: item.value for name, item in items.items()},
            onboard_ns,
            self.desk.enabled,
            self._origin,
            self.desk.stopping,
        )

    def _known(self) -> RoverState:
        seen, missions = self._seen(), self.missions
        return RoverState(
            self._origin,
            seen.mode,
            seen.number("yaw_rad"),
            seen.armed,
            missions.goals_m,
            missions.begin,
            int(self._home_first),
            tuple(MESSAGES),
        )

    def _watch_mode(self, mode: Mode | None) -> None:
        """Withdraw the enabling if the rover enters SAFE or ESTOP."""
        if mode in _HELD and self._mode not in (mode, None):
            self.desk.enabled = False
        self._mode = mode

    def _watch_boot(self, now_ns: int) -> None:
        """Withdraw the enabling if the rover has rebooted; its mode from before is invalid."""
        if self._session.boot_id != self._boot_id:
            self._boot_id, self._mode = self._session.boot_id, None
            self._outbox += self.desk.rover_booted(now_ns)

    def _end(self, outcome: Outcome) -> None:
        good = outcome.state is RequestState.COMPLETED
        words = f"{outcome.name} {outcome.state.name.lower()}" + (f": {outcome.text}" if outcome.text else "")
        self._tell("info" if good else "warning", words)
        if good and outcome.name == "mission" and self.missions.goals_m:
            self._outbox.append(self.missions.reached(len(self.missions.goals_m) - 1))

    def _beat(self, seen: VehicleState, now_ns: int) -> None:
        heard_ns = self._session.heard_ns
        silent_s = self._contact.silent_s(heard_ns, now_ns)
        if silent_s is not None:
            self._tell("warning", f"no word from the rover for {silent_s:.0f} s")
        if now_ns < self._heartbeat_ns:
            return
        self._heartbeat_ns = now_ns + _HEARTBEAT_NS
        if heard_ns is not None and now_ns - heard_ns < SILENT_NS:
            self._outbox += [To(None, heartbeat(seen)), To(None, self.missions.current())]

    def _say_all(self) -> None:
        for part in (self.desk, self.parameters):
            for severity, text in part.texts:
                self._tell(severity, text)
            part.texts.clear()
        if self.missions.problem:
            self._tell("warning", self.missions.problem)
            self.missions.problem = ""

    def _tell(self, severity: str, text: str) -> None:
        self._outbox.append(To(None, self._texts.say(severity, text)))


def _meant_for_the_rover(message: Any) -> bool:
    system = getattr(message, "target_system", 0)
    component = getattr(message, "target_component", 0)
    return system in (0, SYSTEM_ID) and component in (0, COMPONENT_ID)


def _mission_ack(target: tuple[int, int]) -> Callable[[int], Any]:
    def ack(result: int) -> Any:
        if result == m.MAV_RESULT_IN_PROGRESS:
            return None
        accepted = result == m.MAV_RESULT_ACCEPTED
        return m.MAVLink_mission_ack_message(*target, m.MAV_MISSION_ACCEPTED if accepted else m.MAV_MISSION_DENIED)

    return ack
