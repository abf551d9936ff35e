"""Keys of the space link: independent secrets, one for each operator station (up) and one for the rover (down).

A secret never crosses the link and is never shown; people compare its `fingerprint`. The keys of all epochs are derived
from the secret (HKDF), so a key file that lists epochs makes all of them available in advance. The rover decides which
epoch is in force (protocol.link.datagrams, rule 5).
"""

from __future__ import annotations

import hashlib
import hmac
from typing import NamedTuple

KEY_UP = "er2/u"
KEY_DOWN = "er2/d"
DOWNLINK_KEY_ID = 0  # the rover's; operator stations have 1 to 255
EPOCHS = 4  # loaded in new key files
_KEY_BYTES = 32
_HELLO = -1  # not an epoch: index of the hello key among the epoch keys


def hkdf(secret: bytes, info: bytes, length: int = _KEY_BYTES) -> bytes:
    """HKDF-SHA-256 with an empty salt (RFC 5869)."""
    pseudo_random_key = hmac.digest(b"\0" * 32, secret, "sha256")
    out, block, n = b"", b"", 1
    while len(out) < length:
        block = hmac.digest(pseudo_random_key, block + info + bytes([n]), "sha256")
        out, n = out + block, n + 1
    return out[:length]


class Keyring:
    """Keys of one direction: a secret of 32 B for each key id, and the epochs in which they may be used.

    direction: KEY_UP or KEY_DOWN.
    epochs: loaded epochs in rising order; the first is in force until a switch.
    """

    def __init__(self, direction: str, secrets: dict[int, bytes], epochs: tuple[int, ...] = (0,)) -> None:
        if direction not in (KEY_UP, KEY_DOWN):
            raise ValueError(f"direction {direction!r} should be {KEY_UP!r} or {KEY_DOWN!r}")
        if any(len(s) != _KEY_BYTES or not 0 <= i <= 255 for i, s in secrets.items()):
            raise ValueError("a keyring needs secrets of 32 bytes with ids 0 to 255")
        if not epochs or any(not 0 <= e <= 255 for e in epochs) or list(epochs) != sorted(set(epochs)):
            raise ValueError("a keyring needs rising epochs from 0 to 255")
        self.direction, self.epochs = direction, epochs
        self._secrets = dict(secrets)
        self._derived: dict[tuple[int, int], bytes] = {}

    def __repr__(self) -> str:
        return f"Keyring({self.direction}, ids {self.key_ids}, epochs {self.epochs})"

    @property
    def key_ids(self) -> tuple[int, ...]:
        """Key ids in rising order."""
        return tuple(sorted(self._secrets))

    def key(self, key_id: int, epoch: int | None = None) -> bytes | None:
        """Return the key of an id in an epoch (default: the first), loaded or not; None if the id is unknown."""
        epoch = self.epochs[0] if epoch is None else epoch
        found = self._derived.get((key_id, epoch))
        if found is None and key_id in self._secrets:
            info = f"el dorado link {self.direction} ".encode() + bytes((key_id, epoch))
            found = self._derived[key_id, epoch] = hkdf(self._secrets[key_id], info)
        return found

    def hello_key(self, key_id: int) -> bytes | None:
        """Return the key to request the rover's datagrams with (protocol.link.direct); None if the id is unknown."""
        found = self._derived.get((key_id, _HELLO))
        if found is None and key_id in self._secrets:
            info = f"el dorado link {self.direction} hello ".encode() + bytes((key_id,))
            found = self._derived[key_id, _HELLO] = hkdf(self._secrets[key_id], info)
        return found

    def fingerprint(self, key_id: int) -> str:
        """Ten hex digits that identify a secret for people and files; the secret cannot be derived from them."""
        info = f"el dorado link {self.direction} fingerprint ".encode() + bytes((key_id,))
        return hkdf(self._secrets[key_id], info, 5).hex()


def parse_keys(text: str) -> Keyring:
    """Parse a key file: lines `er2/u ID 64-HEX-DIGITS` of one direction, and `epoch N ...`; # begins a comment.

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
            raise ValueError(
                f"key file, line {number}: should be `{KEY_UP} ID SECRET` (64 hex digits, one direction, "
                "each id once) or `epoch N ...`"
            ) from None
    if not secrets:
        raise ValueError("key file: no key in it")
    return Keyring(direction, secrets, epochs)


def format_keys(direction: str, secrets: dict[int, bytes], epochs: tuple[int, ...] = (0,)) -> str:
    """Format a key file that `parse_keys` can read."""
    lines = [f"epoch {' '.join(map(str, epochs))}"]
    return "\n".join(lines + [f"{direction} {i} {s.hex()}" for i, s in sorted(secrets.items())]) + "\n"


class LinkKeys(NamedTuple):
    """Keys of both directions.

    command: keys of the stations; empty for a viewer, who can receive but not command.
    downlink: key of the rover.
    """

    command: Keyring
    downlink: Keyring


def bench_keys(seed: int, stations: int = 4) -> LinkKeys:
    """Keys for a bench, derived from the seed and therefore not secret: stations 1 to n, and the rover's."""
    root = hashlib.sha256(b"el dorado bench keys %d" % seed).digest()
    up = {i: hkdf(root, b"command %d" % i) for i in range(1, stations + 1)}
    return LinkKeys(Keyring(KEY_UP, up), Keyring(KEY_DOWN, {DOWNLINK_KEY_ID: hkdf(root, b"downlink")}))
