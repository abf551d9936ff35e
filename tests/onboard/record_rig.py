"""Short runs with a record: a standing rover with emulated nodes, and whatever else its ports may say."""

from __future__ import annotations

import errno
from dataclasses import replace

import numpy as np

from hil.devices.can.nodes import build_nodes
from hil.records import PlantState, WheelTruth
from onboard.config import load
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.record.writer import Recorder
from onboard.records import (
    BusStatus,
    BusTrouble,
    Chunk,
    Health,
    Inputs,
    LinkMessage,
    Machine,
    PortState,
    RecordStatus,
    Timing,
)
from onboard.records.status import SaveResult
from protocol.conventions import TICK_NS

TICKS = 300
STANDING = (WheelTruth(0.0, 0.0, 0.0, 0.0),) * 4


def standing(now_ns):
    """The truth of a rover on level ground."""
    zero = np.zeros(3)
    return PlantState(now_ns, zero, np.array([0, 0, 0, 1.0]), zero, zero, np.array([0.0, 0.0, 1.62]), STANDING)


def plain(inputs):
    """Inputs with CAN frames alone."""
    return inputs


def of_everything(inputs):
    """Inputs in which every channel of the record has something, now and then."""
    n = inputs.tick
    return replace(
        inputs,
        can=BusStatus(send_failures=n, error_frames=(n // 10,) * len(BusTrouble)),
        lidar_chunks=(Chunk(inputs.now_ns - 3_000, b"SCIP? \n" * (n % 3)),),
        lidar_state=PortState.OPEN,
        link_messages=(LinkMessage(inputs.now_ns, False, "tag", 3, 1, b""),) if n % 7 == 0 else (),
        health=Health(1_000_000 + n, utc_ns=n),
        machine=Machine(0.5, 0.4, 9e7, 1e9, float(n), 1e10),
        timing=Timing(4_000, (10_000 + n,) * 3, ()),
        saved=(SaveResult("fences", "not kept: no room"),) if n % 50 == 0 else (),
    )


def fly(
    path,
    *,
    ticks=TICKS,
    settings=None,
    change=lambda outputs: outputs,
    say=plain,
    disk=None,
    look=lambda recorder: None,
):
    """So many ticks of standing: the nodes' frames in, the core's orders back to them, all of it recorded.

    change: what is recorded of the outputs. say: adds to the inputs. disk: in place of the real one; its `at` is called
    before each tick. look: sees the recorder after each tick.
    Returns (the path, the recorder's status in each tick, the events).
    """
    if disk:
        disk.at(0)
    config = load(None, {"record.path": str(path), "clock.mode": "lockstep", **(settings or {})})
    rover, nodes, statuses, events = Rover(config, None), build_nodes(3), [], []
    with Recorder(config, None, **({"opener": disk.open} if disk else {})) as recorder:
        for number in range(1, ticks + 1):
            if disk:
                disk.at(number)
            now_ns = number * TICK_NS
            nodes.step(now_ns, standing(now_ns))
            statuses.append(recorder.status)
            inputs = say(Inputs(number, now_ns, can_frames=tuple(nodes.send()), record=recorder.status))
            outputs = tick(rover, inputs)
            for frame in outputs.can_frames:
                nodes.receive(frame, now_ns)
            events += outputs.events
            recorder.write(inputs, change(outputs))
            look(recorder)
    return path, statuses, events


class Disk:
    """Files in memory on a disk that refuses, with an errno, in the ticks of `refuses` (first, last).

    torn: what of a refused write is in the file all the same.
    """

    def __init__(self, number=errno.ENOSPC, refuses=(-1, -1), torn=0.5, room_bytes=1 << 40):
        self._errno, self._refuses, self._torn, self._room = number, refuses, torn, room_bytes
        self._broken, self.files = False, {}

    def at(self, tick):
        """Before a tick."""
        self._broken = self._refuses[0] <= tick <= self._refuses[1]

    def open(self, path):
        """In place of onboard.drivers.storage.record_file.DiskFile."""
        self.ask()
        self.files[path] = bytearray()
        return _File(self, path)

    def ask(self):
        """Raises OSError while it refuses."""
        if self._broken:
            raise OSError(self._errno, "refused")

    def store(self, path):
        """As a real file."""
        path.write_bytes(self.files[path])
        return path


class _File:
    def __init__(self, disk, path):
        self._disk, self._path = disk, path

    def put(self, data, offset):
        held = self._disk.files[self._path]
        whole = len(data) if not self._disk._broken else int(self._disk._torn * len(data))
        held[offset : offset + whole] = data[:whole]
        self._disk.ask()

    def force(self):
        self._disk.ask()

    def cut(self, size):
        del self._disk.files[self._path][size:]

    def free_bytes(self):
        return self._disk._room - sum(map(len, self._disk.files.values()))

    def close(self):
        """Nothing to close."""


GOOD = RecordStatus()
