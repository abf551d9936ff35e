"""Lossy link of the bench: a zenoh node between rover and ground that delays and loses by `hil.link.impairment`.

    rover --- er2/d ---> [down model] --- er2/d ---> ground          two sessions, each on a TCP endpoint of its own
    rover <-- er2/u ---- [up model]   <-- er2/u ---- ground

In lock-step the emulator is the participant "link". The channels "down_in" and "up_in" of a TICK give the number of
datagrams that rover and ground have sent so far. The emulator waits for that many, offers them at bench time, sends the
due ones and answers DONE with the total "down_out" and "up_out" and the tick at which the next datagram is due. A
channel that a TICK does not name has no new datagrams. A new epoch of a channel means that its sender has restarted and
counts from zero again. With a live ground station the emulator takes all datagrams that have arrived from it, and the
run does not repeat.
Only the models lose datagrams: the sessions are reliable and blocking, and no tick starts before each side's probe was
answered.
"""

from __future__ import annotations

import hashlib
import select
import socket
import time
from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import Any

import zenoh

from hil.link.impairment import Impairment, Profile, both_directions
from hil.link.record import Recorder
from protocol import barrier
from protocol.link import carrier
from protocol.link.datagrams import KEY_DOWN, KEY_UP, MAX_DATAGRAM

NEVER = 2**62
_RELIABLE: dict[str, Any] = {
    "congestion_control": zenoh.CongestionControl.BLOCK,
    "reliability": zenoh.Reliability.RELIABLE,
    "express": True,
}


class LinkError(RuntimeError):
    """The link cannot continue; the text is one line with the reason."""


class _Stream:
    """Number of datagrams that passed a point, and the SHA-256 of all of them, each after its length."""

    def __init__(self) -> None:
        self.count = self.size = 0
        self._sum = hashlib.sha256()

    def add(self, datagram: bytes) -> None:
        self.count += 1
        self.size += len(datagram)
        self._sum.update(len(datagram).to_bytes(4, "little") + datagram)

    def report(self) -> dict[str, Any]:
        return {"datagrams": self.count, "bytes": self.size, "sha256": self._sum.hexdigest()}


class Side:
    """Session with one end of the link. Use it inside `with`."""

    def __init__(self, name: str, endpoint: str, key_in: str, key_out: str) -> None:
        self._name, self._endpoint, self._key_in, self._key_out = name, endpoint, key_in, key_out
        self._stack = ExitStack()
        self._epoch = self._epoch_start = 0
        self.ready = False
        self.taken, self.put_out = _Stream(), _Stream()

    def __enter__(self) -> Side:
        config = zenoh.Config()
        for key, text in carrier.settings(listen=self._endpoint):
            config.insert_json5(key, text)
        try:
            session = self._stack.enter_context(zenoh.open(config))
        except zenoh.ZError as error:
            raise LinkError(f"{self._name} side: cannot listen on {self._endpoint}: {error}") from error
        fifo = zenoh.handlers.FifoChannel
        self._in = session.declare_subscriber(self._key_in, fifo(carrier.QUEUE_SAMPLES))
        self._questions = session.declare_subscriber(carrier.question_key(self._name), fifo(1000))
        self._out = session.declare_publisher(self._key_out, **_RELIABLE)
        self._answers = session.declare_publisher(carrier.answer_key(self._name), **_RELIABLE)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stack.__exit__(kind, error, at)

    def serve_probes(self) -> None:
        """Answer the probes that have arrived; set `ready` once this side has received an answer."""
        while (sample := self._questions.try_recv()) is not None:
            words = sample.payload.to_bytes()
            if words == carrier.READY:
                self.ready = True
            else:
                self._answers.put(words)

    def take(self, channel: barrier.Channel, limit_s: float) -> list[bytes]:
        """Datagrams since the last call, exactly up to the channel's count. Raises LinkError after `limit_s`."""
        if channel.epoch != self._epoch:
            self._epoch, self._epoch_start = channel.epoch, self.taken.count
        missing = self._epoch_start + channel.count - self.taken.count
        got: list[bytes] = []
        deadline_s = 0.0
        while len(got) < missing:
            sample = self._in.try_recv()
            if sample is not None:
                got.append(self._note(sample.payload.to_bytes()[: MAX_DATAGRAM + 1]))
                continue
            now_s = time.monotonic()
            deadline_s = deadline_s or now_s + limit_s
            if now_s > deadline_s:
                raise LinkError(f"{self._name} side: {len(got)} of {missing} datagrams came within {limit_s:g} s")
            time.sleep(50e-6)
        return got

    def take_now(self) -> list[bytes]:
        """Datagrams that have arrived since the last call."""
        got = []
        while (sample := self._in.try_recv()) is not None:
            got.append(self._note(sample.payload.to_bytes()[: MAX_DATAGRAM + 1]))
        return got

    def _note(self, datagram: bytes) -> bytes:
        self.taken.add(datagram)
        return datagram

    def put(self, datagrams: list[bytes]) -> None:
        """Send datagrams to this end of the link."""
        for datagram in datagrams:
            self._out.put(datagram)
            self.put_out.add(datagram)


class LinkEmulator:
    """Both sides and both models. Use it inside `with`. recorder: file for every datagram's fate, or None."""

    def __init__(
        self, profile: Profile, seed: int, rover_endpoint: str, ground_endpoint: str, recorder: Recorder | None = None
    ) -> None:
        self._recorder = recorder
        self.down, self.up = both_directions(profile, seed)
        self.rover = Side(carrier.ROVER, rover_endpoint, KEY_DOWN, KEY_UP)
        self.ground = Side(carrier.GROUND, ground_endpoint, KEY_UP, KEY_DOWN)
        self.limit_s = 30.0  # wall time: longest transport of a counted datagram over the loopback
        self._stack = ExitStack()

    def __enter__(self) -> LinkEmulator:
        with ExitStack() as stack:
            stack.enter_context(self.rover)
            stack.enter_context(self.ground)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stack.__exit__(kind, error, at)

    def serve_probes(self) -> None:
        """Answer the probes of both sides; an end that restarts during a run reconnects by them."""
        self.rover.serve_probes()
        self.ground.serve_probes()

    def wait_ready(self, sides: tuple[Side, ...], limit_s: float) -> None:
        """Serve probes until each of the sides has its answer. Raises LinkError after `limit_s`."""
        deadline_s = time.monotonic() + limit_s
        while not all(side.ready for side in sides):
            self.serve_probes()
            if time.monotonic() > deadline_s:
                raise LinkError(
                    f"rover ready: {self.rover.ready}, ground ready: {self.ground.ready}; "
                    f"waited {limit_s:g} s for their probes"
                )
            time.sleep(0.001)

    def step(self, now_ns: int, channels: tuple[barrier.Channel, ...] = (), live: tuple[str, ...] = ()) -> int | None:
        """Run one tick: take, offer, send the due datagrams. Returns the time of the next due datagram, or None."""
        by_name = {channel.name: channel for channel in channels}
        for side, model, name in ((self.rover, self.down, "down_in"), (self.ground, self.up, "up_in")):
            taken: list[bytes] = []
            if name in live:
                taken = side.take_now()
            elif name in by_name:
                taken = side.take(by_name[name], self.limit_s)
            for datagram in taken:
                fate = model.offer(datagram, now_ns)
                if self._recorder is not None:
                    self._recorder.note(name.removesuffix("_in"), datagram, now_ns, fate, model.arrivals_ns)
        self.ground.put(self.down.due(now_ns))
        self.rover.put(self.up.due(now_ns))
        return min((t for t in (self.down.next_due_ns, self.up.next_due_ns) if t is not None), default=None)

    def turn(self, now_ns: int) -> None:
        """Run one step on the wall clock; takes all datagrams that have arrived."""
        self.serve_probes()
        self.step(now_ns, live=("down_in", "up_in"))

    def report(self) -> dict[str, Any]:
        """Per direction: datagrams in, lost by cause, out, and the SHA-256 of both streams."""

        def direction(model: Impairment, source: Side, target: Side) -> dict[str, Any]:
            return {**model.counts.report(), "in": source.taken.report(), "out": target.put_out.report()}

        down, up = direction(self.down, self.rover, self.ground), direction(self.up, self.ground, self.rover)
        return {"down": down, "up": up}


def run_lockstep(emulator: LinkEmulator, address: tuple[str, int], live_ground: bool, limit_s: float = 60.0) -> str:
    """Serve the bench's barrier until STOP; returns its reason. Raises LinkError if the bench is gone."""
    emulator.wait_ready((emulator.rover,) if live_ground else (emulator.rover, emulator.ground), limit_s)
    try:
        with socket.create_connection(address, timeout=limit_s) as bench:
            bench.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            bench.sendall(barrier.encode(barrier.Hello("link")))
            return _serve(emulator, bench, live_ground)
    except OSError as error:
        raise LinkError(f"barrier {address[0]}:{address[1]}: {error}") from error


def _serve(emulator: LinkEmulator, bench: socket.socket, live_ground: bool) -> str:
    receiver, tick_ns = barrier.Receiver(), 0
    while True:
        # Between ticks a restarting end may send probes: the bench waits for that end before the next tick.
        while not select.select([bench], [], [], 0.02)[0]:
            emulator.serve_probes()
        data = bench.recv(65_536)
        if not data:
            raise LinkError("the bench closed the barrier without a STOP")
        for message in receiver.receive(data):
            match message:
                case barrier.Welcome():
                    tick_ns = message.tick_ns
                case barrier.Tick():
                    bench.sendall(barrier.encode(_run_tick(emulator, message, tick_ns, live_ground)))
                case barrier.Stop():
                    return message.reason


def _run_tick(emulator: LinkEmulator, tick: barrier.Tick, tick_ns: int, live_ground: bool) -> barrier.Done:
    if live_ground:
        emulator.ground.serve_probes()
    due_ns = emulator.step(tick.now_ns, tick.channels, ("up_in",) if live_ground else ())
    wake = NEVER if due_ns is None else tick.number + max(1, -((tick.now_ns - due_ns) // tick_ns))
    if live_ground:
        wake = tick.number + 1
    sent = {"down_out": emulator.ground.put_out.count, "up_out": emulator.rover.put_out.count}
    return barrier.Done(tick.number, wake, sent)


def run_wall(turn: Callable[[int], object], stop: Callable[[int], bool], period_s: float = 0.002) -> None:
    """Run on the wall clock: turn(ns since the start) until stop(ns since the start) is true."""
    start_ns, now_ns = time.monotonic_ns(), 0
    while not stop(now_ns):
        now_ns = time.monotonic_ns() - start_ns
        turn(now_ns)
        time.sleep(period_s)
