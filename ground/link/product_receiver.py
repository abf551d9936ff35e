"""Reception of products: chunks in, whole objects out, including chunks received before a restart of the station.

asked(name)       -> loads the chunks from the archive and reports them to the rover
receive(payload)  -> a whole product, its SHA-256 checked, or the progress of each transfer
send(now)         -> bitmaps of the missing chunks
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ground.link.news import News, ProductHeard, Progress
from protocol import WireError
from protocol.link import bulk
from protocol.link.datagrams import Keyring, unsealed
from protocol.tables.commands import Telecommand, command

_WAKE_NS = 100_000_000
_TAIL_NS = 10_000_000_000
_MOST_BYTES = 4_000_000  # limit next to the newest of each name; the archive has them all


def product_name(asked: Telecommand) -> str:
    """Return the name of the product that a request sends; "": none."""
    return str(asked.arguments.get("product") or command(asked.name).sends)


class ProductReceiver:
    """Receiver of products.

    products: whole ones by object id.
    kept_chunks: returns the datagrams stored before a restart; called once, at first need.
    texts: messages for people are appended here.
    """

    def __init__(self, limit_bytes: int, keys: Keyring, texts: list[str]) -> None:
        self._bulk, self._keys, self._texts = bulk.Receiver(limit_bytes), keys, texts
        self.products: dict[int, bulk.Product] = {}
        self.kept_chunks: Callable[[], Iterable[bytes]] | None = None
        self._heard_ns: int | None = None
        self._product_ns: dict[int, int] = {}
        # complete from stored chunks; they count once the rover announces them again
        self._recalled: dict[int, bulk.Product] = {}

    @property
    def transfers(self) -> dict[str, tuple[int, int]]:
        """Present and total number of chunks of each product in transfer."""
        return self._bulk.progress()

    def asked(self, name: str, now_ns: int) -> None:
        """Prepare for a product of this name, which was requested."""
        self._recall(now_ns)
        self._bulk.hint(name)

    def newest(self, name: str, since_ns: int) -> bulk.Product | None:
        """Return the newest whole product of a name announced since `since_ns`; None if there is none."""
        return next(
            (
                p
                for p in reversed(self.products.values())
                if p.name == name and self._product_ns[p.object_id] >= since_ns
            ),
            None,
        )

    def receive(self, payload: bytes, now_ns: int) -> list[News]:
        """Process a Kind.BULK_CHUNK payload. Raises WireError."""
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
        """Return the Kind.BULK_BITMAP payloads that are due."""
        return self._bulk.send(now_ns)

    def next_due_ns(self, now_ns: int) -> int | None:
        """Return the time at which `send` may be due; None: not before the next reception."""
        tail = self._heard_ns is not None and now_ns - self._heard_ns < _TAIL_NS
        if self._bulk.progress() or self._bulk.hinting or tail:
            return (now_ns // _WAKE_NS + 1) * _WAKE_NS
        return None

    def _recall(self, now_ns: int) -> None:
        """Load the chunks that this station received before its restart, the newest first, once.

        Chunks that are damaged or from another rover are dropped, with one line for people. The rest continues its
        transfer.
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
            self._texts.append(
                f"of the parts of products that were kept {useless} are damaged or of another rover, "
                f"and {lost} products did not fit their SHA-256: these are sent again"
            )

    def _forget(self) -> None:
        newest = {p.name: p.object_id for p in self.products.values()}
        older = [p for p in self.products.values() if p.object_id not in newest.values()]
        excess = sum(len(p.data) for p in older) - _MOST_BYTES
        for product in older:
            if excess <= 0:
                break
            excess -= len(product.data)
            del self.products[product.object_id], self._product_ns[product.object_id]
