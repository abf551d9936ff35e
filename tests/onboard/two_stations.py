"""The real core and real station sessions on one clock, joined by sealed datagrams: who hears whom is the test's."""

from dataclasses import replace

from ground.link.news import EventHeard, ReportHeard
from ground.link.session import Session
from onboard import config
from onboard.drivers.link.port import Gate
from onboard.drivers.link.saved_state import LinkMemory
from onboard.records.status import EPOCH
from protocol.link.datagrams import DOWNLINK_KEY_ID, KEY_DOWN, KEY_UP, Sealer
from protocol.link.keyring import EPOCHS, Keyring, LinkKeys
from tests.onboard.core_bench import QUICK, CoreBench

S = 1_000_000_000
SECRETS = {1: bytes(range(1, 33)), 2: bytes(range(33, 65))}
DOWN = bytes(range(65, 97))
EPOCHAL = tuple(range(EPOCHS))
LEASE_S = 10.0


def keys_of(*stations: int) -> LinkKeys:
    """What a station has: its own command key; the rover has all of them."""
    return LinkKeys(Keyring(KEY_UP, {n: SECRETS[n] for n in stations}, EPOCHAL), Keyring(KEY_DOWN, {0: DOWN}, EPOCHAL))


class World:
    """stations: sessions by number, added by `station`. sent_up, sent_down: when datagrams went, in s, by whom.

    deaf: numbers whose datagrams do not reach the rover. held: bytes that were sent and not delivered.
    """

    def __init__(self, folder: str = "", boot_id: int = 1) -> None:
        self.folder, self.boot_id = folder, boot_id
        self.stations: dict[int, Session] = {}
        self.news: dict[int, list] = {}
        self.sent_up: list[tuple[int, float]] = []
        self.sent_down: list[float] = []
        self.deaf: set[int] = set()
        self.wire: list[bytes] = []
        self.on_board: list[bytes] = []  # every datagram that reached the rover
        self.boot(boot_id)

    def boot(self, boot_id: int) -> None:
        """The flight program starts, over what is in the folder."""
        link = config.Link(lease_s=LEASE_S, boot_count=boot_id)
        self.bench = CoreBench(settings=replace(QUICK, link=link))
        self.memory = LinkMemory(self.folder, keys_of(1, 2))
        self.gate = Gate(keys_of(1, 2), boot_id, self.memory)
        self.bench.rover.link.epoch = self.memory.epoch
        self.boot_id = boot_id
        self.sealer = self._sealer(0)

    def _sealer(self, counter: int) -> Sealer:
        key = keys_of(1).downlink.key(DOWNLINK_KEY_ID, self.memory.epoch)
        return Sealer(key, DOWNLINK_KEY_ID, self.boot_id, counter, self.memory.epoch)

    def station(self, number: int, **settings) -> Session:
        session = self.stations[number] = Session(keys_of(number), number, **settings)
        self.news[number] = []
        return session

    @property
    def now_ns(self) -> int:
        return self.bench.now_ns

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            self.step()

    def until(self, condition, limit_s: float = 20.0) -> None:
        for _ in range(round(limit_s * 100)):
            if condition():
                return
            self.step()
        raise AssertionError(f"not within {limit_s} s: {self.bench.events[-4:]}")

    def step(self) -> None:
        now_ns = self.now_ns
        for number, session in self.stations.items():
            for datagram in session.send(now_ns):
                self.sent_up.append((number, now_ns / S))
                if number not in self.deaf:
                    self.deliver(datagram)
        for save in self.bench.step().saves:
            if save.name == EPOCH:
                saved = self.memory.switch(int(save.data)).result()
                self.bench.saved = (*self.bench.saved, saved)
                self.gate.use(self.memory.epoch)
                self.sealer = self._sealer(self.sealer.counter)
        for kind, payload in self.bench.outputs.link_payloads:
            datagram = self.sealer.seal(kind, payload)
            self.wire.append(datagram)
            self.sent_down.append(self.now_ns / S)
            for number, session in self.stations.items():
                self.news[number] += session.receive(datagram, self.now_ns)[1]

    def deliver(self, datagram: bytes) -> None:
        self.on_board.append(datagram)
        for message in self.gate.receive(datagram, self.now_ns):
            self.bench.hear(message)

    # -- an operator -----------------------------------------------------------------------------------------------

    def ask(self, number: int, name: str, **arguments) -> int:
        return self.stations[number].request(name, arguments, self.now_ns)

    def outcome(self, number: int, request_id: int) -> tuple[str, str]:
        """Runs until a request has ended: its state and the rover's words."""
        request = self.stations[number].requester.requests[request_id]
        self.until(lambda: request.state.final)
        return request.state.name, request.report.text

    def does(self, number: int, name: str, **arguments) -> tuple[str, str]:
        return self.outcome(number, self.ask(number, name, **arguments))

    def told(self, number: int, name: str) -> list[str]:
        return [one.text for one in self.news[number] if isinstance(one, EventHeard) and one.name == name]

    def reports(self, number: int) -> list:
        return [one.report for one in self.news[number] if isinstance(one, ReportHeard)]

    def lease(self, number: int) -> int:
        """Who holds it, as a station sees it."""
        return int(self.stations[number].items["lease_station"].value)
