"""Lock-step protocol: the bench owns time, each participant runs one tick on request.

    bench                         participant
      |  HELLO <--------------------  |   name, protocol version
      |  WELCOME ------------------>  |   tick length, start tick
      |  TICK n, channels --------->  |   reads each channel until it holds `count` pieces,
      |                               |   runs its tick, writes its outputs,
      |  <------------- DONE n, sent  |   how many pieces it sent on each channel since the start
      |  STOP --------------------->  |   the run is over: close the record, exit 0

Rule 1: counts are cumulative pieces (CAN frames, stream bytes, datagrams) since the channel's epoch began.
Rule 2: a participant never acts on a piece before the TICK that counts it, whenever it arrived.
Rule 3: DONE carries `wake_tick`: the participant need not be called before that tick unless a channel has news.
Rule 4: TICKs may skip numbers: the participant is meant to be late, and receives what arrived in between.

On the stream each message is a 4-byte little-endian length, one version byte, one type byte, then the body.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass, field

from protocol import WireError

VERSION = 2
_HEAD = struct.Struct("<IBB")
_TICK = struct.Struct("<QQBB")
_CHANNEL = struct.Struct("<BHBQI")
_DONE = struct.Struct("<QQBB")
_COUNT = struct.Struct("<BQ")
_LIMIT = 1 << 24

CLOSED, OPEN, ERROR = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Channel:
    """One channel at one tick.

    name: name of the channel.
    count: cumulative pieces of its `epoch`.
    state: CLOSED, OPEN or ERROR.
    epoch: rises each time that the count restarts at zero.
    stamps_us: arrival times of the new pieces, us.
    """

    name: str
    count: int
    state: int = OPEN
    epoch: int = 0
    stamps_us: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Hello:
    """First message of a participant."""

    name: str


@dataclass(frozen=True, slots=True)
class Welcome:
    """Bench's answer: length of a tick and number of the first one."""

    tick_ns: int
    first_tick: int


@dataclass(frozen=True, slots=True)
class Tick:
    """Request to run one tick.

    number: number of the tick.
    now_ns: bench time.
    channels: state of each channel.
    machine: figures of the rover's computer for this tick, the fields of onboard.records.Machine; (): none.
    """

    number: int
    now_ns: int
    channels: tuple[Channel, ...]
    machine: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Done:
    """Reply that a tick is done.

    number: number of the tick.
    wake_tick: tick before which the participant need not be called (rule 3).
    sent: cumulative pieces per channel.
    connect: channels to open or reopen.
    """

    number: int
    wake_tick: int
    sent: dict[str, int] = field(default_factory=dict)
    connect: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Stop:
    """End of the run."""

    reason: str = ""


Message = Hello | Welcome | Tick | Done | Stop


def parse_address(text: str) -> tuple[str, int]:
    """Parse the bench's address `tcp:HOST:PORT` into (host, port). Raises ValueError."""
    kind, _, rest = text.partition(":")
    host, _, port = rest.rpartition(":")
    if kind != "tcp" or not host or not port.isdigit():
        raise ValueError(f"`{text}` should be tcp:HOST:PORT")
    return host, int(port)


def _text(value: str) -> bytes:
    raw = value.encode()[:255]
    return struct.pack("<B", len(raw)) + raw


def encode(message: Message) -> bytes:
    """Encode one message for the stream."""
    match message:
        case Tick(number, now_ns, channels, machine):
            kind, parts = 3, [_TICK.pack(number, now_ns, len(channels), len(machine))]
            parts.append(struct.pack(f"<{len(machine)}d", *machine))
            for c in channels:
                name = c.name.encode()
                parts += [_CHANNEL.pack(len(name), c.epoch, c.state, c.count, len(c.stamps_us)), name]
                parts.append(struct.pack(f"<{len(c.stamps_us)}Q", *c.stamps_us))
        case Done(number, wake_tick, sent, connect):
            kind, parts = 4, [_DONE.pack(number, wake_tick, len(sent), len(connect))]
            for name_, count in sent.items():
                raw = name_.encode()
                parts += [_COUNT.pack(len(raw), count), raw]
            parts += [_text(c) for c in connect]
        case Hello(name_):
            kind, parts = 1, [_text(name_)]
        case Welcome(tick_ns, first_tick):
            kind, parts = 2, [struct.pack("<QQ", tick_ns, first_tick)]
        case Stop(reason):
            kind, parts = 5, [_text(reason)]
    body = b"".join(parts)
    return _HEAD.pack(len(body) + 2, VERSION, kind) + body


def _read_text(body: bytes, at: int) -> tuple[str, int]:
    size = body[at]
    if at + 1 + size > len(body):
        raise WireError("barrier", "text runs over the end of its message")
    return body[at + 1 : at + 1 + size].decode(errors="replace"), at + 1 + size


def _read_tick(body: bytes) -> Tick:
    number, now_ns, channels, items = _TICK.unpack_from(body)
    machine = struct.unpack_from(f"<{items}d", body, _TICK.size)
    at, rows = _TICK.size + 8 * items, []
    for _ in range(channels):
        size, epoch, state, count, stamps = _CHANNEL.unpack_from(body, at)
        at += _CHANNEL.size
        name = body[at : at + size].decode()
        at += size
        stamps_us = struct.unpack_from(f"<{stamps}Q", body, at)
        at += 8 * stamps
        rows.append(Channel(name, count, state, epoch, stamps_us))
    return Tick(number, now_ns, tuple(rows), machine)


def _read_done(body: bytes) -> Done:
    number, wake_tick, counts, connects = _DONE.unpack_from(body)
    at, sent, connect = _DONE.size, {}, []
    for _ in range(counts):
        size, count = _COUNT.unpack_from(body, at)
        at += _COUNT.size
        sent[body[at : at + size].decode()] = count
        at += size
    for _ in range(connects):
        name, at = _read_text(body, at)
        connect.append(name)
    return Done(number, wake_tick, sent, tuple(connect))


def _decode(kind: int, body: bytes) -> Message:
    try:
        if kind == 3:
            return _read_tick(body)
        if kind == 4:
            return _read_done(body)
        if kind == 1:
            return Hello(_read_text(body, 0)[0])
        if kind == 2:
            return Welcome(*struct.unpack("<QQ", body))
        if kind == 5:
            return Stop(_read_text(body, 0)[0])
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise WireError("barrier", f"message of type {kind} is malformed: {error}") from error
    raise WireError("barrier", f"unknown message type {kind}")


class Receiver:
    """Decoder of the stream: bytes in, complete messages out."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def receive(self, data: bytes) -> list[Message]:
        """Return the messages that are complete now. Raises WireError on another version or a malformed message."""
        self._buffer += data
        return list(self._messages())

    def _messages(self) -> Iterable[Message]:
        while len(self._buffer) >= _HEAD.size:
            size, version, kind = _HEAD.unpack_from(self._buffer)
            if version != VERSION:
                raise WireError("barrier", f"peer speaks version {version}, this side {VERSION}")
            if not 2 <= size <= _LIMIT:
                raise WireError("barrier", f"message of {size} bytes")
            if len(self._buffer) < 4 + size:
                return
            body = bytes(self._buffer[_HEAD.size : 4 + size])
            del self._buffer[: 4 + size]
            yield _decode(kind, body)
