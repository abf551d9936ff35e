"""The link's port: the rover's end of the link and the keys, no more. Keys never leave this file towards the core.

What arrives is opened by `protocol.link` and handed on as LinkMessage, refused datagrams with the name of the failed
check; what leaves is sealed with the rover's key. On the wall clock `read` takes what is there; in lock-step
`wait_open` comes before the first tick and `read_upto` takes exactly what the barrier counts. The opening probe is in
`protocol.carrier`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from types import TracebackType
from typing import Self

from onboard.config import Config, ConfigError
from onboard.drivers.key_file import read_keys
from onboard.drivers.link_end import LinkEnd, LinkEndError
from onboard.records import LinkMessage, PortState
from protocol import WireError, carrier
from protocol.link import (
    DOWNLINK_KEY_ID,
    KEY_DOWN,
    KEY_UP,
    Keyring,
    LinkKeys,
    Opener,
    Sealer,
    bench_keys,
)

_MOST_PER_READ = 256  # bounds a tick on the wall clock; the rest waits in the queue


class LinkPortError(RuntimeError):
    """The link does not answer in lock-step; the text is one line that says what was waited for."""


def link_keys(config: Config) -> LinkKeys:
    """The keys that the configuration names: two files, or on a bench those of its seed. Raises ConfigError."""
    link = config.link
    if link.command_keys and link.downlink_key:
        return LinkKeys(_keys("link.command_keys", link.command_keys, KEY_UP),
                        _keys("link.downlink_key", link.downlink_key, KEY_DOWN))
    if link.command_keys or link.downlink_key:
        missing = "link.downlink_key" if link.command_keys else "link.command_keys"
        raise ConfigError(f"{missing}: name this file too; both directions need keys")
    if link.bench_seed < 0:
        raise ConfigError("link.command_keys, link.downlink_key: no key files named (on a bench set link.bench_seed)")
    real = _real_device(config)
    if real:
        raise ConfigError(f"link.bench_seed: bench keys are known to everybody and are refused with {real}; "
                          "name link.command_keys and link.downlink_key")
    return bench_keys(link.bench_seed)


def _real_device(config: Config) -> str:
    if config.can.uri.startswith("socketcan:") and not config.can.uri.startswith("socketcan:vcan"):
        return f"can.uri = {config.can.uri!r}"
    if config.lidar.address.startswith("tty:"):
        return f"lidar.address = {config.lidar.address!r}"
    return ""


def _keys(name: str, path: str, direction: str) -> Keyring:
    try:
        return read_keys(path, direction)
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from None  # the cause could quote a secret


def checked(opener: Opener, datagram: bytes, stamp_ns: int) -> LinkMessage:
    """What the core hears of a datagram: its payload, or which check refused it."""
    try:
        opened = opener.open(datagram)
    except WireError as error:
        return LinkMessage(stamp_ns, False, error.kind, 0, 0, b"")
    return LinkMessage(stamp_ns, True, "ok", opened.station, opened.kind, opened.payload)


class LinkPort:
    """The rover's end of the link. Use it inside `with`, or call `close`: an open session hangs the interpreter."""

    def __init__(self, endpoint: str, keys: LinkKeys, boot_id: int, one_way_s: float = 1.3) -> None:
        key = keys.downlink.key(DOWNLINK_KEY_ID)
        if key is None:
            raise ConfigError(f"link.downlink_key: holds no key {DOWNLINK_KEY_ID}, the rover's")
        self._sealer = Sealer(key, DOWNLINK_KEY_ID, boot_id, epoch=keys.downlink.epochs[-1])
        self._opener = Opener(keys.command, boot_id=boot_id)
        self._sent = 0
        try:
            self._end = LinkEnd(carrier.ROVER, endpoint, hear=KEY_UP, say=KEY_DOWN, one_way_s=one_way_s)
        except ValueError as error:
            like = "tcp/127.0.0.1:7447"
            raise ConfigError(f"link.endpoint = {endpoint!r} should be a locator like {like}: {error}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Ends the session; may be called again."""
        self._end.close()

    @property
    def state(self) -> PortState:
        """OPEN once the carrier has answered a probe, ERROR once the session is gone."""
        if self._end.failed:
            return PortState.ERROR
        return PortState.OPEN if self._end.open else PortState.CLOSED

    @property
    def sent(self) -> int:
        """Datagrams put since the start."""
        return self._sent

    def wait_open(self, limit_s: float = 30.0) -> None:
        """Knocks until the carrier answers. Raises LinkPortError when it does not within the limit."""
        if not self._end.wait_open(limit_s):
            raise LinkPortError(f"the link's carrier did not answer a probe within {limit_s:g} s")

    def read(self, stamp_ns: int) -> tuple[LinkMessage, ...]:
        """What has arrived, at most 256 datagrams, all with this time of arrival."""
        self._end.knock()
        return tuple(checked(self._opener, datagram, stamp_ns) for datagram in self._end.take(_MOST_PER_READ))

    def read_upto(self, total: int, stamps_us: Sequence[int], limit_s: float = 10.0) -> tuple[LinkMessage, ...]:
        """Waits until `total` datagrams have been taken since the start; the new ones get the barrier's stamps.

        Raises LinkPortError when they do not come within the limit of wall time.
        """
        missing = total - self._end.taken
        if missing != len(stamps_us):
            raise LinkPortError(f"link: {missing} new datagrams but {len(stamps_us)} stamps")
        try:
            datagrams = self._end.take_upto(total, limit_s)
        except LinkEndError as error:
            raise LinkPortError(str(error)) from error
        return tuple(checked(self._opener, each, us * 1000) for each, us in zip(datagrams, stamps_us, strict=True))

    def write(self, payloads: Iterable[tuple[int, bytes]]) -> None:
        """Seals and puts (kind, payload) in their order. Without a session they are lost, as on a dead link."""
        for kind, payload in payloads:
            self._end.put(self._sealer.seal(kind, payload))
            self._sent += 1
