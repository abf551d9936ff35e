"""CRC-8 SAE J1850 by fastcrc: polynomial 0x1D, start 0xFF, final xor 0xFF, most significant bit first."""

from fastcrc import crc8 as _algorithms

crc8 = _algorithms.sae_j1850  # (data[, checksum of the bytes before it])
RESIDUE = crc8(bytes(1), 0)  # checksum of any bytes that end in their own checksum


def sound(data: bytes, start: int) -> bool:
    """True if a frame ends in its checksum; `start` is the seed of its CAN id."""
    return crc8(data, start) == RESIDUE


def seed(can_id: int) -> int:
    """Checksum of the data id (the CAN id, big-endian), from which the checksum of bytes 0 to 6 continues."""
    return crc8(can_id.to_bytes(2, "big"))
