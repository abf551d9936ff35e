"""Door of the products: map, scan, decision, record and path from a rover or a holder of the downlink key."""

from __future__ import annotations

import io
import json
import struct
from contextlib import suppress
from functools import cache

import numpy as np
from mcap.writer import Writer

from ground.cli.operations.show import news_json, news_line
from ground.gateway.desks.parameters import Mirror
from ground.link.news import ProductHeard
from ground.products import files, preview
from ground.products.preview import NoMapError
from onboard.config import Config
from onboard.parameters import ParameterSet, listing
from protocol import WireError
from protocol.link.bulk import Product
from protocol.products import LdemProduct, MapGrid, encode_ldem, ldem, scan
from protocol.products.nsp import Candidate, Explanation, encode_nsp
from protocol.products.packing import compress, pack_integers
from protocol.products.pose_map import PoseMap, encode_poses
from protocol.products.scan import ScanProduct, encode_scan
from protocol.visible import visible, visible_lines
from tests.fuzz.damage import Rng, real, whole
from tests.fuzz.door import Door

_WAY = {"station": 1, "request_id": 3, "kind": "goal", "rule": "R4", "reason": "why", "length_m": 7.27, "time_s": 171.0,
        "looks": 3, "path": [[0.0, 0.0, 0.0], [6.0, 1.5, 0.1]], "beyond": [[8.0, 2.0]]}  # fmt: skip
_ROWS, _COLUMNS = 7, 9


@cache
def samples() -> dict[str, tuple[bytes, ...]]:
    """Return sound bytes of each product."""
    rng = np.random.default_rng(1)
    heights = rng.normal(0, 0.1, (_ROWS, _COLUMNS)).astype(np.float32)
    heights[2, 3:5] = np.nan
    bare = encode_ldem(
        LdemProduct(MapGrid(-0.4, -0.3, 0.1, _ROWS, _COLUMNS), heights, np.full(heights.shape, 3, np.uint8))
    )
    poses = PoseMap(rng.integers(0, 3, (8, _ROWS, _COLUMNS)).astype(np.uint8), (0.0, 0.0, 0.1), ((0.1, 0.2),))
    lines, beams = 6, 11
    status = (rng.random((lines, beams)) < 0.2).astype(np.uint8)
    start_ns = 4_000_000_000 + 25_000_000 * np.arange(lines, dtype=np.int64)
    tilt_ns = 3_990_000_000 + 5_000_000 * np.arange(40, dtype=np.int64)
    sweep = ScanProduct(
        3,
        -1.1,
        0.2,
        np.where(status == 0, 2.0, np.nan).astype(np.float32),
        status,
        start_ns,
        np.full(lines, 17361.0),
        tilt_ns,
        np.linspace(1.0, -0.3, 40),
        np.eye(4),
        np.eye(4),
    )
    told = Explanation(
        2,
        (1.0, 2.0, 0.5),
        (12.0, 3.0),
        (4.0, 2.5, 0.7),
        3.2,
        (1.0, 0.5),
        "explore",
        "drive",
        "R10",
        "the way shrinks",
        341,
        400,
        (Candidate(1, 2, *[0.5] * 9),),
        {"not free": 50},
    )
    record = io.BytesIO()
    writer = Writer(record)
    writer.start()
    channel = writer.register_channel("/out/event", "json", writer.register_schema("e", "jsonschema", b"{}"))
    writer.add_message(channel, 5, b"[]", 5)
    writer.finish()
    return {
        "ldem": (bare + encode_poses(poses), bare),
        "scan": (encode_scan(sweep),),
        "nsp": (encode_nsp(told),),
        "record": (record.getvalue(),),
        "way": (json.dumps(_WAY).encode(),),
        "parameters": (listing(ParameterSet(Config())).encode()[:3000],),
    }


def _hostile_ldem(rng: Rng) -> bytes:
    """Return a head and parts that fit each other, with any numbers in them."""
    planes, cells = int(rng.integers(1, 5)), _ROWS * _COLUMNS
    parts = [compress(rng.bytes(n)) for n in (planes * cells, (cells + 7) // 8)]
    parts.append(compress(rng.integers(0, 5, cells, np.uint8).tobytes()))
    head = ldem._HEAD.pack(b"LDM1", _ROWS, _COLUMNS, *(real(rng) for _ in range(5)), planes, *map(len, parts))
    poses = PoseMap(
        rng.integers(0, 3, (8, _ROWS, _COLUMNS)).astype(np.uint8),
        (real(rng), real(rng), real(rng)),
        ((real(rng) % 1e30, 0.0),),
    )
    return head + b"".join(parts) + encode_poses(poses)


def _hostile_scan(rng: Rng) -> bytes:
    lines, beams, samples = int(rng.integers(1, 6)), int(rng.integers(1, 12)), int(rng.integers(0, 9))
    status = rng.integers(0, 2, (lines, beams), np.uint8) * rng.integers(0, 256, (lines, beams), np.uint8)
    known = int((status == 0).sum())
    beam_ns = np.array([real(rng) for _ in range(lines)])
    parts = [
        compress(status.tobytes()),
        pack_integers(whole(rng, known)),
        pack_integers(whole(rng, lines)),
        compress(beam_ns.tobytes()),
        pack_integers(whole(rng, samples)),
        pack_integers(whole(rng, samples)),
    ]
    head = scan._HEAD.pack(b"SCN1", 3, lines, beams, samples, *(real(rng) for _ in range(27)), *map(len, parts))
    return head + b"".join(parts)


_HOSTILE = {"ldem": _hostile_ldem, "scan": _hostile_scan}


def use(name: str, data: bytes) -> None:
    """Use a product as the station does. Raises WireError or the station's own error if it cannot."""
    heard = ProductHeard(0, Product(1, name, "codec", data))
    assert visible(news_line(heard)) == news_line(heard)
    json.loads(news_json(heard))
    if name == "parameters":
        _parameters(data)
        return
    for (product, _), write in files._FORMATS.items():
        if product == name:
            assert visible_lines(write(data).holds) == write(data).holds
    if name == "ldem":
        seen = preview._map(data, "here")
        preview.look_ahead(seen, (0.5, 0.3), None, Config())


def _parameters(data: bytes) -> None:
    text = data.decode(errors="replace")
    mirror = Mirror()
    mirror.fill(text)
    for message in mirror.messages():
        struct.pack("<f", message.param_value)
    (plain, *_) = samples()["ldem"]
    preview.fetched(preview._map(plain, "here"), data)


def _made(rng: Rng) -> bytes:
    """Return the number of a product, then its bytes, sound or hostile."""
    names = list(samples())
    number = int(rng.integers(0, len(names)))
    name = names[number]
    sound = samples()[name][int(rng.integers(0, len(samples()[name])))]
    return bytes([number]) + (_HOSTILE[name](rng) if name in _HOSTILE and rng.random() < 0.5 else sound)


def _feed(data: bytes) -> None:
    names = list(samples())
    with suppress(WireError, NoMapError):
        use(names[(data[0] if data else 0) % len(names)], data[1:])


PRODUCTS = Door(_made, _feed)
