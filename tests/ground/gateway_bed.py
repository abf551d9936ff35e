"""A bed for the gateway: its pure core on a virtual station, a rover with modes and parameters, clients in memory.

One thread and virtual time: each step is a tick of the rover, a turn of the gateway and what clients make of it.
"""

import math

from ground.gateway.clients import Door
from ground.gateway.frames import cut, decode
from ground.gateway.frames import mavlink as m
from ground.gateway.gateway import Gateway
from ground.gateway.origin import Origin
from ground.gateway.signing import EPOCH_S, stamp_of
from ground.link.session import Session
from onboard.config import Config
from onboard.parameters import ParameterSet, listing
from protocol.link.datagrams import DatagramKind, bench_keys
from protocol.link.transactions import RequestState
from protocol.mavlink_frames import ned_angles, ned_from_enu
from protocol.tables.modes import Mode, next_mode
from tests.ground.toy_rover import TICK_NS, ToyRover

S = 1_000_000_000
ORIGIN = Origin(38.2547, 140.8394, 150.0)
NOON = stamp_of((EPOCH_S + 300_000_000) * S)
OPEN = Door("unsigned")
GUI = ("127.0.0.1", 40_001)


class GatewayRover(ToyRover):
    """Obeys modes as the real one does; a goto or mission takes `drive_s`; parameters are the real ones."""

    def __init__(self, keys, **options) -> None:
        super().__init__(keys, **options)
        self.mode, self.settings, self.fails = Mode.STANDBY, ParameterSet(Config()), False
        self.orders: list[tuple[str, dict]] = []
        self.goal_m = (math.nan, math.nan)

    def deliver(self, opened, now_ns: int) -> None:
        if opened.kind != DatagramKind.TELECOMMAND:
            super().deliver(opened, now_ns)
            return
        order = self._executor.receive(opened.station, opened.payload, now_ns, self.mode)
        if order is not None:
            self._obey(order, now_ns)

    def _obey(self, order, now_ns: int) -> None:
        self.orders.append((order.name, dict(order.arguments)))
        self.executed.append(order.name)
        self.mode = next_mode(self.mode, order.name) or self.mode
        if order.name in ("goto", "mission", "return", "turn", "scan"):
            self.cancel(now_ns, "something else came")
            flat = order.arguments.get("goals_m") or (order.arguments.get("x_m"), order.arguments.get("y_m"))
            self.goal_m = tuple(math.nan if v is None else v for v in flat[:2])
            self._busy[order.request_id] = now_ns + self._drive_ns
            self._executor.report(order.request_id, RequestState.STARTED, now_ns)
        elif order.name == "param_list":
            object_id = self._bulk.offer("parameters", listing(self.settings).encode(), "text", now_ns)
            self._executor.report(order.request_id, RequestState.COMPLETED, now_ns, data=(object_id,))
        elif order.name == "param_set":
            self._set(order, now_ns)
        else:
            if order.name in ("stop", "safe", "emergency_stop"):
                self.cancel(now_ns, "stopped by the operator")
            self._executor.report(order.request_id, RequestState.COMPLETED, now_ns)

    def _set(self, order, now_ns: int) -> None:
        try:
            who = (now_ns, 1, order.station)
            self.settings = self.settings.set(order.arguments["parameter"], order.arguments["value"], who)
        except ValueError as error:
            self._executor.report(order.request_id, RequestState.FAILED, now_ns, str(error))
            return
        self.event(now_ns, "PARAMETER", str(self.settings.changes[-1]))
        self._executor.report(order.request_id, RequestState.COMPLETED, now_ns, "set")

    def tick_payloads(self, now_ns: int):
        busy = bool(self._busy)
        out = super().tick_payloads(now_ns)
        if busy and not self._busy:
            self.mode = next_mode(self.mode, "arrived") or self.mode
        return out

    def _telemetry(self, now_ns: int) -> bytes:
        ms = now_ns // 1_000_000
        encode = self._mavlink
        messages = (
            encode.rover_state_encode(ms, 0, *self.goal_m, math.nan, 0.1, 0.1, 0.01, 1, self.mode, 0),
            encode.link_state_encode(ms, *self.versions, 0, 0),
            encode.local_position_ned_encode(ms, *ned_from_enu(12.0, 3.0, 0.5), 0.0, 0.0, 0.0),
            encode.attitude_encode(ms, *ned_angles(0.01, 0.02, math.radians(30.0)), 0.0, 0.0, 0.0),
            encode.sys_status_encode(0, 0, 0, 100, 25_600, 210, 80, 0, 0, 0, 0, 0, 0),
        )
        return b"".join(message.pack(encode) for message in messages)


class Bed:
    """loses(direction, kind, n) -> bool: which datagrams of the rover's link are lost; n counts those of the kind."""

    def __init__(
        self,
        door: Door = OPEN,
        loses=lambda *_: False,
        delay_s: float = 0.0,
        home_first: bool = False,
        origin: Origin = ORIGIN,
        **rover,
    ) -> None:
        keys = bench_keys(7)
        self.door = door
        self.session, self.rover = Session(keys, 1), GatewayRover(keys, **rover)
        self.gateway = Gateway(self.session, origin, home_first=home_first)
        self.now_ns, self.silent = 0, False
        self._loses, self._delay_ns, self._counts = loses, round(delay_s * S), {}
        self._air: list[tuple[int, str, bytes]] = []
        self.said: list[tuple[tuple[str, int], object]] = []  # to whom, message; all that was ever sent
        self.by_kind: dict[tuple, list[tuple[int, object]]] = {}  # (to whom, kind) -> place in `said`, message
        self.kept: dict[str, int] | None = None

    @property
    def stamp(self) -> int:
        return NOON + self.now_ns // 10_000

    def step(self, seconds: float = 0.01) -> None:
        """Lets time pass, tick by tick."""
        for _ in range(round(seconds * S / TICK_NS)):
            self.now_ns += TICK_NS
            for datagram in self.rover.tick(self.now_ns):
                self._fly("down", datagram)
            self.turn()

    def turn(self) -> None:
        """One turn of the station with what has arrived."""
        self.gateway.turn(self.arrived(), self.now_ns)
        self._collect()
        for datagram in self.session.send(self.now_ns):
            self._fly("up", datagram)

    def arrived(self) -> list:
        """Hands over what the air has carried to its end; the station's news of it."""
        due = [row for row in self._air if row[0] <= self.now_ns]
        self._air = [row for row in self._air if row[0] > self.now_ns]
        news = []
        for _, way, datagram in due:
            if way == "down":
                news += self.session.receive(datagram, self.now_ns)[1]
            else:
                self.rover.receive(datagram, self.now_ns)
        return news

    def _collect(self) -> None:
        for _, address, frame in self.gateway.send(self.stamp):
            for message in map(decode, cut(frame)):
                self.by_kind.setdefault((address, message.get_type()), []).append((len(self.said), message))
                self.said.append((address, message))

    def _fly(self, way: str, datagram: bytes) -> None:
        kind = DatagramKind(datagram[0])
        n = self._counts[way, kind] = self._counts.get((way, kind), -1) + 1
        if not self.silent and not self._loses(way, kind, n):
            self._air.append((self.now_ns + self._delay_ns, way, datagram))

    def until(self, condition, limit_s: float = 60.0) -> None:
        """Steps until it holds; fails where it does not within the time."""
        end_ns = self.now_ns + round(limit_s * S)
        while not condition():
            assert self.now_ns < end_ns, "it does not come about"
            self.step()

    def receive(self, datagram: bytes, address=GUI, door: Door | None = None) -> int:
        """A datagram of a client; how many messages of it passed."""
        heard = self.gateway.clients.accept(door or self.door, address, datagram, self.stamp)
        marks = self.gateway.clients.marks()
        self.kept = marks or self.kept
        for one in heard:
            self.gateway.act(one, self.now_ns)
        self._collect()
        return len(heard)


class Client:
    """A ground program in memory, of one system id at one address."""

    def __init__(self, bed: Bed, address=GUI, system: int = 255) -> None:
        self.bed, self.address = bed, address
        self.mav = m.MAVLink(None, srcSystem=system, srcComponent=190)
        self.say(m.MAVLink_heartbeat_message(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3))

    def say(self, message) -> None:
        self.bed.receive(message.pack(self.mav), self.address)

    def command(self, command: int, *params: float, confirmation: int = 0) -> None:
        filled = [*params, *[0.0] * (7 - len(params))]
        self.say(m.MAVLink_command_long_message(1, 1, command, confirmation, *filled))

    def heard(self, kind: str, since: int = 0) -> list:
        return [message for at, message in self.bed.by_kind.get((self.address, kind), ()) if at >= since]

    def acks(self, command: int, since: int = 0) -> list[int]:
        """The results of a command's acknowledgements in order, each once in a row."""
        results = [one.result for one in self.heard("COMMAND_ACK", since) if one.command == command]
        return [r for i, r in enumerate(results) if i == 0 or results[i - 1] != r]

    def finals(self, command: int, since: int = 0) -> list[int]:
        return [r for r in self.acks(command, since) if r != m.MAV_RESULT_IN_PROGRESS]

    def texts(self) -> str:
        """All status texts; pieces joined."""
        return "".join(one.text + ("" if one.id and len(one.text) == 50 else "\n") for one in self.heard("STATUSTEXT"))

    def arm(self) -> None:
        self.bed.until(lambda: self.heard("HEARTBEAT"))
        self.command(m.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        self.bed.step(1.1)
        assert self.heard("HEARTBEAT")[-1].base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED
