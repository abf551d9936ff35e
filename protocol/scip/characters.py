"""Encoding of numbers at six bits a character, and the sum character of a line."""

from __future__ import annotations

from protocol import WireError


def checksum(line: bytes) -> bytes:
    """The sum character of a line."""
    return bytes(((sum(line) & 0x3F) + 0x30,))


def encode_value(value: int, characters: int) -> bytes:
    """Encode a number in 2, 3 or 4 characters (12, 18, 24 bits). Raises ValueError if it does not fit."""
    if not 0 <= value < 1 << 6 * characters:
        raise ValueError(f"{value} does not fit {characters} characters")
    return bytes((value >> 6 * k & 0x3F) + 0x30 for k in range(characters - 1, -1, -1))


def decode_value(text: bytes) -> int:
    """Decode the number in 2, 3 or 4 characters. Raises WireError("character") outside 0x30 to 0x6F."""
    value = 0
    for character in text:
        if not 0x30 <= character <= 0x6F:
            raise WireError("character", f"byte 0x{character:02x}")
        value = value << 6 | character - 0x30
    return value
