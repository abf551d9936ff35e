"""The link emulator in lock-step with a bench of the test's own: counts are exact, drops follow the seed."""

import hashlib
import socket
import threading
import time
from contextlib import ExitStack

import pytest
import zenoh

from hil.link.emulator import NEVER, LinkEmulator, LinkError, Side, run_lockstep
from hil.link.impairment import both_directions, load_profile
from hil.processes import free_ports
from protocol import barrier
from protocol.link import carrier
from protocol.link.datagrams import KEY_DOWN, KEY_UP

TICK_NS = 10_000_000
LIMIT_S = 20.0


def free_endpoints(count: int) -> list[str]:
    return [f"tcp/127.0.0.1:{port}" for port in free_ports(count)]


class End:
    """A plain zenoh end of the link, opened by the probe."""

    def __init__(self, stack: ExitStack, side: str, endpoint: str) -> None:
        config = zenoh.Config()
        for key, text in carrier.settings(connect=endpoint):
            config.insert_json5(key, text)
        self.session = stack.enter_context(zenoh.open(config))
        keys = KEY_UP, KEY_DOWN
        self._key_in, self._key_out = keys if side == carrier.ROVER else keys[::-1]
        self._in = self.session.declare_subscriber(self._key_in, zenoh.handlers.FifoChannel(10_000))
        self._answers = self.session.declare_subscriber(carrier.answer_key(side), zenoh.handlers.FifoChannel(100))
        self._question = carrier.question_key(side)
        self.probe = carrier.Probe()

    def knock(self) -> None:
        words = self.probe.send(time.monotonic_ns())
        answer = self._answers.try_recv()
        for out in (words, answer and self.probe.receive(answer.payload.to_bytes())):
            if out:
                self.session.put(self._question, out, congestion_control=zenoh.CongestionControl.BLOCK)

    def put(self, datagram: bytes) -> None:
        self.session.put(self._key_out, datagram, congestion_control=zenoh.CongestionControl.BLOCK)

    def take(self, count: int) -> list[bytes]:
        got: list[bytes] = []
        until = time.monotonic() + LIMIT_S
        while len(got) < count and time.monotonic() < until:
            sample = self._in.try_recv()
            if sample is not None:
                got.append(sample.payload.to_bytes())
        assert self._in.try_recv() is None
        return got


class Bench:
    """Emulator in a thread, both ends, and this test as the bench that owns time."""

    def __init__(self, stack: ExitStack, profile: str, seed: int) -> None:
        server = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
        endpoints = free_endpoints(2)
        self.emulator = stack.enter_context(LinkEmulator(load_profile(profile), seed, *endpoints))
        self.reason: list[str] = []
        self._thread = threading.Thread(
            target=lambda: self.reason.append(run_lockstep(self.emulator, server.getsockname(), False, LIMIT_S))
        )
        self.rover = End(stack, carrier.ROVER, endpoints[0])
        self.ground = End(stack, carrier.GROUND, endpoints[1])
        self._thread.start()
        while not (self.rover.probe.open and self.ground.probe.open):
            self.rover.knock()
            self.ground.knock()
        server.settimeout(LIMIT_S)
        self._peer = stack.enter_context(server.accept()[0])
        self._peer.settimeout(LIMIT_S)
        stack.callback(self.stop)
        self._receiver = barrier.Receiver()
        assert self._hear() == barrier.Hello("link")
        self._peer.sendall(barrier.encode(barrier.Welcome(TICK_NS, 0)))

    def _hear(self) -> barrier.Message:
        while True:
            got = self._receiver.receive(self._peer.recv(65_536))
            if got:
                return got[0]

    def tick(self, n: int, **counts: int) -> barrier.Done:
        channels = tuple(barrier.Channel(name, count) for name, count in counts.items())
        self._peer.sendall(barrier.encode(barrier.Tick(n, n * TICK_NS, channels)))
        done = self._hear()
        assert isinstance(done, barrier.Done)
        assert done.number == n
        return done

    def stop(self) -> None:
        if self._thread.is_alive():
            self._peer.sendall(barrier.encode(barrier.Stop("over")))
            self._thread.join(LIMIT_S)


def run(profile: str, seed: int, ticks: int = 300) -> dict:
    """Both directions loaded for 3 s; each tick the emulator is called twice, as by the bench."""
    with ExitStack() as stack:
        bench = Bench(stack, profile, seed)
        down_out = up_out = 0
        got_down, got_up = [], []
        for n in range(ticks):
            bench.rover.put(b"down %d" % n)
            bench.ground.put(b"up %d" % n)
            for counts in ({"down_in": n + 1}, {"down_in": n + 1, "up_in": n + 1}):
                done = bench.tick(n, **counts)
                got_down += bench.ground.take(done.sent["down_out"] - down_out)
                got_up += bench.rover.take(done.sent["up_out"] - up_out)
                down_out, up_out = done.sent["down_out"], done.sent["up_out"]
        bench.stop()
        assert bench.reason == ["over"]
        return {"report": bench.emulator.report(), "down": got_down, "up": got_up}


def test_lock_step_delivers_exactly_what_the_model_says_and_repeats_with_its_seed():
    first, again = run("ets8-c", 5), run("ets8-c", 5)
    down, up = both_directions(load_profile("ets8-c"), 5)
    want_down, want_up = [], []
    for n in range(300):
        down.offer(b"down %d" % n, n * TICK_NS)
        want_down += down.due(n * TICK_NS)
        want_up += up.due(n * TICK_NS)
        up.offer(b"up %d" % n, n * TICK_NS)
    want_up += up.due(299 * TICK_NS)
    assert (first["down"], first["up"]) == (want_down, want_up)
    assert first == again
    assert first["report"]["down"]["offered"] == 300
    assert 0 < first["report"]["down"]["lost"] < 70


def test_report_holds_the_sums_of_both_streams():
    got = run("lan", 1, ticks=20)
    want = hashlib.sha256(b"".join(len(d).to_bytes(4, "little") + d for d in got["down"])).hexdigest()
    assert got["report"]["down"]["out"] == {"datagrams": 19, "bytes": sum(map(len, got["down"])), "sha256": want}
    assert got["report"]["down"]["in"]["datagrams"] == 20


def test_done_names_the_tick_of_the_next_arrival_so_quiet_ticks_may_be_skipped():
    with ExitStack() as stack:
        bench = Bench(stack, "moon", 1)
        assert bench.tick(0).wake_tick == NEVER
        bench.rover.put(bytes(72))
        done = bench.tick(1, down_in=1)
        assert 130 <= done.wake_tick <= 133  # 1.28 s to 1.30 s, and 12.5 ms on the line
        assert bench.tick(done.wake_tick - 1).sent["down_out"] == 0
        assert bench.tick(done.wake_tick).sent["down_out"] == 1
        assert bench.ground.take(1) == [bytes(72)]


def test_a_restarted_sender_counts_from_zero_in_a_new_epoch():
    with ExitStack() as stack:
        bench = Bench(stack, "lan", 1)
        bench.rover.put(b"before")
        bench.tick(0, down_in=1)
        bench.rover.put(b"after")
        bench._peer.sendall(barrier.encode(barrier.Tick(1, TICK_NS, (barrier.Channel("down_in", 1, epoch=1),))))
        bench._hear()
        bench.tick(2)
        assert bench.ground.take(2) == [b"before", b"after"]


def test_a_datagram_that_never_comes_ends_the_run_with_its_side():
    with (
        Side(carrier.ROVER, *free_endpoints(1), KEY_DOWN, KEY_UP) as side,
        pytest.raises(LinkError, match="rover side: 0 of 1 datagrams"),
    ):
        side.take(barrier.Channel("down_in", 1), 0.0)


def test_an_endpoint_in_use_is_named():
    (endpoint,) = free_endpoints(1)
    with (
        Side(carrier.ROVER, endpoint, KEY_DOWN, KEY_UP),
        pytest.raises(LinkError, match="ground side: cannot listen"),
        Side(carrier.GROUND, endpoint, KEY_UP, KEY_DOWN),
    ):
        pass
