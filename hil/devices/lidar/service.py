"""Emulated scanners on real cables and the wall clock: a single-threaded loop that waits for bytes or the next turn."""

from __future__ import annotations

import select
import time
from collections.abc import Callable, Sequence

from hil.devices.lidar.cable import Cable
from hil.devices.lidar.sensor import Lidar

IDLE_S = 0.1
UNPLUGGED_S = 0.01  # a terminal without client, or no port: only time to wait for


class Outlet:
    """Sensor with its cable."""

    def __init__(self, sensor: Lidar, cable: Cable) -> None:
        self.sensor, self.cable = sensor, cable
        self._epoch, self._boots = cable.epoch, 0

    def step(self, now_ns: int) -> None:
        """Run one step: bytes in, time on, bytes out."""
        sensor, cable = self.sensor, self.cable
        sensor.step(now_ns)
        if not sensor.reachable or sensor.machine.boots != self._boots:
            self._boots = sensor.machine.boots
            cable.disconnect()
        cable.refuse(not sensor.reachable)
        data = cable.poll()
        if cable.epoch != self._epoch:
            self._epoch = cable.epoch
            sensor.disconnect()
            sensor.connect()
        sensor.receive(data, now_ns)
        if sensor.connected and not cable.connected:
            sensor.disconnect()
        sensor.step(now_ns)
        for piece in sensor.pieces():
            cable.put(piece)

    def status(self, now_ns: int) -> dict[str, object]:
        """Status for people and programs."""
        sensor, machine = self.sensor, self.sensor.machine
        return {
            "address": self.cable.address,
            "client": self.cable.connected,
            "state": machine.state.name.lower(),
            "clock_ms": sensor.clock_ms(now_ns),
            "requests": sensor.requests,
            "scans": sensor.scans,
            "bytes": self.cable.sent,
            "dropped": self.cable.dropped,
            "faults": dict(sensor.faults.active),
        }


def serve(outlets: Sequence[Outlet], go_on: Callable[[int], bool]) -> None:
    """Run until `go_on(now_ns)` is false; it is called at least ten times a second. Time begins at 0."""
    begun_ns = time.monotonic_ns()
    while go_on(now_ns := time.monotonic_ns() - begun_ns):
        for outlet in outlets:
            outlet.step(now_ns)
        _wait(outlets, time.monotonic_ns() - begun_ns)


def _wait(outlets: Sequence[Outlet], now_ns: int) -> None:
    waiting, limit_s = select.poll(), IDLE_S
    for outlet in outlets:
        due_ns, fd = outlet.sensor.due_ns(), outlet.cable.fileno()
        if due_ns is not None:
            limit_s = min(limit_s, max(0.0, (due_ns - now_ns) * 1e-9))
        if fd < 0 or outlet.cable.hung_up:
            limit_s = min(limit_s, UNPLUGGED_S)
        else:
            waiting.register(fd, select.POLLIN | (select.POLLOUT if outlet.cable.waits_to_send else 0))
    waiting.poll(limit_s * 1e3)
