"""The datagram of the space link: frame, authentication, replay window.

    0      1       2      3      4          12         16                 n-16      n
    +------+-------+------+------+----------+----------+------ ... ------+---------+
    | kind | key id| epoch| flags| counter  | boot id  |     payload      | tag 16 B|   little-endian
    +------+-------+------+------+----------+----------+------ ... ------+---------+
                                      tag = HMAC-SHA-256(epoch key, all before it), first 16 B

Rule 1: checks run in the order length, tag (constant time), epoch, boot id, counter window; no state changes before all
        have passed, so nothing forged can lock the genuine sender out.
Rule 2: each direction has keys of its own and the direction enters the derivation: what was sealed for one direction
        never opens in the other, even where somebody gave both the same secret.
Rule 3: the rover opens only what names its present boot id, so its window may start empty at each boot. The ground
        takes the newest boot id it has heard and starts a new window with it.
Rule 4: a telecommand that halts the rover (commands.halts) may carry the flag HALT: it counts with any boot id and in
        any loaded epoch, under a counter of its own that only rises. Who opens it keeps the highest one (`marks`) on
        disk before anything is done, so a stop sent while the rover reboots stops it, once.
Rule 5: one epoch is in force, and the rover says which; the ground follows to any later one that is loaded, and never
        back. What is sealed in another epoch is refused.
Rule 6: networks double datagrams. What is bit for bit one of the newest 256 that were accepted since the start is
        refused as `copy`, three times: no alarm. More often, of longer ago, of before a restart: `replay`.
"""

from __future__ import annotations

import hmac
import struct
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import NamedTuple

from protocol import WireError, commands
from protocol.keyring import DOWNLINK_KEY_ID as DOWNLINK_KEY_ID
from protocol.keyring import KEY_DOWN as KEY_DOWN
from protocol.keyring import KEY_UP as KEY_UP
from protocol.keyring import Keyring as Keyring
from protocol.keyring import LinkKeys as LinkKeys
from protocol.keyring import bench_keys as bench_keys
from protocol.keyring import format_keys as format_keys
from protocol.keyring import hkdf as hkdf
from protocol.keyring import parse_keys as parse_keys

MAX_DATAGRAM = 1150
MIN_LIMIT = 200
UDP_IP_BYTES = 28
TAG_BYTES = 16
MAX_JUMP = 1 << 20
WINDOW = 4096  # counters of a key that may come late
RECENT, COPIES = 256, 3  # accepted datagrams whose copies are told from replays, and how many of each
COPY = "copy"
HALT = 1  # the flag of rule 4; no other is used
_HEAD = struct.Struct("<BBBBQI")
OVERHEAD = _HEAD.size + TAG_BYTES


class Kind(IntEnum):
    """First byte of a datagram. REPORT goes down as a command report, up as an acknowledgement of events."""

    MAVLINK = 1
    BULK_CHUNK = 2
    BULK_BITMAP = 3
    TELECOMMAND = 4
    REPORT = 5


def numbers(datagram: bytes) -> tuple[int, int]:
    """Counter and boot id as a datagram has them, checked or not. Raises ValueError where it is too short."""
    if len(datagram) < OVERHEAD:
        raise ValueError(f"{len(datagram)} B")
    *_, counter, boot_id = _HEAD.unpack_from(datagram)
    return counter, boot_id


def datagram_limit(rate_bps: float) -> int:
    """Longest datagram in bytes on a line: 0.1 s of it, never under 200, never over 1150."""
    return int(min(MAX_DATAGRAM, max(MIN_LIMIT, 0.1 * rate_bps / 8)))


def payload_limit(rate_bps: float) -> int:
    """Longest payload in bytes of one datagram on a line."""
    return datagram_limit(rate_bps) - OVERHEAD


def line_bytes(payload_bytes: int) -> int:
    """What a payload costs on the line: frame, tag, UDP and IP included."""
    return payload_bytes + OVERHEAD + UDP_IP_BYTES


class Sealer:
    """Payloads in, datagrams out. `key` is Keyring.key(key_id, epoch); `counter` the first one to use.

    A sender that outlives a boot (the ground) keeps `counter` in blocks on disk, ahead of use. boot_id may be changed:
    the ground sets it to what Opener.boot_id heard. next_halt: gives the counters of rule 4, each once and rising.
    """

    def __init__(self, key: bytes, key_id: int, boot_id: int, counter: int = 0, epoch: int = 0) -> None:
        self._key, self._key_id, self.epoch = key, key_id, epoch
        self.boot_id, self.counter = boot_id, counter
        self._halts = -1
        self.next_halt: Callable[[], int] = self._count_halt

    def use(self, key: bytes, epoch: int) -> None:
        """From now on in this epoch; the counter goes on."""
        self._key, self.epoch = key, epoch

    def seal(self, kind: int, payload: bytes) -> bytes:
        """One datagram. Raises ValueError where it would be longer than MAX_DATAGRAM."""
        datagram = self._sealed(kind, 0, self.counter, payload)
        self.counter += 1
        return datagram

    def seal_halt(self, payload: bytes) -> bytes:
        """One datagram of rule 4. Raises ValueError for what is no telecommand that halts."""
        if not commands.halts(payload):
            raise ValueError("only a telecommand that halts the rover may be sealed so")
        return self._sealed(Kind.TELECOMMAND, HALT, self.next_halt(), payload)

    def _count_halt(self) -> int:
        self._halts += 1
        return self._halts

    def _sealed(self, kind: int, flags: int, counter: int, payload: bytes) -> bytes:
        if len(payload) + OVERHEAD > MAX_DATAGRAM:
            raise ValueError(f"payload of {len(payload)} B, at most {MAX_DATAGRAM - OVERHEAD} fit a datagram")
        body = _HEAD.pack(kind, self._key_id, self.epoch, flags, counter, self.boot_id) + payload
        return body + hmac.digest(self._key, body, "sha256")[:TAG_BYTES]


class Opened(NamedTuple):
    """A datagram all of whose checks passed. station: its key id. halt: it came by rule 4, its counter is of that."""

    kind: Kind
    station: int
    counter: int
    boot_id: int
    payload: bytes
    halt: bool = False


def unsealed(keys: Keyring, datagram: bytes) -> bytes:
    """The payload of a datagram that was opened once and kept: that it is whole and of one of these keys, no more.

    Raises WireError of kind length or tag.
    """
    if not OVERHEAD <= len(datagram) <= MAX_DATAGRAM:
        raise WireError("length", f"{len(datagram)} B")
    _, key_id, epoch, *_ = _HEAD.unpack_from(datagram)
    key = keys.key(key_id, epoch)
    if key is None:
        raise WireError("tag", f"no key {key_id}")
    body = datagram[:-TAG_BYTES]
    if not hmac.compare_digest(hmac.digest(key, body, "sha256")[:TAG_BYTES], datagram[-TAG_BYTES:]):
        raise WireError("tag")
    return body[_HEAD.size :]


class _Window:
    """Counters seen of one sender in one boot; bit n of `seen` is counter highest - n."""

    __slots__ = ("highest", "seen")

    def __init__(self, highest: int, seen: int = 0) -> None:
        self.highest, self.seen = highest, seen


class Opener:
    """Datagrams in, checked payloads out; nothing that fails a check changes anything.

    boot_id: the rover gives its own, and only that is opened. The ground gives none: the newest heard counts
    (`newest_boot_id` may be kept over a restart, so that nothing of an earlier boot can be replayed to it).
    epoch: in force at the start, default the first that is loaded. marks: highest counter of rule 4 of each key id.
    """

    def __init__(
        self, keys: Keyring, window: int = WINDOW, *, boot_id: int | None = None, newest_boot_id: int = 0,
        epoch: int | None = None, marks: Mapping[int, int] | None = None,
    ) -> None:  # fmt: skip
        self._keys, self._size, self._mask = keys, window, (1 << window) - 1
        self._fixed = boot_id is not None
        self.boot_id = newest_boot_id if boot_id is None else boot_id
        self.epoch = keys.epochs[0] if epoch is None else epoch
        self.marks = dict(marks or {})
        self._windows: dict[int, _Window] = {}
        self._recent: dict[bytes, int] = {}  # tag -> copies refused, the oldest first

    def open(self, datagram: bytes) -> Opened:
        """The payload and who sent it. Raises WireError: length, tag, epoch, boot, copy, replay, jump or kind."""
        try:
            opened = self._open(datagram)
        except WireError as error:
            copies = self._recent.get(datagram[-TAG_BYTES:], COPIES)
            if error.kind != "replay" or copies >= COPIES:
                raise
            self._recent[datagram[-TAG_BYTES:]] = copies + 1
            raise WireError(COPY, str(error)) from error
        self._recent[datagram[-TAG_BYTES:]] = 0
        if len(self._recent) > RECENT:
            del self._recent[next(iter(self._recent))]
        return opened

    def _open(self, datagram: bytes) -> Opened:
        payload = unsealed(self._keys, datagram)
        kind, key_id, epoch, flags, counter, boot_id = _HEAD.unpack_from(datagram)
        if flags == HALT and self._fixed:
            return self._open_halt(Opened(Kind.TELECOMMAND, key_id, counter, boot_id, payload, True), epoch)
        if epoch not in self._keys.epochs or epoch < self.epoch or (self._fixed and epoch != self.epoch):
            raise WireError("epoch", f"{epoch}, in force {self.epoch}, loaded {self._keys.epochs}")
        if boot_id < self.boot_id or (self._fixed and boot_id != self.boot_id):
            raise WireError("boot", f"boot id {boot_id}, present {self.boot_id}")
        if flags or not Kind.MAVLINK <= kind <= Kind.REPORT:
            raise WireError("kind", f"kind {kind}, flags {flags}")
        fresh = boot_id != self.boot_id
        self._count({} if fresh else self._windows, key_id, counter)
        if fresh:
            self.boot_id, self._windows = boot_id, {key_id: _Window(counter, 1)}
        self.epoch = epoch
        return Opened(Kind(kind), key_id, counter, boot_id, payload)

    def _open_halt(self, opened: Opened, epoch: int) -> Opened:
        if epoch not in self._keys.epochs:
            raise WireError("epoch", f"{epoch}, loaded {self._keys.epochs}")
        if not commands.halts(opened.payload):
            raise WireError("kind", "the flag HALT on what does not halt")
        mark = self.marks.get(opened.station)
        if mark is not None and opened.counter <= mark:
            raise WireError("replay", f"halt {opened.counter}, mark {mark}")
        if mark is not None and opened.counter - mark > MAX_JUMP:
            raise WireError("jump", f"halt {opened.counter} after {mark}")
        self.marks[opened.station] = opened.counter
        return opened

    def highest(self, key_id: int) -> int:
        """Highest counter opened of a sender in this boot; -1 before the first."""
        window = self._windows.get(key_id)
        return -1 if window is None else window.highest

    def heard_before(self, key_id: int, counter: int) -> None:
        """What was heard before a restart of this side: up to this counter nothing of the sender opens any more."""
        self._windows[key_id] = _Window(counter, self._mask)

    def _count(self, windows: dict[int, _Window], key_id: int, counter: int) -> None:
        window = windows.get(key_id)
        if window is None:
            window = windows[key_id] = _Window(counter)
        ahead = counter - window.highest
        if ahead > MAX_JUMP:
            raise WireError("jump", f"counter {counter} after {window.highest}")
        if ahead > 0:
            window.seen = ((window.seen << ahead) | 1) & self._mask if ahead < self._size else 1
            window.highest = counter
            return
        bit = 1 << -ahead if -ahead < self._size else 0
        if not bit or window.seen & bit:
            raise WireError("replay", f"counter {counter}")
        window.seen |= bit
