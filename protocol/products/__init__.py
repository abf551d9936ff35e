"""TABLE of products that the rover sends down on request, with the accuracy of each.

Each codec is one file of this folder with both ends: bytes in, arrays out, the same bits on every computer. Data that
cannot be decoded raises WireError("product"); sizes are checked before anything is allocated.
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
    """One product.

    name: name in `get`.
    codec: codec name of the object that is sent down.
    means: text for people.
    error: largest error, text for people.
    """

    name: str
    codec: str
    means: str
    error: str


PRODUCTS = (
    ProductKind(
        "ldem",
        LDEM_CODEC,
        "the map around the rover: heights and node sets of the newest plan",
        "heights at most 1 mm, node sets exact",
    ),
    ProductKind(
        "scan",
        SCAN_CODEC,
        "the newest sweep of the scanner as a range image, with the pose of its entry",
        "ranges at most 1 mm, tilt at most 5 microradians, times at most 0.5 microseconds",
    ),
    ProductKind("nsp", NSP_CODEC, "the newest decision: where next and why, with its scores and alternatives", "exact"),
    ProductKind("record", RECORD_CODEC, "a part of the onboard record by its time, a record of its own", "exact"),
    ProductKind(
        "height_std",
        HEIGHT_STD_CODEC,
        "1 sigma of the heights that each cell of the map was hit at",
        "at most 19 %, from 1 mm on",
    ),
)
PRODUCT_NAMES = tuple(row.name for row in PRODUCTS)
