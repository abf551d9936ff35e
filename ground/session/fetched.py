"""Products on their way down: chunks in, whole objects out, and what a station before this one had heard of them.

    asked(name)       -> the chunks that were kept are taken in, and the rover is told what is there
    receive(payload)  -> a whole product, its SHA-256 checked, or how far each transfer is
    send(now)         -> bitmaps that say what is missing
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ground.session.news import News, ProductHeard, Progress
from protocol import WireError, bulk
from protocol.commands import Telecommand, command
from protocol.link import Keyring, unsealed

_WAKE_NS = 100_000_000
_TAIL_NS = 10_000_000_000
_MOST_BYTES = 4_000_000  # beside the newest of each name; the archive has them all


def product_name(asked: Telecommand) -> str:
    """Name of the product that a request sends; "": none."""
    return str(asked.arguments.get("product") or command(asked.name).sends)


class Fetched:
    """products: whole ones by object id. kept_chunks: what was kept; asked once, when of use. texts: to be told."""

    def __init__(self, limit_bytes: int, keys: Keyring, texts: list[str]) -> None:
        self._bulk, self._keys, self._texts = bulk.Receiver(limit_bytes), keys, texts
        self.products: dict[int, bulk.Product] = {}
        self.kept_chunks: Callable[[], Iterable[bytes]] | None = None
        self._heard_ns: int | None = None
        self._product_ns: dict[int, int] = {}
        self._recalled: dict[int, bulk.Product] = {}  # whole by what was kept; they count once they are announced anew

    @property
    def transfers(self) -> dict[str, tuple[int, int]]:
        """Chunks there and chunks in all of each product that is on its way."""
        return self._bulk.progress()

    def asked(self, name: str, now_ns: int) -> None:
        """A product of this name was asked for."""
        self._recall(now_ns)
        self._bulk.hint(name)

    def newest(self, name: str, since_ns: int) -> bulk.Product | None:
        """The newest whole product of a name that was announced since then."""
        return next((p for p in reversed(self.products.values())
                     if p.name == name and self._product_ns[p.object_id] >= since_ns), None)

    def receive(self, payload: bytes, now_ns: int) -> list[News]:
        """A Kind.BULK_CHUNK payload. Raises WireError."""
        self._recall(now_ns)
        self._heard_ns = now_ns
        product = self._bulk.receive(payload, now_ns)
        object_id, announced = int.from_bytes(payload[:4], "little"), payload[8:10] == b"\xff\xff"
        if announced and object_id in self.products:
            self._product_ns[object_id] = now_ns  # offered again with the same content: nothing is sent twice
        elif announced:
            product = product or self._recalled.pop(object_id, None)
        if product is not None:
            self.products[product.object_id] = product
            self._product_ns[product.object_id] = now_ns
            self._forget()
            return [ProductHeard(now_ns, product)]
        return [Progress(now_ns, name, have, total) for name, (have, total) in self._bulk.progress().items()]

    def send(self, now_ns: int) -> list[bytes]:
        """Payloads of Kind.BULK_BITMAP that are due."""
        return self._bulk.send(now_ns)

    def next_due_ns(self, now_ns: int) -> int | None:
        """When `send` may have something again; None: not before something was heard."""
        tail = self._heard_ns is not None and now_ns - self._heard_ns < _TAIL_NS
        if self._bulk.progress() or self._bulk.hinting or tail:
            return (now_ns // _WAKE_NS + 1) * _WAKE_NS
        return None

    def _recall(self, now_ns: int) -> None:
        """Takes in the bulk chunks that this station heard before it was restarted, the newest first, once.

        What is damaged or of another rover is told in one line and dropped; of the rest a transfer goes on.
        """
        ask, self.kept_chunks = self.kept_chunks, None
        if ask is None:
            return
        useless, damaged = 0, self._bulk.damaged
        for datagram in ask():
            try:
                whole = self._bulk.recall(unsealed(self._keys, datagram), now_ns)
            except WireError:
                useless += 1
                continue
            if whole is not None:
                self._recalled[whole.object_id] = whole
        if useless or self._bulk.damaged > damaged:
            lost = self._bulk.damaged - damaged
            self._texts.append(f"of the parts of products that were kept {useless} are damaged or of another rover, "
                               f"and {lost} products did not fit their SHA-256: these come anew")

    def _forget(self) -> None:
        newest = {p.name: p.object_id for p in self.products.values()}
        older = [p for p in self.products.values() if p.object_id not in newest.values()]
        excess = sum(len(p.data) for p in older) - _MOST_BYTES
        for product in older:
            if excess <= 0:
                break
            excess -= len(product.data)
            del self.products[product.object_id], self._product_ns[product.object_id]
