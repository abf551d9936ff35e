"""Places at the rover of carrier B, without sockets: who gets one, who keeps it, and what an answer tells."""

import pytest

from protocol import direct
from protocol.direct import Caller, Listeners, Said, Word, frame, hello_key
from protocol.keyring import KEY_UP, Keyring, LinkKeys, bench_keys

S = 1_000_000_000
KEYS = bench_keys(7)
VIEWER = LinkKeys(Keyring(KEY_UP, {}), KEYS.downlink)
HERE, THERE = ("192.0.2.1", 5000), ("192.0.2.2", 5000)


def listeners() -> Listeners:
    return Listeners(KEYS, b"s" * 16)


def seat(table: Listeners, caller: Caller, address: direct.Address, now_ns: int = 0) -> None:
    """Hello, challenge, hello, listening."""
    for at_ns in (now_ns, now_ns + 1):
        hello = caller.send(at_ns)
        assert hello is not None
        is_word, answer = table.receive(hello, address, at_ns)
        assert is_word and answer is not None and len(answer) == len(hello) == direct.WORD_BYTES
        assert caller.receive(answer, at_ns)


def test_a_first_hello_opens_the_station_and_the_second_gives_the_place():
    table, caller = listeners(), Caller(KEYS, 1, 5)
    hello = caller.send(0)
    assert hello is not None and caller.send(S // 2 - 1) is None
    _, answer = table.receive(hello, HERE, 0)
    assert answer is not None and answer[0] == Word.CHALLENGE and table.addresses(0) == []
    assert caller.receive(answer, 1) and caller.open and caller.bye() is None
    hello = caller.send(1)
    assert hello is not None
    _, answer = table.receive(hello, HERE, 1)
    assert answer is not None and answer[0] == Word.LISTENING and table.addresses(1) == [HERE]


def test_a_cookie_is_good_for_its_address_and_two_minutes():
    table, caller = listeners(), Caller(KEYS, 1, 5)
    seat(table, caller, HERE)
    hello = caller.send(6 * S)
    assert hello is not None
    assert table.receive(hello, THERE, 6 * S)[1][0] == Word.CHALLENGE
    assert table.receive(hello, HERE, 119 * S)[1][0] == Word.LISTENING
    assert table.receive(hello, HERE, 120 * S)[1][0] == Word.CHALLENGE


def test_a_place_ends_with_the_lease_and_with_a_bye_from_its_own_address():
    table, caller = listeners(), Caller(KEYS, 1, 5)
    seat(table, caller, HERE)
    assert table.addresses(direct.LEASE_NS + 1) == [HERE] and table.addresses(direct.LEASE_NS + 2) == []
    seat(table, Caller(KEYS, 1, 5), HERE)
    bye = caller.bye()
    assert bye is not None
    assert table.receive(bye, THERE, 2) == (True, None) and table.addresses(2) == [HERE]
    assert table.receive(bye, HERE, 2) == (True, None) and table.addresses(2) == []


def test_viewers_share_places_of_their_own_and_take_none_of_a_station():
    table = listeners()
    seat(table, Caller(KEYS, 1, 5), HERE)
    for port in range(3 * direct.VIEWER_PLACES):
        seat(table, Caller(VIEWER, 1, 5), (THERE[0], port), port)
    assert table.addresses(100).count(HERE) == 1
    assert len(table.addresses(100)) == direct.VIEWER_PLACES + 1
    for port in range(3 * direct.STATION_PLACES):
        seat(table, Caller(KEYS, 2, 5), (THERE[0], 9000 + port), 100 + port)
    assert HERE in table.addresses(200)
    assert len(table.addresses(200)) == direct.VIEWER_PLACES + 1 + direct.STATION_PLACES


def test_words_with_a_wrong_tag_an_unknown_key_or_of_the_other_direction_are_none():
    table, key = listeners(), hello_key(KEYS, 1)
    good = frame(Said(Word.HELLO, 1, 1, bytes(16)), key)
    for bit in range(8 * len(good)):
        bent = bytearray(good)
        bent[bit // 8] ^= 1 << bit % 8
        assert table.receive(bytes(bent), HERE, 0) == (False, None)
    for other in (good[:-1], good + b"\0", b"", frame(Said(Word.HELLO, 9, 1, bytes(16)), key),
                  frame(Said(Word.HELLO, 0, 1, bytes(16)), key), frame(Said(Word.LISTENING, 1, 1, bytes(16)), key)):
        assert table.receive(other, HERE, 0) == (False, None)
    assert table.receive(good, HERE, 0)[0]
    assert not Caller(KEYS, 1, 5).receive(good, 0)


def test_an_answer_to_nothing_that_was_asked_opens_nothing():
    caller, key = Caller(KEYS, 1, 5), hello_key(KEYS, 1)
    caller.send(0)
    for nonce in (0, 5, 7):
        assert caller.receive(frame(Said(Word.LISTENING, 1, nonce, bytes(16)), key), 0) and not caller.open
    assert caller.receive(frame(Said(Word.LISTENING, 1, 6, bytes(16)), key), 0) and caller.open


@pytest.mark.parametrize(("listens", "since_ns", "wait_s"), [
    (False, 10 * S, 0.5), (True, 10 * S, 5.0), (True, direct.SILENT_NS, 5.0), (True, direct.SILENT_NS + 1, 2.0),
])  # fmt: skip
def test_hellos_are_frequent_until_the_place_is_there_and_after_answers_have_stopped(listens, since_ns, wait_s):
    caller, start_ns = Caller(KEYS, 1, 5), 100 * S
    if listens:
        seat(listeners(), caller, HERE, start_ns)
    now_ns = start_ns + 1 + since_ns
    assert caller.send(now_ns) is not None
    assert caller.send(now_ns + round(wait_s * S) - 1) is None
    assert caller.send(now_ns + round(wait_s * S)) is not None


@pytest.mark.parametrize(("ago", "opens"), [(1023, True), (1024, False)])
def test_an_answer_to_one_of_the_newest_1024_hellos_counts(ago, opens):
    caller, key = Caller(KEYS, 1, 5), hello_key(KEYS, 1)
    for n in range(2000):
        caller.send(n * S)
    caller.receive(frame(Said(Word.LISTENING, 1, 2005 - ago, bytes(16)), key), 2000 * S)
    assert caller.open is opens


def test_nobody_is_there_after_eight_trips_and_five_seconds():
    assert direct.opening_s(1.3) == pytest.approx(15.4)


def test_a_station_is_linked_for_the_lease_after_an_answer():
    caller = Caller(KEYS, 1, 5)
    assert not caller.linked(0)
    seat(listeners(), caller, HERE)
    assert caller.linked(direct.LEASE_NS + 1) and not caller.linked(direct.LEASE_NS + 2)
