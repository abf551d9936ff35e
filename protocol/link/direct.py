"""Carrier B: link datagrams over plain UDP, and the registration of listeners at the rover. Sans-I/O.

There is no session. A datagram of `protocol.link.datagrams` is authenticated by its tag, so the rover accepts it from
any address. To receive the rover's datagrams, a sender must have a key and prove that it is at its source address:

    station                                    rover
      HELLO, cookie 0 ------------------------>  the tag holds: it has a key, and no place yet
      <------------- CHALLENGE, cookie           made from the address, the time and the rover's secret
      HELLO, cookie -------------------------->  tag and cookie hold: the address is a listener for 90 s
      <------------- LISTENING, cookie           again with each HELLO, every 5 s

    0      1        2           10           26          42
    +------+--------+-----------+------------+-----------+
    | word | key id | nonce 8 B | cookie 16 B| tag 16 B  |   little-endian; words 0x80 to 0x83, no Kind of the link
    +------+--------+-----------+------------+-----------+
                tag = HMAC-SHA-256(hello key of the key id, all before it), first 16 B

Rule 1: the hello key is derived from the secret of the key id: a station's command key, or with id 0, for a viewer, the
        rover's downlink key. A viewer's key cannot take a place of a station.
Rule 2: without a key there is no answer, no state and no place. An answer is as long as its question.
Rule 3: each station has places of its own, viewers share theirs. When all places are taken, the address that has been
        silent longest loses its place.
Rule 4: a datagram that is not a word of this table with the right tag is a datagram of the link; the link checks and
        counts it.
Rule 5: one HELLO (key id and nonce) is answered at most 3 times, and the senders of one key id get at most 20
        CHALLENGEs a second.
Rule 6: each HELLO and BYE has a higher nonce than the one before. The rover ignores a word with a valid cookie whose
        nonce is not above the last one of its address, also for 4 minutes after a BYE. A station ignores an answer
        whose nonce is not above that of the last answer.
"""

from __future__ import annotations

import hmac
import struct
from collections import OrderedDict
from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple

from protocol.link.datagrams import MAX_DATAGRAM
from protocol.link.keyring import DOWNLINK_KEY_ID, LinkKeys

_S = 1_000_000_000
LEASE_NS = 90 * _S  # outlives a blackout of 60 s
HELLO_NS, SILENT_NS = 5 * _S, 15 * _S
_EAGER_NS, _AGAIN_NS = _S // 2, 2 * _S  # longest interval before the first answer; interval after answers have stopped
_COOKIE_NS = 120 * _S  # valid in its own period and the next: outlives a blackout of 60 s at 8 s one way
_NONCES = 1024  # silence after which an address loses its place once another address of its key sends a hello
ANSWERS, CHALLENGES_PER_S = 3, 20
STATION_PLACES, VIEWER_PLACES = 8, 16
QUIET_NS = 30 * _S  # multiple of the downlink's rate for the copies besides the first one
COPY_STREAMS = 3  # copies besides the first one, as a multiple of the downlink's rate
_FRAME = struct.Struct("<BBQ16s")
TAG_BYTES = 16
WORD_BYTES = _FRAME.size + TAG_BYTES
_NO_COOKIE = bytes(16)

Address = tuple[str, int]


class Word(IntEnum):
    """First byte of the words that stations and rover exchange about carrier B itself."""

    HELLO = 0x80
    BYE = 0x81
    CHALLENGE = 0x82
    LISTENING = 0x83


class Rank(IntEnum):
    """Order in which listeners get copies of a datagram."""

    NEWEST = 0  # most recent address of a station
    OTHER = 1
    VIEWER = 2


class Said(NamedTuple):
    """One word whose tag was verified.

    word: the word.
    key_id: key id of the sender.
    nonce: number of the HELLO or BYE, also in its answer.
    cookie: 16 B; zeros if the sender has none.
    """

    word: Word
    key_id: int
    nonce: int
    cookie: bytes


def opening_s(one_way_s: float) -> float:
    """Time limit for the first answer, s: four round trips, plus time for many hellos if some are lost."""
    return 8 * one_way_s + 5.0


def eager_ns(one_way_s: float) -> int:
    """Interval between two hellos, or two copies of a stop, before the first answer, ns.

    Short, because a flood lets few datagrams through; longer on a long way, because that line is slow.
    """
    return min(max(_S // 20, round(one_way_s * _S / 2)), _EAGER_NS)


def hello_key(keys: LinkKeys, key_id: int) -> bytes | None:
    """Return the key of a sender's words; None if the key id is unknown."""
    ring = keys.downlink if key_id == DOWNLINK_KEY_ID else keys.command
    return ring.hello_key(key_id)


def frame(said: Said, key: bytes) -> bytes:
    """Encode a word as a datagram."""
    body = _FRAME.pack(said.word, said.key_id, said.nonce, said.cookie)
    return body + hmac.digest(key, body, "sha256")[:TAG_BYTES]


def parse(datagram: bytes, keys: LinkKeys) -> Said | None:
    """Decode the word in a datagram; None if it is not a word or its tag is wrong."""
    if len(datagram) != WORD_BYTES or not Word.HELLO <= datagram[0] <= Word.LISTENING:
        return None
    word, key_id, nonce, cookie = _FRAME.unpack_from(datagram)
    said, key = Said(Word(word), key_id, nonce, cookie), hello_key(keys, key_id)
    if key is None or not hmac.compare_digest(frame(said, key), datagram):
        return None
    return said


class ListenerAddress(NamedTuple):
    """Last hello of an address.

    heard_ns: time of its arrival.
    nonce: its nonce.
    """

    heard_ns: int
    nonce: int


class Listeners:
    """Rover's side: addresses that receive its datagrams, by key id. secret: 16 random bytes of this process."""

    def __init__(self, keys: LinkKeys, secret: bytes) -> None:
        self._keys, self._secret = keys, secret
        self._places: dict[int, dict[Address, ListenerAddress]] = {}  # by key id; the address silent longest first
        self._left: OrderedDict[tuple[int, Address], ListenerAddress] = OrderedDict()  # former listeners
        self._answers: OrderedDict[tuple[int, int], int] = OrderedDict()  # to key id and nonce
        self._challenges: dict[int, tuple[int, int]] = {}  # by key id: second, and challenges in it

    def receive(self, datagram: bytes, sender: Address, now_ns: int) -> tuple[bool, bytes | None]:
        """Process a datagram; return True if it was a word, and the answer to send."""
        said = parse(datagram, self._keys)
        if said is None or said.word not in (Word.HELLO, Word.BYE):
            return False, None
        proven = said.cookie in (self._cookie(sender, now_ns), self._cookie(sender, now_ns - _COOKIE_NS))
        if proven and said.nonce <= self._last_nonce(said.key_id, sender, now_ns):
            return True, None
        if said.word is Word.BYE:
            if proven:
                self._admit(said, sender, now_ns)  # the nonce of a BYE counts too
                self._leave(said.key_id, sender)
            return True, None
        if not self._answerable(said, proven, now_ns):
            return True, None
        if proven:
            self._admit(said, sender, now_ns)
        word = Word.LISTENING if proven else Word.CHALLENGE
        key = hello_key(self._keys, said.key_id)
        assert key is not None
        return True, frame(Said(word, said.key_id, said.nonce, self._cookie(sender, now_ns)), key)

    def _cookie(self, sender: Address, now_ns: int) -> bytes:
        text = f"{now_ns // _COOKIE_NS} {sender[0]} {sender[1]}".encode()
        return hmac.digest(self._secret, text, "sha256")[:16]

    def _last_nonce(self, key_id: int, sender: Address, now_ns: int) -> int:
        place = self._places.get(key_id, {}).get(sender) or self._left.get((key_id, sender))
        return place.nonce if place is not None and now_ns - place.heard_ns <= 2 * _COOKIE_NS else -1

    def _answerable(self, said: Said, proven: bool, now_ns: int) -> bool:
        """Count an answer; return False if rule 5 forbids it."""
        known = (said.key_id, said.nonce)
        count = self._answers.pop(known, 0)
        second, challenges = self._challenges.get(said.key_id, (-1, 0))
        challenges = challenges if second == now_ns // _S else 0
        good = count < ANSWERS and (proven or challenges < CHALLENGES_PER_S)
        if good and not proven:
            self._challenges[said.key_id] = now_ns // _S, challenges + 1
        self._answers[known] = count + good
        if len(self._answers) > _NONCES:
            self._answers.popitem(last=False)
        return good

    def _admit(self, said: Said, sender: Address, now_ns: int) -> None:
        places = self._places.setdefault(said.key_id, {})
        places.pop(sender, None)
        self._left.pop((said.key_id, sender), None)
        self._expire(said.key_id, now_ns - QUIET_NS)
        places[sender] = ListenerAddress(now_ns, said.nonce)
        if len(places) > (VIEWER_PLACES if said.key_id == DOWNLINK_KEY_ID else STATION_PLACES):
            self._leave(said.key_id, next(iter(places)))

    def _leave(self, key_id: int, address: Address) -> None:
        self._left[key_id, address] = self._places[key_id].pop(address)
        if len(self._left) > _NONCES:
            self._left.popitem(last=False)

    def _expire(self, key_id: int, before_ns: int) -> None:
        places = self._places[key_id]
        while places and places[oldest := next(iter(places))].heard_ns < before_ns:
            self._leave(key_id, oldest)

    def ranks(self, now_ns: int) -> dict[Address, Rank]:
        """Current listener addresses and their rank."""
        ranks: dict[Address, Rank] = {}
        for key_id, places in self._places.items():
            self._expire(key_id, now_ns - LEASE_NS)
            for number, address in enumerate(reversed(places)):
                rank = Rank.VIEWER if key_id == DOWNLINK_KEY_ID else Rank.OTHER if number else Rank.NEWEST
                ranks[address] = min(rank, ranks.get(address, rank))
        return ranks

    def addresses(self, now_ns: int) -> list[Address]:
        """Current listener addresses, each once."""
        return list(self.ranks(now_ns))


class Copies:
    """Selection of the listeners of a datagram. The first copy is always sent, further copies use a token bucket.

    rate_bps: rate of the downlink. Viewers leave half of the bucket to stations. Listeners of one rank take turns.
    """

    def __init__(self, rate_bps: float) -> None:
        self._rate_Bps = COPY_STREAMS * rate_bps / 8
        self._level = self._full = max(self._rate_Bps, 4.0 * MAX_DATAGRAM)  # one second of it
        self._at_ns: int | None = None
        self._turn = 0

    def of(self, ranks: Mapping[Address, Rank], size: int, now_ns: int) -> list[Address]:
        """Return the addresses that get this datagram of `size` bytes."""
        past_s = 0.0 if self._at_ns is None else max(0, now_ns - self._at_ns) / _S
        self._level, self._at_ns = min(self._full, self._level + past_s * self._rate_Bps), now_ns
        self._turn += 1
        goes: list[Address] = []
        for rank in Rank:
            group = [address for address, its in ranks.items() if its is rank]
            for number in range(len(group)):
                spare = self._full / 2 if rank is Rank.VIEWER else 0.0
                if goes and self._level - size < spare:
                    break
                self._level -= size if goes else 0
                goes.append(group[(number + self._turn) % len(group)])
        return goes


class Caller:
    """Station's side: sends hellos until the rover answers, then renews its place.

    first_nonce: 63 bit, higher than any that an earlier program of this station used, therefore derived from the time.
    keys: without a key of this station the caller is a viewer and uses the downlink key.
    """

    def __init__(self, keys: LinkKeys, station: int, first_nonce: int, one_way_s: float = 1.0) -> None:
        self._keys, self._eager_ns = keys, eager_ns(one_way_s)
        self._key_id = station if keys.command.hello_key(station) is not None else DOWNLINK_KEY_ID
        self._nonce = self._answered_nonce = first_nonce
        self._cookie = _NO_COOKIE
        self._next_ns: int | None = None
        self._answered_ns: int | None = None
        self._listening = False

    @property
    def open(self) -> bool:
        """True if the rover has answered."""
        return self._answered_ns is not None

    def linked(self, now_ns: int) -> bool:
        """True if the rover has answered within the lease."""
        return self._answered_ns is not None and now_ns - self._answered_ns <= LEASE_NS

    def send(self, now_ns: int) -> bytes | None:
        """Return a hello if one is due."""
        if self._next_ns is not None and now_ns < self._next_ns:
            return None
        silent = self._answered_ns is not None and now_ns - self._answered_ns > SILENT_NS
        wait_ns = _AGAIN_NS if silent else HELLO_NS if self._listening else self._eager_ns
        self._next_ns = now_ns + wait_ns
        self._nonce += 1
        return self._frame(Word.HELLO)

    def bye(self) -> bytes | None:
        """Return the BYE to send at the end; None if there is no place to give up."""
        if not self._listening:
            return None
        self._nonce += 1
        return self._frame(Word.BYE)

    def receive(self, datagram: bytes, now_ns: int) -> bool:
        """Process a datagram; return True if it was a word for this station."""
        said = parse(datagram, self._keys)
        if said is None or said.word not in (Word.CHALLENGE, Word.LISTENING) or said.key_id != self._key_id:
            return False
        if self._answered_nonce < said.nonce <= self._nonce and said.nonce > self._nonce - _NONCES:
            self._answered_ns, self._answered_nonce = now_ns, said.nonce
            self._listening = said.word is Word.LISTENING
            if said.cookie != self._cookie and not self._listening:
                self._next_ns = now_ns  # send the next hello at once, with this cookie
            self._cookie = said.cookie
        return True

    def _frame(self, word: Word) -> bytes:
        key = hello_key(self._keys, self._key_id)
        assert key is not None
        return frame(Said(word, self._key_id, self._nonce, self._cookie), key)
