"""The datagram of the space link: frame, authentication, replay window.

    0      1       2      3      4          12         16                 n-16      n
    +------+-------+------+------+----------+----------+------ ... ------+---------+
    | kind | key id| epoch| flags| counter  | boot id  |     payload      | tag 16 B|   little-endian
    +------+-------+------+------+----------+----------+------ ... ------+---------+
                                      tag = HMAC-SHA-256(epoch key, all before it), first 16 B

Rule 1: checks run in the order length, tag (constant time), epoch, boot id, counter window. No state changes before all
        checks have passed, so a forged datagram cannot lock out the genuine sender.
Rule 2: each direction has its own keys and the direction enters the key derivation: a datagram sealed for one direction
        never opens in the other, even if both were given the same secret.
Rule 3: the rover opens only datagrams with its present boot id, so its window may start empty at each boot. The ground
        follows the newest boot id it has received and starts a new window with it.
Rule 4: a telecommand that halts the rover (commands.halts) may carry the flag HALT. It is valid with any boot id and in
        any loaded epoch, and has a counter of its own that only rises. The receiver stores the highest counter
        (`marks`) on disk before it executes anything, so a stop sent while the rover reboots stops it, once.
Rule 5: one epoch is in force, and the rover decides which. The ground follows to any later epoch that is loaded, never
        to an earlier one. A datagram sealed in another epoch is refused.
Rule 6: networks duplicate datagrams. A bit-identical copy of one of the newest 256 datagrams accepted since the start
        is refused as `copy`, up to three times, without an alarm. Further copies, older ones and ones from before a
        restart are refused as `replay`.
"""

from __future__ import annotations

import hmac
import struct
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import NamedTuple

from protocol import WireError
from protocol.link.keyring import DOWNLINK_KEY_ID as DOWNLINK_KEY_ID
from protocol.link.keyring import KEY_DOWN as KEY_DOWN
from protocol.link.keyring import KEY_UP as KEY_UP
from protocol.link.keyring import Keyring as Keyring
from protocol.link.keyring import LinkKeys as LinkKeys
from protocol.link.keyring import bench_keys as bench_keys
from protocol.link.keyring import format_keys as format_keys
from protocol.link.keyring import hkdf as hkdf
from protocol.link.keyring import parse_keys as parse_keys
from protocol.tables import commands

MAX_DATAGRAM = 1150
MIN_LIMIT = 200
UDP_IP_BYTES = 28
TAG_BYTES = 16
MAX_JUMP = 1 << 20
WINDOW = 4096  # counters of a key that may arrive late
RECENT, COPIES = 256, 3  # accepted datagrams whose copies are distinguished from replays, and copies of each
COPY = "copy"
HALT = 1  # the flag of rule 4; no other is used
_HEAD = struct.Struct("<BBBBQI")
OVERHEAD = _HEAD.size + TAG_BYTES


class DatagramKind(IntEnum):
    """First byte of a datagram. REPORT goes down as a command report, up as an acknowledgement of events."""

    MAVLINK = 1
    BULK_CHUNK = 2
    BULK_BITMAP = 3
    TELECOMMAND = 4
    REPORT = 5


def numbers(datagram: bytes) -> tuple[int, int]:
    """Read counter and boot id of a datagram without checks. Raises ValueError if it is too short."""
    if len(datagram) < OVERHEAD:
        raise ValueError(f"{len(datagram)} B")
    *_, counter, boot_id = _HEAD.unpack_from(datagram)
    return counter, boot_id


def datagram_limit(rate_bps: float) -> int:
    """Longest datagram on a line, bytes: 0.1 s of its rate, at least 200, at most 1150."""
    return int(min(MAX_DATAGRAM, max(MIN_LIMIT, 0.1 * rate_bps / 8)))


def payload_limit(rate_bps: float) -> int:
    """Longest payload in bytes of one datagram on a line."""
    return datagram_limit(rate_bps) - OVERHEAD


def line_bytes(payload_bytes: int) -> int:
    """Bytes on the line for a payload: frame, tag, UDP and IP included."""
    return payload_bytes + OVERHEAD + UDP_IP_BYTES


class Sealer:
    """Encoder of datagrams: payloads in, sealed datagrams out.

    key: Keyring.key(key_id, epoch).
    boot_id: boot id to seal with; may be changed: the ground sets it to the received Opener.boot_id.
    counter: first counter to use. A sender that outlives a boot (the ground) reserves counters in blocks on disk.
    next_halt: returns the counters of rule 4, each once and rising.
    """

    def __init__(self, key: bytes, key_id: int, boot_id: int, counter: int = 0, epoch: int = 0) -> None:
        self._key, self._key_id, self.epoch = key, key_id, epoch
        self.boot_id, self.counter = boot_id, counter
        self._halts = -1
        self.next_halt: Callable[[], int] = self._count_halt

    def use(self, key: bytes, epoch: int) -> None:
        """Switch to another epoch; the counter continues."""
        self._key, self.epoch = key, epoch

    def seal(self, kind: int, payload: bytes) -> bytes:
        """Seal a payload. Raises ValueError if the datagram is longer than MAX_DATAGRAM."""
        datagram = self._sealed(kind, 0, self.counter, payload)
        self.counter += 1
        return datagram

    def seal_halt(self, payload: bytes) -> bytes:
        """Seal a datagram of rule 4. Raises ValueError if the payload is not a telecommand that halts."""
        if not commands.halts(payload):
            raise ValueError("only a telecommand that halts the rover may be sealed so")
        return self._sealed(DatagramKind.TELECOMMAND, HALT, self.next_halt(), payload)

    def _count_halt(self) -> int:
        self._halts += 1
        return self._halts

    def _sealed(self, kind: int, flags: int, counter: int, payload: bytes) -> bytes:
        if len(payload) + OVERHEAD > MAX_DATAGRAM:
            raise ValueError(f"payload of {len(payload)} B, at most {MAX_DATAGRAM - OVERHEAD} fit a datagram")
        body = _HEAD.pack(kind, self._key_id, self.epoch, flags, counter, self.boot_id) + payload
        return body + hmac.digest(self._key, body, "sha256")[:TAG_BYTES]


class CheckedDatagram(NamedTuple):
    """A datagram that passed all checks.

    kind: kind of the payload.
    station: key id of the sender.
    counter: counter of the sender; of rule 4 if `halt` is set.
    boot_id: boot id in the datagram.
    payload: the payload.
    halt: True if the datagram was accepted by rule 4.
    """

    kind: DatagramKind
    station: int
    counter: int
    boot_id: int
    payload: bytes
    halt: bool = False


def unsealed(keys: Keyring, datagram: bytes) -> bytes:
    """Return the payload of a datagram that was opened before and stored: checks only length and tag.

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
    """Replay window of one sender in one boot; bit n of `seen` is counter highest - n."""

    __slots__ = ("highest", "seen")

    def __init__(self, highest: int, seen: int = 0) -> None:
        self.highest, self.seen = highest, seen


class Opener:
    """Decoder of datagrams: datagrams in, checked payloads out. A datagram that fails a check changes no state.

    boot_id: of the rover, which opens only datagrams with its own; None on the ground, which follows the newest one.
    newest_boot_id: starting value on the ground; stored across restarts, it prevents replays from an earlier boot.
    epoch: epoch in force at the start, default the first that is loaded.
    marks: highest counter of rule 4 of each key id.
    """

    def __init__(
        self,
        keys: Keyring,
        window: int = WINDOW,
        *,
        boot_id: int | None = None,
        newest_boot_id: int = 0,
        epoch: int | None = None,
        marks: Mapping[int, int] | None = None,
    ) -> None:
        self._keys, self._size, self._mask = keys, window, (1 << window) - 1
        self._fixed = boot_id is not None
        self.boot_id = newest_boot_id if boot_id is None else boot_id
        self.epoch = keys.epochs[0] if epoch is None else epoch
        self.marks = dict(marks or {})
        self._windows: dict[int, _Window] = {}
        self._recent: dict[bytes, int] = {}  # tag -> copies refused, the oldest first

    def open(self, datagram: bytes) -> CheckedDatagram:
        """Check and open a datagram. Raises WireError: length, tag, epoch, boot, copy, replay, jump or kind."""
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

    def _open(self, datagram: bytes) -> CheckedDatagram:
        payload = unsealed(self._keys, datagram)
        kind, key_id, epoch, flags, counter, boot_id = _HEAD.unpack_from(datagram)
        if flags == HALT and self._fixed:
            return self._open_halt(
                CheckedDatagram(DatagramKind.TELECOMMAND, key_id, counter, boot_id, payload, True), epoch
            )
        if epoch not in self._keys.epochs or epoch < self.epoch or (self._fixed and epoch != self.epoch):
            raise WireError("epoch", f"{epoch}, in force {self.epoch}, loaded {self._keys.epochs}")
        if boot_id < self.boot_id or (self._fixed and boot_id != self.boot_id):
            raise WireError("boot", f"boot id {boot_id}, present {self.boot_id}")
        if flags or not DatagramKind.MAVLINK <= kind <= DatagramKind.REPORT:
            raise WireError("kind", f"kind {kind}, flags {flags}")
        fresh = boot_id != self.boot_id
        self._count({} if fresh else self._windows, key_id, counter)
        if fresh:
            self.boot_id, self._windows = boot_id, {key_id: _Window(counter, 1)}
        self.epoch = epoch
        return CheckedDatagram(DatagramKind(kind), key_id, counter, boot_id, payload)

    def _open_halt(self, opened: CheckedDatagram, epoch: int) -> CheckedDatagram:
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
        """Highest counter opened from a sender in this boot; -1 before the first."""
        window = self._windows.get(key_id)
        return -1 if window is None else window.highest

    def heard_before(self, key_id: int, counter: int) -> None:
        """Restore the window after a restart of this side: counters of the sender up to this one are refused."""
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
