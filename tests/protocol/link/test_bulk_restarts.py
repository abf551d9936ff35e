"""Bulk objects whose ends are restarted in the middle: the receiver takes in what its shell kept, and goes on."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from protocol.link import bulk, bulk_wire, repair
from protocol.link import datagrams as link

MS = 1_000_000
S = 1000 * MS
STEP_NS = 50 * MS


class Line:
    """Both ends, restartable, over a line that loses, delays each datagram otherwise and doubles some; steps of 50 ms.

    kept: what the receiver's shell has on disk, in the order heard. chunks: data chunks sent, with all repetitions.
    """

    def __init__(self, data, seed=1, loss=0.0, jitter=0, rate_bps=64e3, one_way_ns=600 * MS, keeps=True):
        self.data, self.loss, self.jitter, self.rate_bps, self.one_way_ns = data, loss, jitter, rate_bps, one_way_ns
        self.limit, self.keeps = link.payload_limit(rate_bps), keeps
        self.generator = np.random.default_rng(seed)
        self.sender, self.receiver = bulk.Sender(self.limit), bulk.Receiver(self.limit)
        self.down, self.up, self.kept, self.got = [], [], [], []
        self.recalled = {}
        self.now_ns, self.boot_ns, self.tokens, self.chunks = 20 * S, 10 * S, 0.0, 0

    @property
    def onboard_ns(self):
        return self.now_ns - self.boot_ns

    def ask(self):
        """The operator asks; the bench lets the rover hear it with the hints of the same turn."""
        self.receiver.hint("ldem")
        for payload in self.receiver.send(self.now_ns):
            if self.generator.random() >= self.loss:
                self.sender.receive(payload, self.onboard_ns)
        self.sender.offer("ldem", self.data, "ldem-2", self.onboard_ns)

    def restart_receiver(self):
        self.receiver, self.recalled = bulk.Receiver(self.limit), {}
        for payload in reversed(self.kept) if self.keeps else ():
            whole = self.receiver.recall(payload, self.now_ns)
            if whole:
                self.recalled[whole.object_id] = whole

    def restart_sender(self, uptime_ns=3 * S, rate_bps=None):
        self.boot_ns = self.now_ns - uptime_ns
        self.limit = link.payload_limit(rate_bps or self.rate_bps)
        self.sender = bulk.Sender(self.limit)

    def put(self, way, payloads):
        for payload in payloads:
            copies = 1 + (self.jitter and self.generator.random() < 0.1)
            for _ in range(copies if self.generator.random() >= self.loss else 0):
                late_ns = int(self.generator.integers(0, self.jitter + 1))
                way.append((self.now_ns + self.one_way_ns + late_ns, payload))

    def due(self, way):
        out = [p for at, p in way if at <= self.now_ns]
        way[:] = [row for row in way if row[0] > self.now_ns]
        return out

    def hear(self, payload):
        self.kept.append(payload)
        product = self.receiver.receive(payload, self.now_ns)
        object_id, _, index = bulk_wire.chunk_head(payload)
        if index == bulk_wire.ANNOUNCEMENT:
            product = product or self.recalled.pop(object_id, None)
        self.got += [product] if product else []

    def step(self):
        for payload in self.due(self.up):
            self.sender.receive(payload, self.onboard_ns)
        for payload in self.due(self.down):
            self.hear(payload)
        self.put(self.up, self.receiver.send(self.now_ns))
        self.tokens = min(self.tokens + 0.93 * self.rate_bps / 8 * 0.05, 3000)
        sent = self.sender.send(self.onboard_ns, self.tokens)
        self.tokens -= sum(link.line_bytes(len(p)) for p in sent)
        self.chunks += sum(bulk_wire.chunk_head(p)[2] < bulk_wire.REPAIR for p in sent)
        self.put(self.down, sent)
        self.now_ns += STEP_NS

    def run(self, for_ns, until=lambda: False):
        end_ns = self.now_ns + for_ns
        while self.now_ns < end_ns and not until():
            self.step()
        return self

    @property
    def done(self):
        return bool(self.got) and not self.sender.busy


def noise(count, seed=3):
    return np.random.default_rng(seed).bytes(count)


def count_of(data, line):
    return -(-len(data) // (line.limit - 10 - repair.HEAD_BYTES))


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.integers(1, 40_000), st.integers(0, 2**16), st.sampled_from([0.0, 0.1, 0.3]), st.sampled_from([0, 2 * S]),
    st.lists(st.tuples(st.integers(0, 4000), st.sampled_from(["ground", "rover", "both"]),
                       st.integers(0, 15_000), st.booleans()), max_size=4),
)  # fmt: skip
@example(30_000, 1, 0.3, 2 * S, [(1500, "rover", 9_000, True), (500, "ground", 0, False), (900, "both", 0, True)])
def test_whoever_is_restarted_when_and_how_often_the_bytes_are_right(length, seed, loss, jitter, restarts):
    data = noise(length, seed)
    line = Line(data, seed, loss, jitter)
    line.ask()
    for after_ms, who, uptime_ms, asked_at_once in restarts:
        line.run(after_ms * MS, lambda: line.done)
        if who in ("ground", "both"):
            line.restart_receiver()
        if who in ("rover", "both"):
            line.restart_sender(uptime_ms * MS)
            if not asked_at_once:
                line.run(2 * S)
            line.ask()
    line.run(300 * S, lambda: line.done)
    assert line.got
    assert all(product.data == data for product in line.got)
    assert not line.sender.busy


@pytest.mark.parametrize("who", ["ground", "rover", "both"])
@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_after_a_restart_hardly_a_chunk_that_is_there_is_sent_again(who, share):
    data = noise(60_000)
    line = Line(data)
    line.ask()
    line.run(100 * S, lambda: line.receiver.progress().get("ldem", (0, 1))[0] >= share * count_of(data, line))
    if who != "rover":
        line.restart_receiver()
    if who != "ground":
        line.restart_sender()
        line.ask()
    line.run(100 * S, lambda: line.done)
    assert [product.data for product in line.got] == [data]
    under_way = 2 * 0.6 * 0.93 * 64e3 / 8 / 800
    assert line.chunks <= count_of(data, line) + (under_way + 2 if who != "ground" else 0)


def test_without_what_was_kept_the_whole_is_sent_again():
    data = noise(60_000)
    line = Line(data, keeps=False)
    line.ask()
    line.run(100 * S, lambda: line.receiver.progress().get("ldem", (0, 1))[0] >= 40)
    line.restart_receiver()
    line.restart_sender()
    line.ask()
    line.run(100 * S, lambda: line.done)
    assert line.chunks >= count_of(data, line) + 40


def test_a_whole_object_asked_for_again_after_a_restart_of_both_costs_its_announcement():
    data = noise(60_000)
    line = Line(data)
    line.ask()
    line.run(100 * S, lambda: line.done)
    before = line.chunks
    line.restart_receiver()
    line.restart_sender()
    line.ask()
    line.run(20 * S, lambda: len(line.got) == 2 and not line.sender.busy)
    assert [product.data for product in line.got] == [data, data]
    assert line.chunks == before


def test_other_bytes_after_the_restart_are_not_mixed_with_what_is_there():
    line = Line(noise(60_000))
    line.ask()
    line.run(4 * S)
    line.restart_receiver()
    line.restart_sender()
    line.data = noise(60_000, seed=9)
    line.ask()
    line.run(100 * S, lambda: line.done)
    assert [product.data for product in line.got] == [noise(60_000, seed=9)]


@pytest.mark.parametrize("rate_bps", [16e3, 256e3])
def test_a_sender_that_cuts_otherwise_after_its_restart_goes_on_with_the_same_bytes(rate_bps):
    data = noise(60_000)
    line = Line(data)
    line.ask()
    line.run(100 * S, lambda: line.receiver.progress().get("ldem", (0, 1))[0] >= 40)
    line.restart_receiver()
    line.restart_sender(rate_bps=rate_bps)
    line.chunks = 0
    line.ask()
    line.run(200 * S, lambda: line.done)
    assert [product.data for product in line.got] == [data]
    assert line.chunks * (line.limit - 13) < 0.75 * len(data)


def test_a_hint_that_is_not_true_any_more_is_taken_back_by_the_first_bitmap():
    data = noise(30_000)
    line = Line(data)
    line.ask()
    line.run(100 * S, lambda: line.done)
    line.restart_sender()
    line.receiver.hint("ldem")
    for payload in line.receiver.send(line.now_ns):
        line.sender.receive(payload, line.onboard_ns)
    line.keeps, line.got = False, []
    line.restart_receiver()
    line.sender.offer("ldem", data, "ldem-2", line.onboard_ns)
    line.run(100 * S, lambda: line.done)
    assert [product.data for product in line.got] == [data]


def test_two_objects_of_one_id_are_never_mixed():
    sender, receiver, data = bulk.Sender(210), bulk.Receiver(210), noise(1000)
    sender.offer("a", data, "raw", 0)
    announce, *chunks = sender.send(0, 1e6)
    other = bytearray(announce)
    other[bulk_wire.CHUNK.size + 6] ^= 1  # of its SHA-256: another object that claims this one's id
    receiver.receive(bytes(other), 0)
    for payload in chunks[:3]:
        receiver.receive(payload, 0)
    receiver.receive(announce, 0)
    assert receiver.progress() == {"a": (0, 6)}
    assert [p.data for payload in chunks if (p := receiver.receive(payload, 0))] == [data]
    assert receiver.damaged == 0


def test_what_is_recalled_is_bounded_and_says_nothing_of_itself():
    receiver = bulk.Receiver(210)
    for seed in range(100):
        sender = bulk.Sender(210)
        sender.offer(f"object-{seed}", noise(1000, seed), "raw", 0)
        for payload in sender.send(0, 600):
            receiver.recall(payload, 0)
    assert receiver.progress() == {} and receiver.send(0) == [] and not receiver.hinting
    for seed in range(100):
        receiver.hint(f"object-{seed}")
    assert len(receiver.send(0)) == 32
    assert [len(receiver.send(n * 500 * MS)) for n in (1, 2, 3)] == [32, 32, 0]


def test_a_sender_keeps_few_hints_and_the_newest():
    sender, payloads = bulk.Sender(210), []
    for seed in range(20):
        one, receiver = bulk.Sender(210), bulk.Receiver(210)
        one.offer(f"object-{seed}", noise(1000, seed), "raw", 0)
        for payload in one.send(0, 1e6):
            receiver.receive(payload, 0)
        payloads += receiver.send(0)
    for payload in payloads:
        sender.receive(payload, 0)
    for seed in range(20):
        sender.offer(f"object-{seed}", noise(1000, seed), "raw", 0)
    assert [name for name, (there, _) in sender.progress().items() if there] == [f"object-{n}" for n in range(12, 20)]
