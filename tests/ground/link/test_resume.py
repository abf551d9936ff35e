"""A product goes on where it was, whichever program was restarted in the middle of it."""

import sqlite3

from ground.archive.store import Archive
from ground.link.news import ProductHeard, ReportHeard
from ground.link.saved_state import SavedLinkState
from ground.link.session import Session
from hil.link.impairment import load_profile
from protocol.link.datagrams import OVERHEAD, DatagramKind, bench_keys, numbers
from protocol.link.transactions import RequestState
from tests.ground.link.test_session import KEYS, World
from tests.ground.toy_rover import ToyRover

S = 1_000_000_000
DAY_NS = 86_400 * S


class Restarted(World):
    """Store the session's data as the archive does, and count the chunks on the line."""

    def __init__(self, profile, archive=None):
        super().__init__(profile)
        self.archive, self.chunks, self.boot_id = archive, 0, 1
        self._watch()

    def _watch(self):
        heard, offer = self.session.receive, self.down.offer

        def receive(datagram, now_ns):
            verdict, news = heard(datagram, now_ns)
            self.archive.add("datagrams", now_ns, "down", verdict, datagram, *numbers(datagram))
            return verdict, news

        def count(datagram, now_ns):
            self.chunks += (
                datagram[0] == DatagramKind.BULK_CHUNK and datagram[OVERHEAD - 8 : OVERHEAD - 6] != b"\xff\xff"
            )
            return offer(datagram, now_ns)

        self.session.receive = receive
        if self.down.offer.__name__ != "count":
            self.down.offer = count

    def new_station(self, archive):
        old, self.archive = self.session, archive
        self.session = Session(KEYS, 1, kept=SavedLinkState(old.boot_id))
        self.session.sealer.counter, self.session.requester.next_id = old.sealer.counter, old.requester.next_id
        self.session.recall(archive.chunks)
        self._watch()

    def new_rover(self):
        self.boot_id += 1
        self.rover = ToyRover(KEYS, self.boot_id)

    def until(self, done, limit_s=100.0):
        end_ns = self.now_ns + round(limit_s * S)
        while not done():
            assert self.now_ns < end_ns
            self.tick()


def ask(world):
    return world.session.request("get", {"product": "ldem"}, world.now_ns)


def half_way(world):
    world.until(lambda: world.session.boot_id)
    asked = ask(world)
    world.until(lambda: world.session.transfers.get("ldem", (0, 1))[0] >= 15)
    return asked


def test_a_killed_station_goes_on_where_its_archive_is(tmp_path):
    alone = Restarted(load_profile("moon"), Archive(":memory:"))
    half_way(alone)
    alone.until(lambda: alone.heard(ProductHeard))
    with Archive(tmp_path / "a.db", utc_ns=DAY_NS) as first:
        world = Restarted(load_profile("moon"), first)
        half_way(world)
        first.commit()
        with Archive(tmp_path / "a.db", utc_ns=DAY_NS + 30 * S) as second:
            world.new_station(second)
            world.until(lambda: world.session.boot_id)
            ask(world)
            world.until(lambda: world.heard(ProductHeard))
            assert world.heard(ProductHeard)[0].product.data == world.rover.map
            assert world.chunks <= alone.chunks + 3
            assert world.session.texts == []


def test_a_rover_that_restarts_ends_the_request_with_a_reason_and_asked_again_it_sends_the_rest():
    world = Restarted(load_profile("moon"), Archive(":memory:"))
    asked = half_way(world)
    world.new_rover()
    world.until(lambda: world.session.boot_id == 2)
    request = world.session.requester.requests[asked]
    assert request.state is RequestState.FAILED and "ask again: what came is kept" in request.report.text
    assert world.heard(ReportHeard)[-1].report == request.report
    before = world.chunks
    ask(world)
    world.until(lambda: world.heard(ProductHeard))
    assert world.heard(ProductHeard)[0].product.data == world.rover.map
    assert world.chunks - before <= len(world.rover.map) / 740 - 15 + 3


def test_a_whole_product_is_there_again_after_a_restart_and_counts_once_the_rover_announces_it(tmp_path):
    with Archive(tmp_path / "a.db", utc_ns=DAY_NS) as first:
        world = Restarted(load_profile("ets8-a"), first)
        half_way(world)
        world.until(lambda: world.heard(ProductHeard))
        first.commit()
        with Archive(tmp_path / "a.db", utc_ns=DAY_NS + 30 * S) as second:
            world.new_station(second)
            world.new_rover()
            world.until(lambda: world.session.boot_id == 2)
            before, asked = world.chunks, ask(world)
            world.until(lambda: len(world.heard(ProductHeard)) == 2)
            world.until(lambda: world.session.awaits_product(asked))
            assert world.session.product_of(asked).data == world.rover.map
            world.until(lambda: not world.rover._bulk.busy)
            assert world.chunks == before


def test_damaged_and_foreign_parts_are_dropped_with_one_line_and_lose_nothing(tmp_path):
    path = tmp_path / "a.db"
    with Archive(path, utc_ns=DAY_NS) as first:
        world = Restarted(load_profile("moon"), first)
        half_way(world)
        first.add(
            "datagrams", 0, "down", "ok", ToyRover(bench_keys(8))._sealer.seal(DatagramKind.BULK_CHUNK, bytes(30))
        )
    with sqlite3.connect(path) as db:
        spoilt = "select rowid from datagrams where substr(data, 1, 1) = x'02' order by rowid desc limit 3"
        db.execute(f"update datagrams set data = cast(substr(data, 1, 100) || x'00' as blob) where rowid in ({spoilt})")
    db.close()
    with Archive(path, utc_ns=DAY_NS + 30 * S) as second:
        world.new_station(second)
        world.until(lambda: world.session.boot_id)
        ask(world)
        world.until(lambda: world.heard(ProductHeard))
        assert world.heard(ProductHeard)[0].product.data == world.rover.map
        (text,) = world.session.texts
        assert "3 are damaged or of another rover" in text and "0 products did not fit their SHA-256" in text


def test_of_the_archive_only_chunks_of_the_last_day_count_and_in_lock_step_none(tmp_path):
    path = tmp_path / "a.db"
    for day, name in ((1, b"old"), (3, b"new"), (3, b"newest")):
        with Archive(path, utc_ns=day * DAY_NS) as archive:
            archive.add("datagrams", 5, "down", "ok", b"\x02" + name)
            archive.add("datagrams", 5, "down", "replay", b"\x02refused")
            archive.add("datagrams", 5, "down", "ok", b"\x01telemetry")
    with Archive(path, utc_ns=3 * DAY_NS + 1) as archive:
        assert archive.chunks() == [b"\x02newest", b"\x02new"]
    with Archive(path) as archive:
        assert archive.chunks() == []
