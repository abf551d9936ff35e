"""Bulk objects over a lossy link in virtual time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError
from protocol.link import bulk
from protocol.link import datagrams as link

MS = 1_000_000
S = 1000 * MS


class Bench:
    """A sender and a receiver with a line of `rate_bps` between them, delay and loss both ways; steps of 50 ms."""

    def __init__(self, rate_bps=64e3, one_way_ns=1300 * MS, loss=0.0, seed=1):
        self.limit, self.rate_bps, self.one_way_ns, self.loss = link.payload_limit(rate_bps), rate_bps, one_way_ns, loss
        self.generator = np.random.default_rng(seed)
        self.sender, self.receiver = bulk.Sender(self.limit), bulk.Receiver(self.limit)
        self.down: list[tuple[int, bytes]] = []
        self.up: list[tuple[int, bytes]] = []
        self.now_ns, self.tokens, self.line_bytes, self.dark = 0, 0.0, 0, False
        self.products: list[bulk.Product] = []

    def put(self, way, payloads):
        for payload in payloads:
            if not self.dark and self.generator.random() >= self.loss:
                way.append((self.now_ns + self.one_way_ns, payload))

    def due(self, way):
        out = [p for at, p in way if at <= self.now_ns]
        way[:] = [row for row in way if row[0] > self.now_ns]
        return out

    def step(self):
        for payload in self.due(self.up):
            self.sender.receive(payload, self.now_ns)
        for payload in self.due(self.down):
            product = self.receiver.receive(payload, self.now_ns)
            if product:
                self.products.append(product)
        self.put(self.up, self.receiver.send(self.now_ns))
        self.tokens = min(self.tokens + 0.93 * self.rate_bps / 8 * 0.05, 3000)
        sent = self.sender.send(self.now_ns, self.tokens)
        used = sum(link.line_bytes(len(p)) for p in sent)
        assert used <= self.tokens
        self.tokens -= used
        self.line_bytes += used
        self.put(self.down, sent)
        self.now_ns += 50 * MS

    def run(self, until_ns):
        while self.now_ns < until_ns and not (self.products and not self.sender.busy):
            self.step()
        return self


def noise(count, seed=3):
    return np.random.default_rng(seed).bytes(count)


@pytest.mark.parametrize(("loss", "share"), [(0.0, 0.85), (0.1, 0.8 * 0.9), (0.3, 0.8 * 0.7)])
@pytest.mark.parametrize("one_way_ns", [300 * MS, 1300 * MS])
def test_160_kb_at_64_kbit_per_second_use_their_share_of_the_bucket(loss, share, one_way_ns):
    bench, data = Bench(loss=loss, one_way_ns=one_way_ns), noise(160_000)
    bench.sender.offer("cloud", data, "raw", 0)
    while not bench.products and bench.now_ns < 120 * S:
        bench.step()
    assert bench.products[0][1:] == ("cloud", "raw", data)
    assert 160_000 / (0.93 * 64e3 / 8 * bench.now_ns / 1e9) >= share


def test_an_ldem_of_25_kb_arrives_within_10_seconds_at_30_percent_loss_and_lunar_delay():
    for seed in range(20):
        bench = Bench(loss=0.3, seed=seed)
        bench.sender.offer("ldem", noise(25_000), "ldem-1", 0)
        while not bench.products and bench.now_ns < 60 * S:
            bench.step()
        assert bench.now_ns <= 10 * S, seed


def test_both_sides_fall_silent_once_the_object_is_confirmed():
    bench = Bench(loss=0.3)
    bench.sender.offer("ldem", noise(25_000), "ldem-1", 0)
    bench.run(60 * S)
    assert not bench.sender.busy
    for _ in range(100):
        bench.step()
    before = bench.line_bytes
    for _ in range(400):
        bench.step()
        assert not bench.up
    assert bench.line_bytes == before


def test_a_transfer_resumes_after_a_blackout_of_60_s_and_hardly_sends_in_it():
    bench = Bench(loss=0.1)
    bench.sender.offer("ldem", noise(60_000), "ldem-1", 0)
    bench.run(4 * S)
    bench.dark = True
    bench.run(17 * S)
    before = bench.line_bytes
    bench.run(64 * S)
    assert bench.line_bytes - before < 30 * 828
    assert not bench.products
    bench.dark = False
    bench.run(90 * S)
    assert [p.data for p in bench.products] == [noise(60_000)]


@pytest.mark.parametrize("who", ["sender", "receiver"])
def test_a_transfer_completes_though_one_side_is_restarted_in_it(who):
    bench, data = Bench(loss=0.1), noise(60_000)
    bench.sender.offer("ldem", data, "ldem-1", 0)
    bench.run(5 * S)
    confirmed = bench.sender.progress()["ldem"][0]
    assert confirmed > 5
    if who == "sender":
        bench.sender = bulk.Sender(bench.limit)
        bench.sender.offer("ldem", data, "ldem-1", bench.now_ns)
    else:
        bench.receiver = bulk.Receiver(bench.limit)
    bench.run(60 * S)
    assert [p.data for p in bench.products] == [data]


def test_a_newer_object_of_the_same_name_takes_the_place_of_the_older():
    bench = Bench(loss=0.1)
    bench.sender.offer("ldem", noise(25_000), "ldem-1", 0)
    bench.run(2 * S)
    bench.sender.offer("ldem", noise(25_000, seed=9), "ldem-1", bench.now_ns)
    bench.run(60 * S)
    assert [p.data for p in bench.products] == [noise(25_000, seed=9)]
    assert bench.receiver.progress() == {}


def test_the_same_content_offered_again_goes_on_and_once_known_costs_one_announcement_of_time():
    bench, data = Bench(), noise(25_000)
    first = bench.sender.offer("ldem", data, "ldem-1", 0)
    bench.run(3 * S)
    assert bench.sender.offer("ldem", data, "ldem-1", bench.now_ns) == first
    assert bench.sender.progress()["ldem"][0] > 0
    bench.run(30 * S)
    bench.sender.offer("ldem", data, "ldem-1", bench.now_ns)
    began_ns = bench.now_ns
    while bench.sender.busy:
        bench.step()
    assert bench.now_ns - began_ns <= 3500 * MS
    assert len(bench.products) == 1


def test_a_higher_priority_goes_first():
    bench = Bench()
    bench.sender.offer("cloud", noise(50_000), "raw", 0)
    bench.sender.offer("ldem", noise(5_000, seed=4), "ldem-1", 0, priority=1)
    bench.run(60 * S)
    assert bench.products[0].name == "ldem"


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.integers(1, 4000), st.integers(0, 2**16), st.sampled_from([0.0, 0.3, 0.5]))
def test_any_length_arrives_unchanged_at_any_loss(length, seed, loss):
    bench = Bench(rate_bps=16e3, loss=loss, seed=seed, one_way_ns=300 * MS)
    bench.sender.offer("a", noise(length, seed), "raw", 0)
    bench.run(200 * S)
    assert [p.data for p in bench.products] == [noise(length, seed)]


def test_duplicates_and_any_order_are_harmless():
    sender, receiver = bulk.Sender(210), bulk.Receiver(210)
    data = noise(3000)
    sender.offer("a", data, "raw", 0)
    payloads = sender.send(0, 1e6)
    order = np.random.default_rng(1).permutation(len(payloads) * 3) % len(payloads)
    products = [p for n in order if (p := receiver.receive(payloads[n], 0))]
    assert [p.data for p in products] == [data]
    assert sender.receive(receiver.send(0)[0], 0) == "a"


def test_an_object_whose_hash_is_wrong_is_thrown_away_and_asked_for_again():
    sender, receiver = bulk.Sender(210), bulk.Receiver(210)
    sender.offer("a", noise(300), "raw", 0)
    announce, first, second, *_ = sender.send(0, 1e6)
    bad = first[:-1] + bytes([first[-1] ^ 1])
    assert [receiver.receive(p, 0) for p in (announce, bad, second)] == [None] * 3
    assert receiver.damaged == 1
    receiver.receive(first, 1)
    product = receiver.receive(second, 2)
    assert product is not None and product.data == noise(300)


def test_a_repair_symbol_makes_good_a_lost_chunk_without_a_round_trip():
    sender, receiver, data = bulk.Sender(210), bulk.Receiver(210), noise(1500)
    sender.offer("a", data, "raw", 0)
    payloads = sender.send(0, 1e6)
    chunks = -(-1500 // 197)
    assert len(payloads) > 1 + chunks
    lost = {2, 5, chunks}  # two in the middle and the last, which is shorter
    products = [p for n, payload in enumerate(payloads) if n not in lost and (p := receiver.receive(payload, 0))]
    products += [p for payload in sender.send(300 * MS, 1e6) if (p := receiver.receive(payload, 0))]
    assert [p.data for p in products] == [data]


@pytest.mark.parametrize("payload", [
    b"", bytes(9), bytes(8) + b"\xff\xff", bytes(8) + b"\xff\xff" + bytes(40), bytes(8) + b"\xfe\xff",
    bytes(8) + b"\xfe\xff" + bytes(3),
])  # fmt: skip
def test_malformed_chunks_are_wire_errors(payload):
    with pytest.raises(WireError):
        bulk.Receiver(200).receive(payload, 0)


def test_a_malformed_bitmap_is_a_wire_error_and_one_of_another_object_is_ignored():
    with pytest.raises(WireError):
        bulk.Sender(200).receive(b"abc", 0)
    assert bulk.Sender(200).receive(bytes(11), 0) is None
