"""Bench over sockets: a world, its buses, and the lock-step with the processes under test.

One tick n (10 ms), in this order:

    devices' bytes and frames up to n -> TICK n -> onboard computes ... meanwhile plant and devices step to n + 1
    onboard's DONE -> its frames and bytes are drained -> link (down) -> ground -> link (up)

A command sent in tick n therefore acts in the plant from n + 1 to n + 2: one tick of transport, and two cores work at
the same time. Only counts decide when a tick may run, never arrival times: the same seed gives the same bytes in every
run.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Set
from dataclasses import dataclass

from hil.devices.can.hub import CanHub
from hil.devices.can.socket import CanSocket
from hil.devices.can.wire import ERROR_FRAMES
from hil.devices.lidar.server import LidarServer
from hil.run.lockstep import Barrier, ParticipantLostError
from hil.terrain.field import Field
from hil.world.truth import Truth
from hil.world.world import World
from onboard.config import Rover
from protocol.barrier import CLOSED, OPEN, Channel
from protocol.conventions import TICK_NS

WIRE_LIMIT_S = 30.0  # wall time limit for bytes that onboard reports as sent


@dataclass(frozen=True, slots=True)
class BenchConnections:
    """Connections of a bench.

    hub: its CAN bus
    alive: raises if a process of the run has died
    """

    hub: CanHub | CanSocket
    alive: Callable[[], None]


class Bench(World):
    """World behind real sockets. Open the ports, start the processes, then call `gather` and `step`."""

    def __init__(
        self, ground: Field, seed: int, rover: Rover, truth: Truth, joined: BenchConnections, soil: str = "nominal"
    ) -> None:
        super().__init__(ground, seed, rover, truth, soil=soil)
        self._alive = joined.alive
        self.hub, self.lidar_server, self.barrier = joined.hub, LidarServer("127.0.0.1"), Barrier()
        self.laps_ms: list[tuple[float, float]] = []  # of each tick: plant and devices; until onboard answered
        self.ground_code: int | None = None  # exit code of the operator's script once it has ended
        self._lidar_epoch = self._lidar_count = 0
        self._began_tick = self._onboard_epoch = 0  # of the running flight program: its clock starts at this tick
        self._can_client = self._can_count = 0  # the client's number is the epoch of the channel
        self._link_counts: dict[str, int] = {}
        self._sent_before = 0  # datagrams sent down by earlier flight programs: each counts from zero

    def lose(self, participant: str) -> None:
        """Remove a killed participant from the barrier."""
        self.barrier.drop(participant)

    def regain(self, participant: str) -> None:
        """Accept a restarted participant: its clock starts with the next tick, its ports' counts start from zero."""
        self.hub.disconnect(self._can_client)
        self.lidar_server.disconnect()
        if self.lidar_open:
            self.lidar_open = False
            self.lidar.disconnect()
        self._gather({participant})
        self._can_client, self._can_count = self.hub.wait_client(self._can_client + 1, WIRE_LIMIT_S), 0
        self._began_tick, self._onboard_epoch = self.tick, self._onboard_epoch + 1
        lost = self._link_counts.get("up_out", 0)
        self._sent_before += self._link_counts.get("down_in", 0)
        self._link_counts.update(onboard_lost=lost, onboard_knows=lost)
        self.unheard()

    # -- one tick ----------------------------------------------------------------------------------------------------

    def gather(self, names: Set[str]) -> None:
        """Wait until the processes are connected, and serve their handshakes meanwhile."""
        self._gather(names)
        self.advance(TICK_NS)

    def _gather(self, names: Set[str]) -> None:
        def idle() -> None:
            self.hub.poll()
            self.lidar_server.poll()
            self._alive()

        self.barrier.gather(names, idle)

    def step(self) -> None:
        """Run one tick of everything. Raises ParticipantLostError if onboard is gone, after the tick is complete."""
        self.tick += 1
        now_ns, lost = self.tick * TICK_NS, None
        onboard = self.barrier.participants.get("onboard")
        if onboard is None:
            self.unheard()
        elif self.computer.leaves_out(self.tick):
            onboard = None
        else:
            number, at_ns = self.tick - self._began_tick, now_ns - self._began_tick * TICK_NS
            try:
                onboard.begin(number, at_ns, self._channels(now_ns), self.computer.says(self.tick) or ())
            except ParticipantLostError as error:
                onboard, lost = None, error
        begun = time.perf_counter()
        self.advance(now_ns + TICK_NS)
        ready = time.perf_counter()
        if onboard:
            try:
                done = onboard.finish(self._alive)
                self.laps_ms.append((1e3 * (ready - begun), 1e3 * (time.perf_counter() - begun)))
                self._drain(done.sent, done.connect, now_ns)
            except ParticipantLostError as error:
                lost = error
        self._link_and_ground(now_ns)
        self.note(now_ns)
        self.progress.link = self._down()
        if lost:
            raise lost

    def _down(self) -> dict[str, int]:
        """Datagrams that the rover sent and the ground received since the bench began, over all flight programs."""
        sent = self._sent_before + self._link_counts.get("down_in", 0)
        return {"sent": sent, "received": self._link_counts.get("down_out", 0)}

    def _channels(self, now_ns: int) -> tuple[Channel, ...]:
        down = self._link_counts.get("up_out", 0)
        fresh = down - self._link_counts.get("onboard_knows", 0)
        self._link_counts["onboard_knows"] = down
        known = down - self._link_counts.get("onboard_lost", 0)
        link = Channel("link", known, OPEN, 0, (self._us(now_ns),) * fresh)
        return (self._can_channel(now_ns), self._lidar_channel(), link)

    def _us(self, stamp_ns: int) -> int:
        """Convert to the clock of the running flight program, us."""
        return (stamp_ns - self._began_tick * TICK_NS) // 1000

    def _can_channel(self, now_ns: int) -> Channel:
        frames, errors = self.frames(), self.can_errors()
        if not self.can.connected:
            self.hub.listen(self.can.plugged)
            self.hub.disconnect(self._can_client)
            return Channel("can", 0, CLOSED, self._can_client)
        self.hub.write(frames)
        for kind in errors:
            self.hub.write_error(*ERROR_FRAMES[kind], now_ns)
        self._can_count += len(frames) + len(errors)
        stamps = (*(self._us(frame.stamp_ns) for frame in frames), *(self._us(now_ns) for _ in errors))
        return Channel("can", self._can_count, OPEN, self._can_client, stamps)

    def _lidar_channel(self) -> Channel:
        was_open, pieces = self.lidar_open, self.lidar_says()
        if pieces is None:
            if was_open:
                self.lidar_server.disconnect()
            return Channel("lidar", 0, CLOSED, self._lidar_epoch)
        stamps: list[int] = []
        for stamp_ns, data in pieces:
            self.lidar_server.write(data)
            self._lidar_count += len(data)
            stamps += [len(data), self._us(stamp_ns)]
        return Channel("lidar", self._lidar_count, OPEN, self._lidar_epoch, tuple(stamps))

    def _drain(self, sent: dict[str, int], connect: tuple[str, ...], now_ns: int) -> None:
        stamp_ns = now_ns + TICK_NS  # the plant has advanced by one tick meanwhile
        frames = self.hub.read_upto(self._can_client, sent.get("can", 0), WIRE_LIMIT_S, stamp_ns)
        data = self.lidar_server.poll_exactly(sent.get("lidar", 0), WIRE_LIMIT_S) if self.lidar_open else b""
        self.hear(frames, data, stamp_ns)
        if "can" in connect:
            self._reconnect_can()
        if "lidar" in connect and not self.lidar_open:
            self._let_in()

    def _reconnect_can(self) -> None:
        self.can.connect()
        if self.can.connected:
            self.hub.listen(True)
            self._can_client = self.hub.wait_client(self._can_client + 1, WIRE_LIMIT_S)
            self._can_count = 0

    def _let_in(self) -> None:
        """Accept onboard's connection to the scanner.

        Without a cable it is cut off at once: left in the queue, it would be accepted when the cable is back, though
        onboard has given up.
        """
        if not self.lidar_server.wait_client(WIRE_LIMIT_S):
            raise TimeoutError(f"onboard asked for {self.lidar_server.address} and did not come")
        if not self.wires.lidar_plugged:
            self.lidar_server.disconnect()
            return
        self._lidar_epoch, self._lidar_count = self._lidar_epoch + 1, 0
        self.plug_in()

    def _link_and_ground(self, now_ns: int) -> None:
        counts, people = self._link_counts, self.barrier.participants
        onboard = people.get("onboard")
        if onboard:
            counts["down_in"] = onboard.sent.get("link", 0)
        self._call_link(now_ns)
        ground = people.get("ground")
        down_out = counts.get("down_out", 0)
        news = down_out != counts.get("ground_knows")
        if ground and self.ground_code is None and (news or self.tick >= ground.wake_tick):
            counts["ground_knows"] = down_out
            ground.begin(self.tick, now_ns, (Channel("down_out", down_out),))
            sent = ground.finish(self._alive).sent
            counts["up_in"] = sent.get("up_in", 0)
            self.ground_code = sent["finished"] - 1 if "finished" in sent else None
            self._call_link(now_ns)

    def _call_link(self, now_ns: int) -> None:
        counts, link = self._link_counts, self.barrier.participants.get("link")
        heard = (counts.get("down_in", 0), counts.get("up_in", 0))
        if link and (heard != (counts.get("link_down"), counts.get("link_up")) or self.tick >= link.wake_tick):
            counts["link_down"], counts["link_up"] = heard
            down = Channel("down_in", heard[0], OPEN, self._onboard_epoch)
            link.begin(self.tick, now_ns, (down, Channel("up_in", heard[1])))
            counts.update(link.finish(self._alive).sent)

    def close(self, reason: str) -> None:
        """End the run for all participants and close the ports."""
        self.barrier.close(reason)
        self.hub.close()
        self.lidar_server.close()
        self.free()
