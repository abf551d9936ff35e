"""Carrier B: datagrams of the link as plain UDP datagrams, and by whom the rover is heard. Sans-I/O.

There is no session: a datagram of `protocol.link` proves itself, so the rover takes it from any address. Where its own
go it must be asked for, by somebody who has a key and is at the address that he sends from:

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
        rover's downlink key. What a viewer has opens no place of a station.
Rule 2: without a key there is no answer, no state and no place. An answer is as long as its question.
Rule 3: each station has places of its own, viewers share theirs; where all are taken the one not heard for
        longest goes.
Rule 4: what is no word of this table with the right tag is a datagram of the link, and is checked and counted there.
Rule 5: one HELLO (key id and nonce) is answered 3 times, and 20 CHALLENGEs a second go to the senders of one key id.
Rule 6: each HELLO and BYE has a higher nonce than the one before. With a good cookie one that is no higher than the
        address's last one is ignored, also for 4 minutes after its BYE; so is an answer no higher than the last one.
"""

from __future__ import annotations

import hmac
import struct
from collections import OrderedDict
from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple

from protocol.keyring import DOWNLINK_KEY_ID, LinkKeys
from protocol.link import MAX_DATAGRAM

_S = 1_000_000_000
LEASE_NS = 90 * _S  # outlives a blackout of 60 s
HELLO_NS, SILENT_NS = 5 * _S, 15 * _S
_EAGER_NS, _AGAIN_NS = _S // 2, 2 * _S  # at most before the first answer; where answers have stopped
_COOKIE_NS = 120 * _S  # good in its two minutes and the next two: outlives a blackout of 60 s at 8 s one way
_NONCES = 1024  # an answer may be to one of so many hellos ago; of so many the rover knows that it has answered
ANSWERS, CHALLENGES_PER_S = 3, 20
STATION_PLACES, VIEWER_PLACES = 8, 16
QUIET_NS = 30 * _S  # an address silent for so long goes once another one of its key is heard
COPY_STREAMS = 3  # copies beside the first one, by the downlink's rate
_FRAME = struct.Struct("<BBQ16s")
TAG_BYTES = 16
WORD_BYTES = _FRAME.size + TAG_BYTES
_NO_COOKIE = bytes(16)

Address = tuple[str, int]


class Word(IntEnum):
    """First byte of what stations and rover say to each other about carrier B itself."""

    HELLO = 0x80
    BYE = 0x81
    CHALLENGE = 0x82
    LISTENING = 0x83


class Rank(IntEnum):
    """Whose copies of a datagram come first."""

    NEWEST = 0  # of a station, its address that was heard last
    OTHER = 1
    VIEWER = 2


class Said(NamedTuple):
    """One word whose tag holds."""

    word: Word
    key_id: int
    nonce: int
    cookie: bytes


def opening_s(one_way_s: float) -> float:
    """How long to wait before nobody is there: four trips, and the time of many hellos where some are lost."""
    return 8 * one_way_s + 5.0


def eager_ns(one_way_s: float) -> int:
    """Between two hellos, and two copies of a stop, before the first answer: often, for a flood lets few through.

    On a long way less often, for that line is slow.
    """
    return min(max(_S // 20, round(one_way_s * _S / 2)), _EAGER_NS)


def hello_key(keys: LinkKeys, key_id: int) -> bytes | None:
    """The key of a sender's words; None where it is unknown."""
    ring = keys.downlink if key_id == DOWNLINK_KEY_ID else keys.command
    return ring.hello_key(key_id)


def frame(said: Said, key: bytes) -> bytes:
    """The datagram of a word."""
    body = _FRAME.pack(said.word, said.key_id, said.nonce, said.cookie)
    return body + hmac.digest(key, body, "sha256")[:TAG_BYTES]


def parse(datagram: bytes, keys: LinkKeys) -> Said | None:
    """The word in a datagram; None: it is none, or its tag is wrong."""
    if len(datagram) != WORD_BYTES or not Word.HELLO <= datagram[0] <= Word.LISTENING:
        return None
    word, key_id, nonce, cookie = _FRAME.unpack_from(datagram)
    said, key = Said(Word(word), key_id, nonce, cookie), hello_key(keys, key_id)
    if key is None or not hmac.compare_digest(frame(said, key), datagram):
        return None
    return said


class Place(NamedTuple):
    """When an address was heard last, and the number of that hello."""

    heard_ns: int
    nonce: int


class Listeners:
    """The rover's side: addresses that its datagrams go to, by key id. secret: 16 random bytes of this process."""

    def __init__(self, keys: LinkKeys, secret: bytes) -> None:
        self._keys, self._secret = keys, secret
        self._places: dict[int, dict[Address, Place]] = {}  # by key id; the one heard longest ago first
        self._left: OrderedDict[tuple[int, Address], Place] = OrderedDict()  # who had one
        self._answers: OrderedDict[tuple[int, int], int] = OrderedDict()  # to key id and nonce
        self._challenges: dict[int, tuple[int, int]] = {}  # by key id: in which second, how many

    def receive(self, datagram: bytes, sender: Address, now_ns: int) -> tuple[bool, bytes | None]:
        """Whether a datagram was a word, and what to answer."""
        said = parse(datagram, self._keys)
        if said is None or said.word not in (Word.HELLO, Word.BYE):
            return False, None
        proven = said.cookie in (self._cookie(sender, now_ns), self._cookie(sender, now_ns - _COOKIE_NS))
        if proven and said.nonce <= self._last_nonce(said.key_id, sender, now_ns):
            return True, None
        if said.word is Word.BYE:
            if proven:
                self._admit(said, sender, now_ns)  # its number counts too
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
        """Rule 5."""
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
        places[sender] = Place(now_ns, said.nonce)
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
        """Where datagrams go now, and how much that matters."""
        ranks: dict[Address, Rank] = {}
        for key_id, places in self._places.items():
            self._expire(key_id, now_ns - LEASE_NS)
            for number, address in enumerate(reversed(places)):
                rank = Rank.VIEWER if key_id == DOWNLINK_KEY_ID else Rank.OTHER if number else Rank.NEWEST
                ranks[address] = min(rank, ranks.get(address, rank))
        return ranks

    def addresses(self, now_ns: int) -> list[Address]:
        """Where datagrams go now, each address once."""
        return list(self.ranks(now_ns))


class Copies:
    """To whom a datagram goes. The first copy goes always, the others by a token bucket of their own.

    rate_bps: of the downlink. Viewers leave half of the bucket to stations. Listeners of a rank take turns.
    """

    def __init__(self, rate_bps: float) -> None:
        self._rate_Bps = COPY_STREAMS * rate_bps / 8
        self._level = self._full = max(self._rate_Bps, 4.0 * MAX_DATAGRAM)  # a second of it
        self._at_ns: int | None = None
        self._turn = 0

    def of(self, ranks: Mapping[Address, Rank], size: int, now_ns: int) -> list[Address]:
        """Who gets this datagram of `size` bytes."""
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
    """A station's side: says hello until it is heard, and then keeps its place.

    first_nonce: 63 bit, higher than any that an earlier program of this station used, so made from the time.
    keys: without a key of this station a viewer, who asks by the downlink key.
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
        """Whether the rover has answered."""
        return self._answered_ns is not None

    def linked(self, now_ns: int) -> bool:
        """Whether the rover has answered within the lease."""
        return self._answered_ns is not None and now_ns - self._answered_ns <= LEASE_NS

    def send(self, now_ns: int) -> bytes | None:
        """A hello when it is time for one."""
        if self._next_ns is not None and now_ns < self._next_ns:
            return None
        silent = self._answered_ns is not None and now_ns - self._answered_ns > SILENT_NS
        wait_ns = _AGAIN_NS if silent else HELLO_NS if self._listening else self._eager_ns
        self._next_ns = now_ns + wait_ns
        self._nonce += 1
        return self._frame(Word.HELLO)

    def bye(self) -> bytes | None:
        """What to send at the end; None: there is no place to give up."""
        if not self._listening:
            return None
        self._nonce += 1
        return self._frame(Word.BYE)

    def receive(self, datagram: bytes, now_ns: int) -> bool:
        """Whether a datagram was a word."""
        said = parse(datagram, self._keys)
        if said is None or said.word not in (Word.CHALLENGE, Word.LISTENING) or said.key_id != self._key_id:
            return False
        if self._answered_nonce < said.nonce <= self._nonce and said.nonce > self._nonce - _NONCES:
            self._answered_ns, self._answered_nonce = now_ns, said.nonce
            self._listening = said.word is Word.LISTENING
            if said.cookie != self._cookie and not self._listening:
                self._next_ns = now_ns  # at once with this cookie
            self._cookie = said.cookie
        return True

    def _frame(self, word: Word) -> bytes:
        key = hello_key(self._keys, self._key_id)
        assert key is not None
        return frame(Said(word, self._key_id, self._nonce, self._cookie), key)
