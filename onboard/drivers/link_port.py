"""The link's port: a zenoh session, the keys, and nothing else. Keys never leave this file towards the core.

What arrives is opened by `protocol.link` and handed on as LinkMessage, refused datagrams with the name of the failed
check; what leaves is sealed with the rover's key. On the wall clock `read` takes what is there; in lock-step
`wait_open` comes before the first tick and `read_upto` takes exactly what the barrier counts. The opening probe is in
`protocol.carrier`.
"""

from __future__ import annotations

import stat
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

import zenoh

from onboard.config import Config, ConfigError
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
    parse_keys,
)

_MOST_PER_READ = 256  # bounds a tick on the wall clock; the rest waits in the queue


class LinkPortError(RuntimeError):
    """The link does not answer in lock-step; the text is one line that says what was waited for."""


def link_keys(config: Config) -> LinkKeys:
    """The keys that the configuration names: two files, or on a bench those of its seed. Raises ConfigError."""
    link = config.link
    if link.command_keys and link.downlink_key:
        return LinkKeys(_key_file("link.command_keys", link.command_keys, KEY_UP),
                        _key_file("link.downlink_key", link.downlink_key, KEY_DOWN))
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


def _key_file(name: str, path: str, direction: str) -> Keyring:
    try:
        mode = stat.S_IMODE(Path(path).stat().st_mode)
        if mode & 0o077:
            raise ConfigError(f"{name}: {path} has mode {mode:04o}, others may read it; chmod 600 it")
        keys = parse_keys(Path(path).read_text())
    except OSError as error:
        raise ConfigError(f"{name}: {path}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"{name}: {path}: {error}") from None  # the cause could quote a secret
    if keys.direction != direction:
        raise ConfigError(f"{name}: {path} holds keys of {keys.direction}, should be of {direction}")
    return keys


class LinkPort:
    """The rover's end of the link. Use it inside `with`, or call `close`: an open session hangs the interpreter."""

    def __init__(self, endpoint: str, keys: LinkKeys, boot_id: int) -> None:
        key = keys.downlink.key(DOWNLINK_KEY_ID)
        if key is None:
            raise ConfigError(f"link.downlink_key: holds no key {DOWNLINK_KEY_ID}, the rover's")
        self._sealer = Sealer(key, DOWNLINK_KEY_ID, boot_id, epoch=keys.downlink.epochs[-1])
        self._opener = Opener(keys.command, boot_id=boot_id)
        self._probe = carrier.Probe()
        self._failed = False
        self._taken = self._sent = 0
        self._stack = ExitStack()
        self._open(endpoint)

    def _open(self, endpoint: str) -> None:
        config = zenoh.Config()
        try:
            for name, text in carrier.settings(connect=endpoint):
                config.insert_json5(name, text)
            session = self._stack.enter_context(zenoh.open(config))
        except zenoh.ZError as error:
            like = "tcp/127.0.0.1:7447"
            raise ConfigError(f"link.endpoint = {endpoint!r} should be a locator like {like}: {error}") from error
        self._in = session.declare_subscriber(KEY_UP, zenoh.handlers.FifoChannel(carrier.QUEUE_SAMPLES))
        answers = carrier.answer_key(carrier.ROVER)
        self._answers = session.declare_subscriber(answers, zenoh.handlers.FifoChannel(1000))
        self._put = _publisher(session, KEY_DOWN)
        self._ask = _publisher(session, carrier.question_key(carrier.ROVER))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Ends the session; may be called again."""
        self._failed = True
        self._stack.close()

    @property
    def state(self) -> PortState:
        """OPEN once the carrier has answered a probe, ERROR once the session is gone."""
        if self._failed:
            return PortState.ERROR
        return PortState.OPEN if self._probe.open else PortState.CLOSED

    @property
    def sent(self) -> int:
        """Datagrams put since the start."""
        return self._sent

    def wait_open(self, limit_s: float = 30.0) -> None:
        """Knocks until the carrier answers. Raises LinkPortError when it does not within the limit."""
        deadline_ns = time.monotonic_ns() + round(limit_s * 1e9)
        while not self._probe.open:
            self._knock()
            if time.monotonic_ns() > deadline_ns:
                raise LinkPortError(f"the link's carrier did not answer a probe within {limit_s:g} s")
            time.sleep(0.001)

    def _knock(self) -> None:
        answer = self._answers.try_recv()
        question = self._probe.send(time.monotonic_ns())
        ready = self._probe.receive(answer.payload.to_bytes()) if answer is not None else None
        for words in (question, ready):
            if words is not None:
                self._send(self._ask, words)

    def read(self, stamp_ns: int) -> tuple[LinkMessage, ...]:
        """What has arrived, at most 256 datagrams, all with this time of arrival."""
        if not self._probe.open:
            self._knock()
        messages: list[LinkMessage] = []
        while len(messages) < _MOST_PER_READ and (sample := self._in.try_recv()) is not None:
            messages.append(self._message(sample.payload.to_bytes(), stamp_ns))
        return tuple(messages)

    def read_upto(self, total: int, stamps_us: Sequence[int], limit_s: float = 10.0) -> tuple[LinkMessage, ...]:
        """Waits until `total` datagrams have been taken since the start; the new ones get the barrier's stamps.

        Raises LinkPortError when they do not come within the limit of wall time.
        """
        missing = total - self._taken
        if missing != len(stamps_us):
            raise LinkPortError(f"link: {missing} new datagrams but {len(stamps_us)} stamps")
        messages: list[LinkMessage] = []
        deadline_s = 0.0
        while len(messages) < missing:
            sample = self._in.try_recv()
            if sample is not None:
                messages.append(self._message(sample.payload.to_bytes(), stamps_us[len(messages)] * 1000))
                continue
            deadline_s = deadline_s or time.monotonic() + limit_s
            if time.monotonic() > deadline_s:
                raise LinkPortError(f"link: {len(messages)} of {missing} datagrams came within {limit_s:g} s")
            time.sleep(50e-6)
        return tuple(messages)

    def _message(self, datagram: bytes, stamp_ns: int) -> LinkMessage:
        self._taken += 1
        try:
            opened = self._opener.open(datagram)
        except WireError as error:
            return LinkMessage(stamp_ns, False, error.kind, 0, 0, b"")
        return LinkMessage(stamp_ns, True, "ok", opened.station, opened.kind, opened.payload)

    def write(self, payloads: Iterable[tuple[int, bytes]]) -> None:
        """Seals and puts (kind, payload) in their order. Without a session they are lost, as on a dead link."""
        for kind, payload in payloads:
            self._send(self._put, self._sealer.seal(kind, payload))
            self._sent += 1

    def _send(self, put: Callable[[bytes], None], data: bytes) -> None:
        if self._failed:
            return
        try:
            put(data)
        except zenoh.ZError:
            self._failed = True


def _publisher(session: zenoh.Session, key: str) -> Callable[[bytes], None]:
    """A reliable, blocking, unbatched put: the local bus loses nothing."""
    publisher = session.declare_publisher(
        key, congestion_control=zenoh.CongestionControl.BLOCK, reliability=zenoh.Reliability.RELIABLE, express=True
    )
    return publisher.put
