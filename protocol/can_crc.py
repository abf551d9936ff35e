"""CRC-8 SAE J1850: polynomial 0x1D, start 0xFF, final xor 0xFF, most significant bit first."""


def _entry(value: int) -> int:
    for _ in range(8):
        value = (value << 1) ^ 0x1D if value & 0x80 else value << 1
    return value & 0xFF


TABLE = tuple(_entry(byte) for byte in range(256))
END = tuple(bytes((register ^ 0xFF,)) for register in range(256))  # the checksum's byte by the last register


def crc8(data: bytes, start: int = 0xFF) -> int:
    """The checksum of some bytes; `start` is the register before the first one."""
    register = start
    for byte in data:
        register = TABLE[register ^ byte]
    return register ^ 0xFF


def sound(data: bytes, start: int) -> bool:
    """Whether a frame of 8 bytes ends in the checksum of its other 7. Raises ValueError for another length."""
    t = TABLE
    a, b, c, d, e, f, g, crc = data
    return t[t[t[t[t[t[t[start ^ a] ^ b] ^ c] ^ d] ^ e] ^ f] ^ g] == crc ^ 0xFF


def seed(can_id: int) -> int:
    """The register after the data id, big-endian: where the checksum of a frame's bytes 0 to 6 starts."""
    return crc8(can_id.to_bytes(2, "big")) ^ 0xFF
