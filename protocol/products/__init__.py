"""TABLE of products: what the rover sends down when asked, and how far off what arrives may be.

Each codec is a file of this folder, both ends in it. Bytes in, arrays out, the same bits wherever they are decoded;
whatever does not decode is WireError("product"), and nothing is allocated on the word of bytes that do not fit.
"""

from __future__ import annotations

from typing import NamedTuple

from protocol.products.height_std import HEIGHT_STD_CODEC
from protocol.products.ldem import LDEM_CODEC as LDEM_CODEC
from protocol.products.ldem import LdemProduct as LdemProduct
from protocol.products.ldem import MapGrid as MapGrid
from protocol.products.ldem import decode_ldem as decode_ldem
from protocol.products.ldem import encode_ldem as encode_ldem
from protocol.products.ldem import poses_of as poses_of
from protocol.products.ldem import rounded as rounded
from protocol.products.nsp import NSP_CODEC
from protocol.products.scan import SCAN_CODEC

RECORD_CODEC = "mcap"


class ProductKind(NamedTuple):
    """One row. codec: of the object that comes down. error: how far off it may be, in words for people."""

    name: str
    codec: str
    means: str
    error: str


PRODUCTS = (
    ProductKind("ldem", LDEM_CODEC, "the map around the rover: heights and node sets of the newest plan",
                "heights at most 1 mm, node sets exact"),
    ProductKind("scan", SCAN_CODEC, "the newest sweep of the scanner as a range image, with the pose of its entry",
                "ranges at most 1 mm, tilt at most 5 microradians, times at most 0.5 microseconds"),
    ProductKind("nsp", NSP_CODEC, "the newest decision: where next and why, with its scores and alternatives",
                "exact"),
    ProductKind("record", RECORD_CODEC, "a part of the onboard record by its time, a record of its own", "exact"),
    ProductKind("height_std", HEIGHT_STD_CODEC, "1 sigma of the heights that each cell of the map was hit at",
                "at most 19 %, from 1 mm on"),
)
PRODUCT_NAMES = tuple(row.name for row in PRODUCTS)
