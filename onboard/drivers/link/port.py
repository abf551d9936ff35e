"""Port of the link: the rover's end and the keys. Keys never leave this file towards the core.

`protocol.link.datagrams` opens arriving datagrams; they are handed on as LinkMessage, refused ones with the name of the
failed check. Payloads are sealed with the rover's key and sent. On the wall clock `read` returns what has arrived; in
lock-step `wait_open` comes before the first tick and `read_upto` returns exactly what the barrier counts. On a tcp/
endpoint the end is a zenoh session with an opening probe (`protocol.link.carrier`), on a udp/ endpoint sockets without
a session.

A halting command with a counter of its own waits here until its mark is on the disk (`link_memory`).
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future
from ipaddress import ip_address
from types import TracebackType
from typing import Self

from onboard.config import Config, ConfigError
from onboard.drivers.link.saved_state import HOLD_NS, LinkMemory
from onboard.records import LinkMessage, PortState
from onboard.records.status import EPOCH, UNKEPT, Save, SaveResult
from protocol import WireError
from protocol.link import carrier
from protocol.link.datagrams import (
    DOWNLINK_KEY_ID,
    KEY_DOWN,
    KEY_UP,
    CheckedDatagram,
    Keyring,
    LinkKeys,
    Opener,
    Sealer,
    bench_keys,
)
from protocol.tables.commands import request_id_of
from transport.key_file import KeyFileError, read_keys
from transport.link_end import LinkEnd, LinkEndError
from transport.udp_end import RATE_BPS, UdpRoverEnd
from transport.zenoh_end import ZenohEnd

_VCAN = re.compile(r"socketcan:vcan\d+")
_MOST_PER_READ, _READ_NS = 512, 4_000_000  # limits of a tick on the wall clock; the rest waits in the queue
_LOOK_EVERY = 16  # datagrams between two looks at the clock


class LinkPortError(RuntimeError):
    """The link cannot be opened, or does not answer in lock-step; the text is one line that names what was awaited."""


def link_keys(config: Config) -> LinkKeys:
    """Return the keys that the configuration names: two files, or on a bench those of its seed. Raises ConfigError."""
    link = config.link
    if link.command_keys and link.downlink_key:
        if not config.state.folder:
            raise ConfigError(
                "state.folder: with key files a folder is needed, where the count of starts outlives the "
                "program: without it what was said to an earlier start would count again"
            )
        return LinkKeys(
            _keys("link.command_keys", link.command_keys, KEY_UP),
            _keys("link.downlink_key", link.downlink_key, KEY_DOWN),
        )
    if link.command_keys or link.downlink_key:
        missing = "link.downlink_key" if link.command_keys else "link.command_keys"
        raise ConfigError(f"{missing}: name this file too; both directions need keys")
    if link.bench_seed < 0:
        raise ConfigError("link.command_keys, link.downlink_key: no key files named (on a bench set link.bench_seed)")
    real = _real_device(config)
    if real:
        raise ConfigError(
            f"link.bench_seed: bench keys are known to everybody and are refused with {real}, which "
            "is not on this computer alone; name link.command_keys and link.downlink_key"
        )
    return bench_keys(link.bench_seed)


def _real_device(config: Config) -> str:
    """Return the first address through which bytes could leave this computer; '' if there is none."""
    for name, place, stays in (
        ("can.uri", config.can.uri, _can_stays(config.can.uri)),
        ("lidar.address", config.lidar.address, _stays("tcp:", config.lidar.address)),
        ("link.endpoint", config.link.endpoint, _stays("(?:tcp|udp)/", config.link.endpoint)),
        ("clock.barrier", config.clock.barrier, config.clock.mode == "wall" or _stays("tcp:", config.clock.barrier)),
    ):
        if not stays:
            return f"{name} = {place!r}"
    return ""


def endpoint_of(config: Config) -> str:
    """Endpoint of the rover. Raises ConfigError for a zenoh node on another computer without link.remote_node."""
    link = config.link
    if link.endpoint.startswith(carrier.DIRECT) or link.remote_node or _stays("tcp/", link.endpoint):
        return link.endpoint
    raise ConfigError(
        f"link.endpoint = {link.endpoint!r} is not on this computer: whoever reaches a zenoh node can "
        "keep others out of it. Use udp/HOST:PORT, which holds under floods, or on a closed bench "
        "network set link.remote_node = true (docs/link.md)"
    )


def _can_stays(uri: str) -> bool:
    """Return whether a bus is in this process, on a virtual interface, or at a server on this computer."""
    return uri.startswith("virtual:") or bool(_VCAN.fullmatch(uri)) or _stays("socketcand:", uri, r"/[\w.-]+")


def _stays(kind: str, place: str, rest: str = "") -> bool:
    """Return whether KIND HOST:PORT is on this computer's loopback. Of names only localhost counts."""
    match = re.fullmatch(rf"{kind}(\[[0-9a-f:]+\]|[\w.-]+):\d{{1,5}}{rest}", place)
    if not match:
        return False
    if match[1] == "localhost":
        return True
    try:
        return ip_address(match[1].strip("[]")).is_loopback
    except ValueError:
        return False


def _keys(name: str, path: str, direction: str) -> Keyring:
    try:
        return read_keys(path, direction)
    except KeyFileError as error:
        raise ConfigError(f"{name}: {error}") from None  # the cause could quote a secret


def checked(opener: Opener, datagram: bytes, stamp_ns: int) -> LinkMessage:
    """Return the message for the core: a datagram's payload, or the check that refused it."""
    try:
        opened = opener.open(datagram)
    except WireError as error:
        return LinkMessage(stamp_ns, False, error.kind, 0, 0, b"")
    return heard(opened, stamp_ns)


def heard(opened: CheckedDatagram, stamp_ns: int, verdict: str = "ok") -> LinkMessage:
    """Return the message for the core of a datagram that passed its checks."""
    return LinkMessage(stamp_ns, True, verdict, opened.station, opened.kind, opened.payload)


class Gate:
    """Filter from datagrams to messages: passes those that pass every check, halting commands after their marks.

    memory: store of the marks, the only I/O here; `end` and time are the caller's.
    """

    def __init__(self, keys: LinkKeys, boot_id: int, memory: LinkMemory) -> None:
        self._memory = memory
        self._opener = Opener(keys.command, boot_id=boot_id, epoch=memory.epoch, marks=memory.marks)
        self._held: list[tuple[int, CheckedDatagram, Future[bool]]] = []

    def use(self, epoch: int) -> None:
        """Switch to this epoch."""
        self._opener.epoch = epoch

    def receive(self, datagram: bytes, stamp_ns: int) -> list[LinkMessage]:
        """Return the message of a datagram; none while it waits for its mark."""
        try:
            opened = self._opener.open(datagram)
        except WireError as error:
            return [LinkMessage(stamp_ns, False, error.kind, 0, 0, b"")]
        if not opened.halt:
            return [heard(opened, stamp_ns)]
        written = self._memory.mark(opened.station, opened.counter, request_id_of(opened.payload) or 0)
        self._held.append((stamp_ns, opened, written))
        return self.release(stamp_ns)

    def release(self, now_ns: int) -> list[LinkMessage]:
        """Return messages whose marks are saved, or that have waited long enough, in order of arrival."""
        out: list[LinkMessage] = []
        while self._held:
            stamp_ns, opened, written = self._held[0]
            if not written.done() and now_ns - stamp_ns < HOLD_NS:
                break
            del self._held[0]
            kept = written.done() and written.result()
            out.append(heard(opened, now_ns, "ok" if kept else UNKEPT))
        return out


def _end(endpoint: str, keys: LinkKeys, rate_bps: float) -> LinkEnd:
    if endpoint.startswith(carrier.DIRECT):
        return UdpRoverEnd(endpoint, keys, rate_bps)
    return ZenohEnd(carrier.ROVER, endpoint, hear=KEY_UP, say=KEY_DOWN)


class LinkPort:
    """The rover's end of the link. Use it inside `with`, or call `close`: an open zenoh session hangs the interpreter.

    memory: store of marks and epoch; default: one that ends with the port.
    rate_bps: of the downlink, which bounds the copies to several listeners.
    end: replaces the one at the endpoint (a bench of one process).
    clock_ns: clock that ends a read when its time is used up.
    """

    def __init__(
        self,
        endpoint: str,
        keys: LinkKeys,
        boot_id: int,
        memory: LinkMemory | None = None,
        rate_bps: float = RATE_BPS,
        end: LinkEnd | None = None,
    ) -> None:
        self._memory = memory or LinkMemory("", keys)
        self._downlink = keys.downlink
        self._sealer = Sealer(self._key(self._memory.epoch), DOWNLINK_KEY_ID, boot_id, epoch=self._memory.epoch)
        self._gate = Gate(keys, boot_id, self._memory)
        self._switching: list[Future[SaveResult]] = []
        self._sent = 0
        self.clock_ns: Callable[[], int] = time.monotonic_ns
        try:
            self._end = end or _end(endpoint, keys, rate_bps)
        except ValueError as error:
            like = "tcp/127.0.0.1:7447 or udp/0.0.0.0:7450"
            raise ConfigError(f"link.endpoint = {endpoint!r} should be a locator like {like}: {error}") from error
        except LinkEndError as error:
            raise LinkPortError(f"link.endpoint = {endpoint!r} cannot be had now: {error}") from error

    def _key(self, epoch: int) -> bytes:
        key = self._downlink.key(DOWNLINK_KEY_ID, epoch)
        if key is None:
            raise ConfigError(f"link.downlink_key: holds no key {DOWNLINK_KEY_ID}, the rover's")
        return key

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close the link; may be called again."""
        self._end.close()
        self._memory.close()

    @property
    def state(self) -> PortState:
        """OPEN once the carrier has answered a probe, over UDP while anybody listens; ERROR once the end is gone."""
        if self._end.failed:
            return PortState.ERROR
        return PortState.OPEN if self._end.open else PortState.CLOSED

    @property
    def sent(self) -> int:
        """Datagrams sent since the start."""
        return self._sent

    def wait_open(self, limit_s: float = 30.0) -> None:
        """Knock until the carrier answers. Raises LinkPortError if it does not within the limit."""
        if not self._end.wait_open(limit_s):
            raise LinkPortError(f"the link's carrier did not answer a probe within {limit_s:g} s")

    def read(self, stamp_ns: int) -> tuple[LinkMessage, ...]:
        """Return what has arrived, at most 512 datagrams and 4 ms of work, all with this time of arrival."""
        self._end.knock()
        messages, end_ns = self._gate.release(stamp_ns), self.clock_ns() + _READ_NS
        for _ in range(_MOST_PER_READ // _LOOK_EVERY):
            for datagram in self._end.take(_LOOK_EVERY):
                messages += self._gate.receive(datagram, stamp_ns)
            if self._end.emptied or self.clock_ns() >= end_ns:
                break
        return tuple(messages)

    def read_upto(self, total: int, stamps_us: Sequence[int], limit_s: float = 10.0) -> tuple[LinkMessage, ...]:
        """Wait until `total` datagrams have been taken since the start; the new ones get the barrier's stamps.

        Raises LinkPortError if they do not come within the limit of wall time.
        """
        missing = total - self._end.taken
        if missing != len(stamps_us):
            raise LinkPortError(f"link: {missing} new datagrams but {len(stamps_us)} stamps")
        try:
            datagrams = self._end.take_upto(total, limit_s)
        except LinkEndError as error:
            raise LinkPortError(str(error)) from error
        pairs = zip(datagrams, stamps_us, strict=True)
        return tuple(message for each, us in pairs for message in self._gate.receive(each, us * 1000))

    def write(self, payloads: Iterable[tuple[int, bytes]]) -> None:
        """Seal and send (kind, payload) in order. Without a listener they are lost, as on a dead link."""
        for kind, payload in payloads:
            self._end.put(self._sealer.seal(kind, payload))
            self._sent += 1

    def start(self, saves: Iterable[Save]) -> None:
        """Start the switch to the key epoch that the core requests; `collect` returns its result."""
        for save in saves:
            if save.name == EPOCH:
                self._switching.append(self._memory.switch(int(save.data)))

    def collect(self) -> tuple[SaveResult, ...]:
        """Return the results of finished switches; from then on the port uses the new epoch."""
        saved = tuple(each.result() for each in self._switching if each.done())
        self._switching = [each for each in self._switching if not each.done()]
        if saved:
            self._gate.use(self._memory.epoch)
            self._sealer.use(self._key(self._memory.epoch), self._memory.epoch)
        return saved
