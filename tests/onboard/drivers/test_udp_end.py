"""Ends of carrier B on the loopback: sockets, shares of a read, copies, and what happens when an address goes."""

import socket
from contextlib import ExitStack, suppress
from itertools import count

import pytest

from onboard.drivers.link.port import LinkPort
from protocol.link.datagrams import MAX_DATAGRAM
from protocol.link.direct import Caller
from protocol.link.keyring import KEY_UP, Keyring, LinkKeys, bench_keys
from transport.udp_end import UdpGroundEnd, UdpRoverEnd

KEYS = bench_keys(7)
VIEWER = LinkKeys(Keyring(KEY_UP, {}), KEYS.downlink)
S = 1_000_000_000
MOST_TURNS = 2000


class Carrier:
    """A rover's end and stations' ends on one clock, turned by the test."""

    def __init__(self, stack: ExitStack, rate_bps: float = 256e3, at: str = "127.0.0.1") -> None:
        self.stack, self.now_ns, self.nonces = stack, S, count(1 << 40, 1 << 20)
        self.rover = UdpRoverEnd(f"udp/{at}:0", KEYS, rate_bps)
        self.rover.clock_ns = lambda: self.now_ns
        stack.callback(self.rover.close)

    def end(self, station: int = 1, keys: LinkKeys = KEYS, rover: str = "127.0.0.1") -> UdpGroundEnd:
        """An end that listens, to the rover at this address of it."""
        made = UdpGroundEnd(f"udp/{rover}:{self.rover.port}", keys, station, 0.0, next(self.nonces))
        made.clock_ns = lambda: self.now_ns
        self.stack.callback(made.close)
        self.until(lambda: made._caller._listening and address(made)[:2] in self.rover._own, made)
        return made

    def until(self, condition, *ends: UdpGroundEnd) -> None:
        for _ in range(MOST_TURNS):
            if condition():
                return
            self.now_ns += S // 100
            for one in ends:
                one.knock()
            self.rover.take(16)
        raise AssertionError(f"not within {MOST_TURNS} turns")


def address(end: UdpGroundEnd) -> tuple[str, int]:
    return end._socket.getsockname()


@pytest.fixture
def carrier():
    with ExitStack() as stack:
        yield Carrier(stack)


def test_each_listener_has_a_socket_of_its_own_and_the_port_stays_the_rovers(carrier):
    for station in (1, 2, 3):
        carrier.end(station)
    assert len(carrier.rover._own) == 3
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with pytest.raises(OSError, match="in use"):
            stranger.bind(("127.0.0.1", carrier.rover.port))


def test_listeners_that_flood_take_no_share_of_a_station_or_of_somebody_without_a_place(carrier):
    viewers = [carrier.end(keys=VIEWER) for _ in range(3)]
    station, flooding = carrier.end(1), carrier.end(2)
    newcomer = carrier.stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    for each in (*viewers, flooding):
        for _ in range(600):
            each.put(b"flood")
    station.put(b"stop 1")
    newcomer.sendto(b"stop 2", ("127.0.0.1", carrier.rover.port))
    got = [datagram for _ in range(2) for datagram in carrier.rover.take(16)]
    assert {b"stop 1", b"stop 2"} <= set(got) and len(got) == 32


def test_a_take_does_no_more_work_than_it_was_given_and_says_whether_more_is_there(carrier):
    end = carrier.end()
    hello = end._caller.send(carrier.now_ns + 100 * S)
    for _ in range(40):
        end._send(hello)
        end.put(b"x")
    takes = []
    while not (takes and carrier.rover.emptied):
        takes.append(len(carrier.rover.take(16)))
    assert sum(takes) == 40 and max(takes[:5]) <= 8 and len(takes) >= 5


def test_hellos_between_datagrams_cut_no_read_short():
    with LinkPort("udp/127.0.0.1:0", KEYS, 1) as port, ExitStack() as stack:
        tap = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        tap.bind(("127.0.0.1", 0))
        tap.settimeout(20.0)
        end = UdpGroundEnd(f"udp/127.0.0.1:{tap.getsockname()[1]}", KEYS, 1, 0.0, 1 << 62)
        stack.callback(end.close)
        end.knock()
        hello = tap.recv(2000)
        port.clock_ns = lambda: 0  # time is no bound here
        for n in range(320):
            tap.sendto(hello if n % 16 == 0 else bytes(100), ("127.0.0.1", port._end.port))
        assert len(port.read(0)) == 300


def received(end: UdpGroundEnd) -> int:
    return sum(len(datagram) for datagram in end.take(10_000))


def test_copies_stay_within_their_bytes_and_a_station_comes_before_viewers():
    """10 s of a full downlink of 64 kbit/s: at most four times its bytes leave, and each station has them all."""
    with ExitStack() as stack:
        carrier = Carrier(stack, 64e3)
        viewers = [carrier.end(keys=VIEWER) for _ in range(10)]
        stations = [carrier.end(1), carrier.end(2)]
        for each in (*viewers, *stations):
            received(each)
        sent = 0
        for _ in range(200):
            carrier.now_ns += S // 20
            carrier.rover.put(bytes(400))
            sent += 400
        assert [received(each) for each in stations] == [sent, sent]
        seen = [received(each) for each in viewers]
        assert min(seen) > 0  # in turn
        assert sent < sum(seen) <= 2 * sent + 3 * 8000


def test_a_station_whose_own_address_goes_sends_from_another_one(carrier):
    end = carrier.end()
    before = address(end)
    end._socket.shutdown(socket.SHUT_WR)  # every send fails, as where the source address is gone
    end.put(b"lost")
    end.put(b"stop")
    assert address(end) != before
    got = []
    carrier.until(lambda: got.extend(carrier.rover.take(16)) or b"stop" in got)
    carrier.until(lambda: address(end) in carrier.rover._own, end)


def test_what_the_system_does_not_send_for_another_reason_costs_neither_end_its_socket(carrier):
    end = carrier.end()
    before, own = address(end), carrier.rover._own[address(end)]
    for each in (end, carrier.rover):
        each.put(bytes(70_000))  # EMSGSIZE
    assert address(end) == before and carrier.rover._own == {before: own}


def test_datagrams_that_wait_hold_up_no_hello(carrier):
    end = carrier.end()
    for _ in range(200):
        carrier.rover.put(b"beat")
    end.knock()
    end.knock()
    carrier.now_ns += 10 * S
    said = []
    end._send = said.append
    end.knock()
    assert len(said) == 1 and len(end.take(1000)) == 200


def test_a_name_is_resolved_anew_with_the_new_socket(carrier, monkeypatch):
    moved = carrier.stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    moved.bind(("127.0.0.2", 0))
    moved.settimeout(20.0)
    places = iter([("127.0.0.1", carrier.rover.port), moved.getsockname()])
    monkeypatch.setattr(
        "transport.udp_end.socket.getaddrinfo",
        lambda *_, **__: [(socket.AF_INET, socket.SOCK_DGRAM, 17, "", next(places))],
    )
    end = UdpGroundEnd("udp/rover.example:7450", KEYS, 1, 0.0, 1 << 62)
    carrier.stack.callback(end.close)
    end.put(b"before")
    end._socket.shutdown(socket.SHUT_WR)
    end.put(b"lost")
    end.put(b"stop")
    assert moved.recv(100) in (b"lost", b"stop")


def test_the_rovers_socket_for_a_listener_that_sends_no_more_gives_way_to_the_shared_one(carrier):
    end = carrier.end()
    received(end)
    carrier.rover._own[address(end)].shutdown(socket.SHUT_WR)
    carrier.rover.put(b"beat")
    assert received(end) == 4


def test_a_hello_that_reaches_the_shared_socket_of_a_listener_makes_its_own_anew():
    """As where the rover's address changed: the socket that is connected from the old one hears nothing any more."""
    with ExitStack() as stack:
        carrier = Carrier(stack)
        end = carrier.end()
        astray = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        astray.bind(("127.0.0.2", carrier.rover.port))
        astray.connect(address(end))
        astray.setblocking(False)
        carrier.rover._own[address(end)].close()
        carrier.rover._own[address(end)] = astray
        carrier.until(lambda: carrier.rover._own.get(address(end)) is not astray, end)
        assert carrier.rover._own[address(end)].getsockname() == ("127.0.0.1", carrier.rover.port)
        assert astray.fileno() == -1


@pytest.mark.parametrize("who", ["rover", "station"])
def test_a_port_that_was_closed_once_costs_no_datagram_of_those_after_it(carrier, who):
    """The system reports `port unreachable` at the next send, which then sends nothing."""
    end = carrier.end()
    sender, far = (carrier.rover, address(end)) if who == "rover" else (end, ("127.0.0.1", carrier.rover.port))
    if who == "rover":
        end._socket.close()
    else:
        carrier.rover.close()
    sender.put(b"nobody is there")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind(far)
        again.setblocking(False)
        sender.put(b"stop")
        got = []
        with suppress(BlockingIOError):
            got.append(again.recv(MAX_DATAGRAM))
        assert got == [b"stop"]


@pytest.mark.parametrize("own_sockets", [True, False])
def test_a_rover_with_several_addresses_answers_from_the_one_that_was_asked(own_sockets, monkeypatch):
    """A station's socket is connected, a firewall lets answers through: from another address neither hears it."""
    if not own_sockets:
        monkeypatch.setattr("transport.udp_end._SOCKETS", 0)
    with ExitStack() as stack:
        carrier = Carrier(stack, at="0.0.0.0")
        for rover in ("127.0.0.1", "127.0.0.2", "127.0.0.3"):
            asker = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            asker.bind(("127.0.0.1", 0))
            asker.setblocking(False)
            caller = Caller(KEYS, 1, next(carrier.nonces))
            for _ in range(2):  # CHALLENGE, LISTENING
                carrier.now_ns += S
                asker.sendto(caller.send(carrier.now_ns), (rover, carrier.rover.port))
                carrier.rover.take(16)
                answer, sender = asker.recvfrom(2000)
                assert caller.receive(answer, carrier.now_ns) and sender == (rover, carrier.rover.port)
            carrier.rover.put(b"beat")
            assert asker.recvfrom(2000) == (b"beat", (rover, carrier.rover.port))


def test_a_station_that_asks_another_address_of_the_rover_is_answered_from_there():
    with ExitStack() as stack:
        carrier = Carrier(stack, at="0.0.0.0")
        end = carrier.end(rover="127.0.0.2")
        end._rover = ("127.0.0.3", carrier.rover.port)
        end._socket.connect(end._rover)
        carrier.until(lambda: carrier.rover._own[address(end)].getsockname()[0] == "127.0.0.3", end)
        received(end)
        carrier.rover.put(b"beat")
        assert received(end) == 4


def test_a_rover_that_listens_on_every_ipv6_address_answers():
    with ExitStack() as stack:
        carrier = Carrier(stack, at="[::]")
        end = carrier.end(rover="[::1]")
        received(end)
        carrier.rover.put(b"beat")
        assert received(end) == 4
