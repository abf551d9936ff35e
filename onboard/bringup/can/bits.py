"""Length of a CAN frame on the wire: its bits with the stuff bits, exact and worst case.

SOF  id 11  RTR IDE r0  DLC 4  data 0-64  CRC 15 | CRC del.  ACK 2  EOF 7  space 3
\\-------------- after 5 equal bits a stuff bit --/ \\---------- 13, no stuffing --/
"""

from __future__ import annotations

_CRC15 = 0x4599
_TAIL = 13


def worst_bits(data_bytes: int) -> int:
    """Bits of a standard data frame with the most stuff bits, interframe space included (Davis 2007, Eq. 1)."""
    exposed = 34 + 8 * data_bytes
    return exposed + _TAIL + (exposed - 1) // 4


def wire_bits(can_id: int, data: bytes) -> int:
    """Bits of this standard data frame on the wire, interframe space included."""
    length = 19 + 8 * len(data)
    word = (can_id & 0x7FF) << 7 + 8 * len(data) | len(data) << 8 * len(data) | int.from_bytes(data, "big")
    bits = [word >> at & 1 for at in range(length - 1, -1, -1)]
    crc = 0
    for bit in bits:
        crc = ((crc << 1) ^ _CRC15 if bit ^ crc >> 14 else crc << 1) & 0x7FFF
    bits += [crc >> at & 1 for at in range(14, -1, -1)]
    return len(bits) + _stuffed(bits) + _TAIL


def _stuffed(bits: list[int]) -> int:
    """Number of stuff bits: the opposite bit follows five equal bits and counts as the first of the next run."""
    count, last, run = 0, -1, 0
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            count, last, run = count + 1, 1 - bit, 1
    return count
