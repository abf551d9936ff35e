"""Safe reader of untrusted .npz arrays: no pickles, no more bytes unpacked than the caller allows.

numpy's own reader allocates the array that a header requests before it checks whether the bytes exist, and unpacks more
than a zip's directory declares. Here a member is unpacked up to its limit, its header is read, and the array is built
from bytes that exist.
"""

from __future__ import annotations

import ast
import io
import math
import re
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

_HEADER_BYTES = 4096
_MEMBER, _MOST_MEMBERS = b"PK\x01\x02", 1000  # first bytes of a member's row in the zip's directory
_BROKEN = (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError, UnicodeError)
_HEAD = re.compile(rb"\x93NUMPY\x01\x00(..)", re.DOTALL)
_DESCR = re.compile(r"[<>=|]?[biufUS?]\d{0,6}")


class ArraySpec(NamedTuple):
    """Specification of one array.

    kinds: kinds of its numbers (numpy's letters).
    axes: number of axes.
    most_side: most cells along an axis.
    most_bytes: most bytes.
    """

    kinds: str
    axes: int
    most_side: int
    most_bytes: int


NUMBER = ArraySpec("iuf", 0, 0, 64)


def read_arrays(data: bytes, wanted: Mapping[str, ArraySpec]) -> dict[str, NDArray[Any]]:
    """Read the arrays by name. Raises ValueError, one line, for bytes that do not contain each of them as specified."""
    _refuse_a_crowd(data)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as file:
            names = set(file.namelist())
            missing = [name for name in wanted if f"{name}.npy" not in names]
            if missing:
                raise ValueError(f"`{missing[0]}` is missing")
            return {name: _array(name, _unpacked(file, name, row.most_bytes), row) for name, row in wanted.items()}
    except _BROKEN as error:
        raise ValueError(f"not a whole .npz: {' '.join(str(error).split())[:120]}") from None


def check_size(data: bytes, most_bytes: int) -> None:
    """Check an .npz before numpy's own reader gets it. Raises ValueError if it is none, or unpacks to more bytes."""
    _refuse_a_crowd(data)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as file:
            size = sum(member.file_size for member in file.infolist())
    except _BROKEN as error:
        raise ValueError(f"not a whole .npz: {' '.join(str(error).split())[:120]}") from None
    if size > most_bytes:
        raise ValueError(f"unpacks to {size} bytes, of {most_bytes} at most")


def _refuse_a_crowd(data: bytes) -> None:
    if data.count(_MEMBER) > _MOST_MEMBERS:  # zipfile builds an object for each, minutes and gigabytes for millions
        raise ValueError(f"has more than {_MOST_MEMBERS} members")


def _unpacked(file: zipfile.ZipFile, name: str, most_bytes: int) -> bytes:
    most_bytes += _HEADER_BYTES
    told = file.getinfo(f"{name}.npy")
    if told.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError(f"`{name}` is packed in a way that numpy does not write")
    if told.file_size > most_bytes:
        raise ValueError(f"`{name}` has {told.file_size} bytes, of {most_bytes} at most")
    with file.open(told) as member:
        return member.read(most_bytes + 1)


def _array(name: str, data: bytes, wanted: ArraySpec) -> NDArray[Any]:
    shape, kind, by_columns, at = _header(name, data)
    if kind.kind not in wanted.kinds or len(shape) != wanted.axes or max(shape, default=0) > wanted.most_side:
        sides = f" up to {wanted.most_side} a side" if wanted.axes else ""
        raise ValueError(f"`{name}` is {kind} of shape {shape}; expected {wanted.axes} axes{sides} of {wanted.kinds}")
    size = math.prod(shape) * kind.itemsize
    if len(data) - at != size or size > wanted.most_bytes:
        raise ValueError(f"`{name}` has {len(data) - at} bytes for {size}, of {wanted.most_bytes} at most")
    flat: NDArray[Any] = np.frombuffer(data, kind, offset=at)
    return flat.reshape(shape, order="F" if by_columns else "C")


def _header(name: str, data: bytes) -> tuple[tuple[int, ...], np.dtype[Any], bool, int]:
    """Shape, dtype, True for column order, and offset of the numbers: version 1.0, as numpy.save writes."""
    head = _HEAD.match(data)
    at = 10 + int.from_bytes(head[1], "little") if head else 0
    if not 10 < at <= min(_HEADER_BYTES, len(data)):
        raise ValueError(f"`{name}` is no .npy of version 1.0")
    try:
        row = ast.literal_eval(data[10:at].decode("latin-1").strip())
        shape, descr, by_columns = row["shape"], row["descr"], row["fortran_order"]
        sides_right = isinstance(shape, tuple) and all(type(side) is int and 0 <= side < 2**31 for side in shape)
        if not (sides_right and isinstance(descr, str) and _DESCR.fullmatch(descr)):
            raise ValueError
        return shape, np.dtype(descr), bool(by_columns), at
    except (ValueError, SyntaxError, TypeError, KeyError, MemoryError, RecursionError):
        raise ValueError(f"`{name}` has a header that is none of numbers in rows") from None
