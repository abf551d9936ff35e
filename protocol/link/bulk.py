"""Bulk objects over a lossy link, both ends: selective repeat by bitmap reports.

    sender, chunks by index                           receiver
      |  announce, 0, 1, 2, 3, 4, 5, 6 ...  ------>     |  has 0 1 . 3 4 . .     (2 lost, 5 and 6 on the way)
      |  <------ bitmap every 0.5 s: echo of the newest serial received, base 2, bits .3 4. .
      |  2 again (sent before the echo, not there), 7, 8 ...

Rule 1: each transmission has a serial number. The bitmap echoes the newest one received. A chunk sent clearly before it
        and not present was lost. So losses are detected without an estimate of the round trip, at any delay.
Rule 2: when nothing new is left, idle capacity sends repair symbols (protocol.link.repair) over unconfirmed chunks.
        Whichever were lost, the end of the object costs no further round trip.
Rule 3: without a bitmap for 10 s the sender only probes, every 2 s; the first bitmap after a blackout, or after a
        restart of either side, lists the missing chunks. An object's id is derived from its content and survives
        restarts. Serials start at the sender's milliseconds, so a bitmap of an earlier transfer is recognised as old.
Rule 4: a newer object of the same name replaces an unfinished older one.
Rule 5: a restarted receiver reloads its chunks (`recall`) from its shell's store and reports them when the object is
        requested (`hint`), so that a restarted sender sends only the rest. A bitmap of an earlier transfer confirms;
        the first of this one withdraws wrong confirmations. SHA-256 and length identify the bytes.

Both ends are in one file, over the usual length: the rules bind both. The layouts are in `bulk_wire`.
"""

from __future__ import annotations

import hashlib
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.link import repair
from protocol.link.bulk_wire import ANNOUNCE, ANNOUNCEMENT, BITMAP, CHUNK, COMPLETE, KNOWN, REPAIR, Announced
from protocol.link.bulk_wire import MAX_OBJECT_BYTES as MAX_OBJECT_BYTES
from protocol.link.bulk_wire import announced as _announced
from protocol.link.bulk_wire import bits as _bits
from protocol.link.bulk_wire import chunk_head as _chunk_head
from protocol.link.datagrams import line_bytes

_REPORT_NS, _SLOW_REPORT_NS, _FRESH_NS = 500_000_000, 5_000_000_000, 3_000_000_000
_SILENCE_NS, _PROBE_NS, _GIVE_UP_NS = 10_000_000_000, 2_000_000_000, 3_600_000_000_000
_REPEAT_NS = 300_000_000
_REORDER = 3
_TOMBSTONE_NS = 60_000_000_000
_MOST_HINTS, _HINT_COPIES, _HINTED, _MOST_RECALLED = 8, 3, 2, 32


@dataclass(slots=True)
class _Transfer:
    """Transfer of one object, sender's side. serial_of, sent_ns: newest transmission of each chunk, 0: none."""

    object_id: int
    name: str
    priority: int
    announcement: bytes
    chunks: list[bytes]
    heard_ns: int
    first: int
    serial: int
    echo: int
    next_new: int = 0
    known: bool = False
    round_ns: int = 1_000_000_000
    announced_ns: int = -(1 << 62)
    probed_ns: int = -(1 << 62)
    repeat_ns: int = 0
    lost: deque[int] = field(default_factory=deque)
    acked: list[bool] = field(default_factory=list)
    serial_of: list[int] = field(default_factory=list)
    sent_ns: list[int] = field(default_factory=list)

    def chunk(self, index: int, now_ns: int) -> bytes:
        self.serial += 1
        if index == ANNOUNCEMENT:
            self.announced_ns = now_ns
            return CHUNK.pack(self.object_id, self.serial, index) + self.announcement
        self.serial_of[index], self.sent_ns[index] = self.serial, now_ns
        return CHUNK.pack(self.object_id, self.serial, index) + self.chunks[index]

    def next(self, now_ns: int) -> bytes | None:
        """Next payload to send: announcement, lost chunks, new chunks; a probe while no bitmap arrives."""
        if now_ns - self.heard_ns > _SILENCE_NS:
            if now_ns - self.probed_ns < _PROBE_NS:
                return None
            self.probed_ns = now_ns
            return self.chunk(self._oldest() if self.known else ANNOUNCEMENT, now_ns)
        if not self.known and now_ns - self.announced_ns >= max(_REPORT_NS, self.round_ns // 2):
            return self.chunk(ANNOUNCEMENT, now_ns)
        while self.lost:
            index = self.lost.popleft()
            if not self.acked[index]:
                return self.chunk(index, now_ns)
        while self.next_new < len(self.chunks):
            self.next_new += 1
            if not self.acked[self.next_new - 1]:
                return self.chunk(self.next_new - 1, now_ns)
        return None

    def repeat(self, now_ns: int) -> bytes | None:
        """Repair symbol over the unconfirmed chunks for idle capacity; for each of these chunks one symbol in 0.3 s."""
        if now_ns < self.repeat_ns or self.next_new < len(self.chunks) or now_ns - self.heard_ns > _SILENCE_NS:
            return None
        waiting = [i for i, there in enumerate(self.acked) if not there]
        if not waiting:
            return None
        base, span = waiting[0], min(waiting[-1] - waiting[0] + 1, repair.MAX_SPAN)
        self.repeat_ns = max(self.repeat_ns, now_ns - _REPEAT_NS) + _REPEAT_NS // len(waiting)
        self.serial += 1
        body = repair.encode(self.object_id, self.serial, base, span, self.chunks.__getitem__, len(self.chunks[0]))
        return CHUNK.pack(self.object_id, self.serial, REPAIR) + body

    def _oldest(self) -> int:
        waiting = (i for i in range(len(self.chunks)) if not self.acked[i])
        return min(waiting, key=self.serial_of.__getitem__, default=ANNOUNCEMENT)

    def confirm(self, echo: int, base: int, bits: bytes, now_ns: int) -> None:
        """Process a bitmap: confirmed and lost chunks (rule 1)."""
        self.heard_ns, news = now_ns, self.echo <= echo <= self.serial  # an old bitmap only confirms
        if news and echo > self.echo:
            sent_ns = next((self.sent_ns[i] for i, s in enumerate(self.serial_of) if s == echo), None)
            self.round_ns = self.round_ns if sent_ns is None else now_ns - sent_ns
            self.echo = echo
        queued = set(self.lost)
        for index in range(min(len(self.chunks), base + 8 * len(bits))):
            at = index - base
            if at < 0 or bits[at >> 3] >> (at & 7) & 1:
                self.acked[index] = True
            elif news:
                self.acked[index] = False
                if index < self.next_new and self.serial_of[index] < echo - _REORDER and index not in queued:
                    self.lost.append(index)

    def believe(self, flags: int, base: int, bits: bytes) -> None:
        """Confirm chunks by a bitmap of an earlier transfer of these bytes (rule 5)."""
        for index in range(len(self.chunks)):
            at = index - base
            if at < 0 or flags & COMPLETE or (at < 8 * len(bits) and bits[at >> 3] >> (at & 7) & 1):
                self.acked[index] = True


class Sender:
    """Sender: objects in, chunk payloads out, within the budget of each call.

    payload_limit: longest payload of a datagram in bytes (link.payload_limit).
    """

    def __init__(self, payload_limit: int) -> None:
        self._size = payload_limit - CHUNK.size - repair.HEAD_BYTES
        self._transfers: list[_Transfer] = []
        self._hints: dict[int, tuple[int, int, bytes]] = {}  # bitmaps of objects that are not being sent, newest last

    def offer(self, name: str, data: bytes, codec: str, now_ns: int, priority: int = 0) -> int:
        """Queue an object; return its id. Higher priorities are sent first; a transfer of the same content continues.

        Raises ValueError if the object is empty or too long.
        """
        if not 0 < len(data) <= min(MAX_OBJECT_BYTES, self._size * REPAIR):
            raise ValueError(f"object `{name}` of {len(data)} B cannot be sent in chunks of {self._size} B")
        sha, names = hashlib.sha256(data).digest(), (name.encode()[:40], codec.encode()[:24])
        identity = hashlib.sha256(sha + names[0] + self._size.to_bytes(2, "little")).digest()
        object_id = int.from_bytes(identity[:4], "little")
        known = next((t for t in self._transfers if t.object_id == object_id), None)
        if known is not None:
            known.known, known.announced_ns = False, -(1 << 62)  # the receiver learns of the new request
            return object_id
        self._transfers = [t for t in self._transfers if t.name != name]
        head = ANNOUNCE.pack(len(data), self._size, sha, len(names[0]), len(names[1]))
        chunks = [data[at : at + self._size] for at in range(0, len(data), self._size)]
        none, serial = [0] * len(chunks), now_ns // 1_000_000 % (1 << 31)
        self._transfers.append(
            _Transfer(
                object_id,
                name,
                priority,
                head + names[0] + names[1],
                chunks,
                now_ns,
                serial,
                serial,
                serial,
                acked=[False] * len(chunks),
                serial_of=none,
                sent_ns=none.copy(),
            )
        )
        if object_id in self._hints:
            self._transfers[-1].believe(*self._hints.pop(object_id))
        self._transfers.sort(key=lambda t: -t.priority)
        return object_id

    def cancel(self, object_id: int) -> None:
        """Stop sending an object."""
        self._transfers = [t for t in self._transfers if t.object_id != object_id]

    @property
    def busy(self) -> bool:
        """True if any object is unfinished."""
        return bool(self._transfers)

    def progress(self) -> dict[str, tuple[int, int]]:
        """Confirmed chunks and total chunks of each unfinished object, by name."""
        return {t.name: (sum(t.acked), len(t.chunks)) for t in self._transfers}

    def receive(self, payload: bytes, now_ns: int) -> str | None:
        """Process a bitmap; return the object's name if it is complete now, else None. Raises WireError."""
        object_id, echo, flags, base, bits = _bits(payload)
        transfer = next((t for t in self._transfers if t.object_id == object_id), None)
        if transfer is None:
            self._hints.pop(object_id, None)
            self._hints[object_id] = (flags, base, bits)
            if len(self._hints) > _MOST_HINTS:
                del self._hints[next(iter(self._hints))]
            return None
        if not transfer.first < echo <= transfer.serial:
            transfer.believe(flags, base, bits)
            return None
        if flags & COMPLETE:
            self.cancel(object_id)
            return transfer.name
        transfer.known = bool(flags & KNOWN)
        transfer.confirm(echo, base, bits, now_ns)
        return None

    def send(self, now_ns: int, budget_bytes: float) -> list[bytes]:
        """Return chunk payloads whose bytes on the line fit the budget: lost and new chunks, then repair symbols."""
        out: list[bytes] = []
        cost = line_bytes(self._size + CHUNK.size + repair.HEAD_BYTES)
        for step in (_Transfer.next, _Transfer.repeat):
            for transfer in self._transfers:
                while cost <= budget_bytes:
                    payload = step(transfer, now_ns)
                    if payload is None:
                        break
                    out.append(payload)
                    budget_bytes -= line_bytes(len(payload))
        return out


class Product(NamedTuple):
    """A complete object with a verified hash."""

    object_id: int
    name: str
    codec: str
    data: bytes


@dataclass(slots=True)
class _Partial:
    """Transfer of one object, receiver's side. `size`: chunk size, 0 until the announcement came.

    recalled: nothing of it was received since the restart. hints: bitmaps to send though nothing arrives.
    """

    object_id: int
    heard_ns: int
    reported_ns: int = -(1 << 62)
    fresh: bool = True
    echo: int = 0
    chunks: dict[int, bytes] = field(default_factory=dict)
    solver: repair.Solver = field(default_factory=repair.Solver)
    length: int = 0
    size: int = 0
    sha: bytes = b""
    name: str = ""
    codec: str = ""
    complete: bool = False
    recalled: bool = False
    hints: int = 0

    @property
    def count(self) -> int:
        return -(-self.length // self.size) if self.size else 0


class Receiver:
    """Receiver: chunk payloads in, complete objects out; `send` returns bitmaps. payload_limit: of the way back."""

    def __init__(self, payload_limit: int) -> None:
        self._bitmap_bytes = payload_limit - BITMAP.size
        self._partials: dict[int, _Partial] = {}
        self._replaced: dict[int, int] = {}  # object id -> when a newer object of its name replaced it
        self.damaged = 0

    def receive(self, payload: bytes, now_ns: int) -> Product | None:
        """Process a chunk; return the object if it is complete now, else None. Raises WireError."""
        object_id, serial, index = _chunk_head(payload)
        if now_ns - self._replaced.get(object_id, -(1 << 62)) < _TOMBSTONE_NS:
            return None
        announced = _announced(payload[CHUNK.size :]) if index == ANNOUNCEMENT else None
        partial = self._partials.setdefault(object_id, _Partial(object_id, now_ns))
        partial.heard_ns, partial.fresh = now_ns, True
        restarted = announced is not None or partial.recalled or serial + 4096 < partial.echo
        partial.echo = serial if restarted else max(partial.echo, serial)
        partial.recalled = False
        product = self._enter(partial, payload, announced)
        if announced and not partial.complete:
            self._replace(partial, now_ns)
        return product

    def recall(self, payload: bytes, now_ns: int) -> Product | None:
        """Reload a chunk received before a restart of this side, in any order, the newest objects first (rule 5).

        Returns the object if it is complete now; do not use it before it is announced again. Chunks beyond 32 objects
        are ignored. Raises WireError.
        """
        object_id, _, index = _chunk_head(payload)
        announced = _announced(payload[CHUNK.size :]) if index == ANNOUNCEMENT else None
        if object_id not in self._partials and len(self._partials) >= _MOST_RECALLED:
            return None
        partial = self._partials.setdefault(object_id, _Partial(object_id, now_ns, fresh=False, recalled=True))
        return self._enter(partial, payload, announced)

    def hint(self, name: str) -> None:
        """Schedule bitmaps of the two newest objects of this name, because an object of this name is requested."""
        named = sorted((p for p in self._partials.values() if p.name == name), key=lambda p: -p.heard_ns)
        for partial in named[:_HINTED]:
            partial.hints, partial.reported_ns = _HINT_COPIES, -(1 << 62)

    @property
    def hinting(self) -> bool:
        """True if bitmaps are scheduled though nothing arrives."""
        return any(p.hints for p in self._partials.values())

    def _enter(self, partial: _Partial, payload: bytes, announced: Announced | None) -> Product | None:
        _, serial, index = CHUNK.unpack_from(payload)
        body = payload[CHUNK.size :]
        if announced and announced[:3] != (partial.length, partial.size, partial.sha):
            if partial.size:  # another object under the same id: the chunks are not mixed
                partial.chunks, partial.solver, partial.complete = {}, repair.Solver(), False
            partial.length, partial.size, partial.sha, partial.name, partial.codec = announced
            self._adopt(partial)
        if partial.complete:
            return None
        if index == REPAIR:
            symbol = repair.decode(body)
            mask = repair.members(partial.object_id, serial, symbol.base, symbol.span)
            partial.chunks |= partial.solver.add(mask, symbol, partial.chunks)
        elif index != ANNOUNCEMENT and index not in partial.chunks:
            partial.chunks[index] = body
            partial.chunks |= partial.solver.learn(index, body)
        return self._finish(partial)

    def _adopt(self, partial: _Partial) -> None:
        """Copy chunks of the same bytes that came with another chunk size or under another name."""
        for other in self._partials.values():
            if other is partial or (other.sha, other.length) != (partial.sha, partial.length):
                continue
            have = bytearray(other.length + other.size)
            for index, body in other.chunks.items():
                have[index * other.size : index * other.size + len(body)] = body
            for index in range(partial.count):
                begin, end = index * partial.size, min((index + 1) * partial.size, partial.length)
                covers = range(begin // other.size, (end - 1) // other.size + 1)
                if index not in partial.chunks and all(i in other.chunks for i in covers):
                    partial.chunks[index] = bytes(have[begin:end])
                    partial.chunks |= partial.solver.learn(index, partial.chunks[index])

    def _replace(self, newer: _Partial, now_ns: int) -> None:
        for old in list(self._partials.values()):
            if old.name == newer.name and old is not newer and not old.complete:
                del self._partials[old.object_id]
                self._replaced[old.object_id] = now_ns
        self._replaced = {i: t for i, t in self._replaced.items() if now_ns - t < _TOMBSTONE_NS}

    def _finish(self, partial: _Partial) -> Product | None:
        if not partial.size or len(partial.chunks) < partial.count:
            return None
        data = b"".join(partial.chunks.get(i, b"") for i in range(partial.count))[: partial.length]
        if len(data) != partial.length or hashlib.sha256(data).digest() != partial.sha:
            self.damaged += 1
            partial.chunks, partial.solver = {}, repair.Solver()
            return None
        partial.complete, partial.reported_ns = True, -(1 << 62)
        partial.chunks, partial.solver = {}, repair.Solver()
        return Product(partial.object_id, partial.name, partial.codec, data)

    def progress(self) -> dict[str, tuple[int, int]]:
        """Received chunks and total chunks of each announced unfinished object, by name."""
        moving = (p for p in self._partials.values() if p.size and not p.complete and not p.recalled)
        return {p.name: (len(p.chunks), p.count) for p in moving}

    def send(self, now_ns: int) -> list[bytes]:
        """Return due bitmap payloads: every 0.5 s while chunks arrive, otherwise every 5 s."""
        out = []
        for partial in list(self._partials.values()):
            silent_ns = now_ns - partial.heard_ns
            if silent_ns > _GIVE_UP_NS:
                del self._partials[partial.object_id]
                continue
            if partial.hints and now_ns - partial.reported_ns >= _REPORT_NS:
                partial.hints -= 1
                partial.fresh = True
            elif partial.recalled:
                continue
            moving = partial.fresh or (silent_ns < _FRESH_NS and not partial.complete)
            wait_ns = _REPORT_NS if moving else _SLOW_REPORT_NS
            if now_ns - partial.reported_ns < wait_ns or (partial.complete and not partial.fresh):
                continue
            partial.reported_ns, partial.fresh = now_ns, False
            out.append(self._bitmap(partial))
        return out

    def _bitmap(self, partial: _Partial) -> bytes:
        flags = (KNOWN if partial.size else 0) | (COMPLETE if partial.complete else 0)
        base, last = 0, max(partial.chunks, default=-1)
        while base in partial.chunks:
            base += 1
        end = last + 1 if not partial.size else partial.count
        bits = bytearray(max(0, min(self._bitmap_bytes, (end - base + 7) // 8)))
        for index in partial.chunks:
            if 0 <= index - base < 8 * len(bits):
                bits[index - base >> 3] |= 1 << (index - base & 7)
        return BITMAP.pack(partial.object_id, partial.echo, flags, base) + bytes(bits)
