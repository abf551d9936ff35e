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

Not here: stop and safe counting with any boot id under a counter of their own (design of the link, section 4) needs a
high-water mark on disk; the flag byte is reserved for it and must be 0.
"""

from __future__ import annotations

import hashlib
import hmac
import struct
from enum import IntEnum
from typing import NamedTuple

from protocol import WireError

KEY_UP = "er2/u"
KEY_DOWN = "er2/d"
DOWNLINK_KEY_ID = 0  # the rover's; operator stations have 1 to 255

MAX_DATAGRAM = 1150
MIN_LIMIT = 200
UDP_IP_BYTES = 28
TAG_BYTES = 16
MAX_JUMP = 1 << 20
WINDOW = 4096  # counters of a key that may come late
_HEAD = struct.Struct("<BBBBQI")
OVERHEAD = _HEAD.size + TAG_BYTES
_KEY_BYTES = 32


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


def hkdf(secret: bytes, info: bytes, length: int = _KEY_BYTES) -> bytes:
    """HKDF-SHA-256 with an empty salt (RFC 5869)."""
    pseudo_random_key = hmac.digest(b"\0" * 32, secret, "sha256")
    out, block, n = b"", b"", 1
    while len(out) < length:
        block = hmac.digest(pseudo_random_key, block + info + bytes([n]), "sha256")
        out, n = out + block, n + 1
    return out[:length]


class Keyring:
    """The keys of one direction: a secret of 32 B for each key id, and the epochs in which they may be used.

    direction: KEY_UP or KEY_DOWN. epochs: accepted ones; the last is the one to seal with.
    """

    def __init__(self, direction: str, secrets: dict[int, bytes], epochs: tuple[int, ...] = (0,)) -> None:
        if direction not in (KEY_UP, KEY_DOWN):
            raise ValueError(f"direction {direction!r} should be {KEY_UP!r} or {KEY_DOWN!r}")
        if not secrets or any(len(s) != _KEY_BYTES or not 0 <= i <= 255 for i, s in secrets.items()):
            raise ValueError("a keyring needs secrets of 32 bytes with ids 0 to 255")
        if not epochs or any(not 0 <= e <= 255 for e in epochs):
            raise ValueError("a keyring needs epochs from 0 to 255")
        self.direction, self.epochs = direction, epochs
        self._secrets = dict(secrets)
        self._derived: dict[tuple[int, int], bytes] = {}

    def __repr__(self) -> str:
        return f"Keyring({self.direction}, ids {self.key_ids}, epochs {self.epochs})"

    @property
    def key_ids(self) -> tuple[int, ...]:
        """Ids in rising order."""
        return tuple(sorted(self._secrets))

    def key(self, key_id: int, epoch: int | None = None) -> bytes | None:
        """The key of an id in an epoch (default: the present one); None where the id is unknown."""
        epoch = self.epochs[-1] if epoch is None else epoch
        found = self._derived.get((key_id, epoch))
        if found is None and key_id in self._secrets:
            info = f"el dorado link {self.direction} ".encode() + bytes((key_id, epoch))
            found = self._derived[key_id, epoch] = hkdf(self._secrets[key_id], info)
        return found


def parse_keys(text: str) -> Keyring:
    """A key file: lines `er2/u ID 64-HEX-DIGITS` of one direction, and `epoch N ...`; # begins a comment.

    Raises ValueError with the line's number; the text of a secret is never part of a message.
    """
    direction = ""
    secrets: dict[int, bytes] = {}
    epochs: tuple[int, ...] = (0,)
    for number, raw in enumerate(text.splitlines(), 1):
        words = raw.split("#", 1)[0].split()
        if not words:
            continue
        try:
            if words[0] == "epoch":
                epochs = tuple(int(w) for w in words[1:])
                continue
            name, key_id, secret = words
            if name not in (KEY_UP, KEY_DOWN) or (direction and name != direction) or int(key_id) in secrets:
                raise ValueError
            direction, secrets[int(key_id)] = name, bytes.fromhex(secret)
        except ValueError:
            raise ValueError(f"key file, line {number}: should be `{KEY_UP} ID SECRET` (64 hex digits, one direction, "
                             "each id once) or `epoch N ...`") from None
    if not secrets:
        raise ValueError("key file: no key in it")
    return Keyring(direction, secrets, epochs)


def format_keys(direction: str, secrets: dict[int, bytes], epochs: tuple[int, ...] = (0,)) -> str:
    """The text of a key file; `parse_keys` reads it back."""
    lines = [f"epoch {' '.join(map(str, epochs))}"]
    return "\n".join(lines + [f"{direction} {i} {s.hex()}" for i, s in sorted(secrets.items())]) + "\n"


class LinkKeys(NamedTuple):
    """Both directions' keys."""

    command: Keyring
    downlink: Keyring


def bench_keys(seed: int, stations: int = 4) -> LinkKeys:
    """Keys for a bench, known to everybody who knows the seed: stations 1 to n, and the rover's."""
    root = hashlib.sha256(b"el dorado bench keys %d" % seed).digest()
    up = {i: hkdf(root, b"command %d" % i) for i in range(1, stations + 1)}
    return LinkKeys(Keyring(KEY_UP, up), Keyring(KEY_DOWN, {DOWNLINK_KEY_ID: hkdf(root, b"downlink")}))


class Sealer:
    """Payloads in, datagrams out. `key` is Keyring.key(key_id, epoch); `counter` the first one to use.

    A sender that outlives a boot (the ground) keeps `counter` in blocks on disk, ahead of use. boot_id may be changed:
    the ground sets it to what Opener.boot_id heard.
    """

    def __init__(self, key: bytes, key_id: int, boot_id: int, counter: int = 0, epoch: int = 0) -> None:
        self._key, self._key_id, self._epoch = key, key_id, epoch
        self.boot_id, self.counter = boot_id, counter

    def seal(self, kind: int, payload: bytes) -> bytes:
        """One datagram. Raises ValueError where it would be longer than MAX_DATAGRAM."""
        if len(payload) + OVERHEAD > MAX_DATAGRAM:
            raise ValueError(f"payload of {len(payload)} B, at most {MAX_DATAGRAM - OVERHEAD} fit a datagram")
        body = _HEAD.pack(kind, self._key_id, self._epoch, 0, self.counter, self.boot_id) + payload
        self.counter += 1
        return body + hmac.digest(self._key, body, "sha256")[:TAG_BYTES]


class Opened(NamedTuple):
    """A datagram all of whose checks passed. station: its key id."""

    kind: Kind
    station: int
    counter: int
    boot_id: int
    payload: bytes


class _Window:
    """Counters seen of one sender in one boot; bit n of `seen` is counter highest - n."""

    __slots__ = ("highest", "seen")

    def __init__(self, highest: int) -> None:
        self.highest, self.seen = highest, 0


class Opener:
    """Datagrams in, checked payloads out; nothing that fails a check changes anything.

    boot_id: the rover gives its own, and only that is opened. The ground gives none: the newest heard counts
    (`newest_boot_id` may be kept over a restart, so that nothing of an earlier boot can be replayed to it).
    """

    def __init__(
        self, keys: Keyring, window: int = WINDOW, *, boot_id: int | None = None, newest_boot_id: int = 0
    ) -> None:
        self._keys, self._size, self._mask = keys, window, (1 << window) - 1
        self._fixed = boot_id is not None
        self.boot_id = newest_boot_id if boot_id is None else boot_id
        self._windows: dict[int, _Window] = {}

    def open(self, datagram: bytes) -> Opened:
        """The payload and who sent it. Raises WireError of kind length, tag, epoch, boot, replay, jump or kind."""
        if not OVERHEAD <= len(datagram) <= MAX_DATAGRAM:
            raise WireError("length", f"{len(datagram)} B")
        kind, key_id, epoch, flags, counter, boot_id = _HEAD.unpack_from(datagram)
        key = self._keys.key(key_id, epoch)
        if key is None:
            raise WireError("tag", f"no key {key_id}")
        body = datagram[:-TAG_BYTES]
        if not hmac.compare_digest(hmac.digest(key, body, "sha256")[:TAG_BYTES], datagram[-TAG_BYTES:]):
            raise WireError("tag")
        if epoch not in self._keys.epochs:
            raise WireError("epoch", f"{epoch}, accepted {self._keys.epochs}")
        if boot_id < self.boot_id or (self._fixed and boot_id != self.boot_id):
            raise WireError("boot", f"boot id {boot_id}, present {self.boot_id}")
        if flags or not Kind.MAVLINK <= kind <= Kind.REPORT:
            raise WireError("kind", f"kind {kind}, flags {flags}")
        if boot_id != self.boot_id:
            self.boot_id = boot_id
            self._windows.clear()
        self._count(key_id, counter)
        return Opened(Kind(kind), key_id, counter, boot_id, body[_HEAD.size :])

    def _count(self, key_id: int, counter: int) -> None:
        window = self._windows.get(key_id)
        if window is None:
            window = self._windows[key_id] = _Window(counter)
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
