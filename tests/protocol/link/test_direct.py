"""Places at the rover of carrier B, without sockets: who gets one, who keeps it, and what an answer tells."""

import pytest

from protocol.link import direct
from protocol.link.direct import Caller, Listeners, Said, Word, frame, hello_key
from protocol.link.keyring import KEY_UP, Keyring, LinkKeys, bench_keys

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


def test_a_cookie_is_good_for_its_address_and_two_to_four_minutes():
    table, caller = listeners(), Caller(KEYS, 1, 5)
    seat(table, caller, HERE)
    hello = caller.send(6 * S)
    assert hello is not None
    assert table.receive(hello, THERE, 6 * S)[1][0] == Word.CHALLENGE
    assert table.receive(hello, HERE, 239 * S)[1][0] == Word.LISTENING
    assert table.receive(hello, HERE, 240 * S)[1][0] == Word.CHALLENGE


def test_a_place_outlives_a_blackout_of_60_s_at_8_s_one_way():
    """The last answer was made before it; the next hello with its cookie arrives up to 21 s after its end."""
    for start_s in range(0, 120, 5):
        table, caller = listeners(), Caller(KEYS, 1, 5)
        seat(table, caller, HERE, start_s * S)
        later_ns = (start_s + 8 + 60 + 2 * 8 + 5) * S
        hello = caller.send(later_ns)
        assert hello is not None
        assert table.receive(hello, HERE, later_ns)[1][0] == Word.LISTENING and table.addresses(later_ns) == [HERE]


def test_one_hello_is_answered_three_times_whoever_repeats_it():
    table, hello = listeners(), Caller(KEYS, 1, 5).send(0)
    answers = [table.receive(hello, ("192.0.2.9", port), port * S) for port in range(50)]
    assert all(is_word for is_word, _ in answers)
    assert [answer is not None for _, answer in answers] == [True] * 3 + [False] * 47


def test_challenges_are_few_in_a_second_and_no_other_key_pays_for_them():
    table = listeners()
    hellos = [Caller(KEYS, 1, 10 * n).send(0) for n in range(3000)]  # more than are remembered
    answers = [table.receive(hello, ("192.0.2.9", 1), n) for _ in range(3) for n, hello in enumerate(hellos)]
    assert sum(answer is not None for _, answer in answers) == direct.CHALLENGES_PER_S
    seat(table, Caller(KEYS, 2, 5), HERE)
    seat(table, Caller(KEYS, 1, 5), HERE, 2 * S)


def test_many_recorded_hellos_keep_nobody_off_a_place_that_he_has():
    table, caller = listeners(), Caller(KEYS, 1, 5)
    seat(table, caller, HERE)
    for n in range(3000):
        table.receive(Caller(KEYS, 1, 10 * n).send(0), THERE, S)
    hello = caller.send(6 * S)
    assert hello is not None and table.receive(hello, HERE, 6 * S)[1][0] == Word.LISTENING


def test_answers_of_a_rover_that_has_died_do_not_keep_a_station_linked():
    caller, table, recorded = Caller(KEYS, 1, 5), listeners(), []
    for at_ns in (0, 1, 6 * S):
        hello = caller.send(at_ns)
        recorded.append(table.receive(hello, HERE, at_ns)[1])
        caller.receive(recorded[-1], at_ns)
    for at_s in range(7, 200):
        caller.send(at_s * S)
        for answer in recorded:
            assert caller.receive(answer, at_s * S)
    assert caller.linked(96 * S) and not caller.linked(97 * S)


def test_a_hello_that_was_recorded_seats_nobody_after_the_bye():
    table, caller = listeners(), Caller(KEYS, 1, 5)
    seat(table, caller, HERE)
    recorded = caller.send(6 * S)
    table.receive(recorded, HERE, 6 * S)
    table.receive(caller.bye(), HERE, 7 * S)
    for at_s in (7, 60, 126):
        assert table.receive(recorded, HERE, at_s * S) == (True, None) and table.addresses(at_s * S) == []
    seat(table, Caller(KEYS, 1, 50), HERE, 130 * S)  # a new program on that port: its numbers are higher


def test_a_hello_that_was_recorded_makes_no_place_last_longer():
    table, caller = listeners(), Caller(KEYS, 1, 5)
    seat(table, caller, HERE)
    recorded = caller.send(6 * S)
    table.receive(recorded, HERE, 6 * S)
    table.receive(recorded, HERE, 80 * S)
    assert table.addresses(96 * S) == [HERE] and table.addresses(97 * S) == []


def test_a_bye_that_was_recorded_unseats_no_later_program_on_the_same_port():
    table, caller = listeners(), Caller(KEYS, 1, 5)
    seat(table, caller, HERE)
    bye = caller.bye()
    table.receive(bye, HERE, 2)
    seat(table, Caller(KEYS, 1, 50), HERE, S)
    assert table.receive(bye, HERE, 2 * S) == (True, None) and table.addresses(2 * S) == [HERE]


def test_an_address_that_is_silent_goes_once_another_one_of_its_station_is_heard():
    table = listeners()
    seat(table, Caller(KEYS, 1, 5), HERE)
    seat(table, Caller(KEYS, 2, 5), ("192.0.2.3", 1))
    seat(table, Caller(KEYS, 1, 50), THERE, direct.QUIET_NS)
    assert len(table.addresses(direct.QUIET_NS)) == 3
    seat(table, Caller(KEYS, 1, 90), THERE, direct.QUIET_NS + S)
    assert set(table.addresses(direct.QUIET_NS + S)) == {THERE, ("192.0.2.3", 1)}


def test_a_place_ends_with_the_lease_and_with_a_bye_from_its_own_address():
    table, caller = listeners(), Caller(KEYS, 1, 5)
    seat(table, caller, HERE)
    assert table.addresses(direct.LEASE_NS + 1) == [HERE] and table.addresses(direct.LEASE_NS + 2) == []
    seat(table, caller := Caller(KEYS, 1, 50), HERE, direct.LEASE_NS + 3)
    bye = caller.bye()
    assert bye is not None
    later_ns = direct.LEASE_NS + 5
    assert table.receive(bye, THERE, later_ns) == (True, None) and table.addresses(later_ns) == [HERE]
    assert table.receive(bye, HERE, later_ns) == (True, None) and table.addresses(later_ns) == []


def test_viewers_share_places_of_their_own_and_take_none_of_a_station():
    table = listeners()
    seat(table, Caller(KEYS, 1, 5), HERE)
    for port in range(3 * direct.VIEWER_PLACES):
        seat(table, Caller(VIEWER, 1, 10 * port), (THERE[0], port), port * S // 10)
    assert table.addresses(5 * S).count(HERE) == 1
    assert len(table.addresses(5 * S)) == direct.VIEWER_PLACES + 1
    for port in range(3 * direct.STATION_PLACES):
        seat(table, Caller(KEYS, 2, 10 * port), (THERE[0], 9000 + port), (50 + port) * S // 10)
    assert HERE in table.addresses(9 * S)
    assert len(table.addresses(9 * S)) == direct.VIEWER_PLACES + 1 + direct.STATION_PLACES


def test_words_with_a_wrong_tag_an_unknown_key_or_of_the_other_direction_are_none():
    table, key = listeners(), hello_key(KEYS, 1)
    good = frame(Said(Word.HELLO, 1, 1, bytes(16)), key)
    for bit in range(8 * len(good)):
        bent = bytearray(good)
        bent[bit // 8] ^= 1 << bit % 8
        assert table.receive(bytes(bent), HERE, 0) == (False, None)
    for other in (
        good[:-1],
        good + b"\0",
        b"",
        frame(Said(Word.HELLO, 9, 1, bytes(16)), key),
        frame(Said(Word.HELLO, 0, 1, bytes(16)), key),
        frame(Said(Word.LISTENING, 1, 1, bytes(16)), key),
    ):
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


@pytest.mark.parametrize(("one_way_s", "hellos"), [(0.0, 20), (0.05, 20), (0.4, 5), (1.3, 2), (8.0, 2)])
def test_before_its_first_answer_a_station_says_hello_as_often_as_its_line_carries(one_way_s, hellos):
    caller = direct.Caller(KEYS, 1, 1 << 62, one_way_s)
    assert sum(caller.send(ms * 1_000_000) is not None for ms in range(1000)) == hellos
