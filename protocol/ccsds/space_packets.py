"""CCSDS space packets (133.0-B-2) and their time code (301.0-B-4): encoder, decoder and stream splitter.

    primary header, 6 B, big-endian    version 3 bit | type 1 | secondary header 1 | APID 11
                                       sequence flags 2 (3: whole) | sequence count 14
                                       length of what follows, minus 1, 16
    secondary header of telemetry      P-field u8 = 0x2F, CUC of an agency's epoch with 4 + 3 octets:
                                       seconds u32, fraction u24 in 2**-24 s; then the boot id u32

The epoch is the start of the flight program, identified by the boot id: onboard time, as everywhere in this project.
One fraction is 60 ns, so the error of a time is at most 30 ns.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from protocol import WireError

TELEMETRY, TELECOMMAND = 0, 1
HEAD = struct.Struct(">HHH")
STAMP = struct.Struct(">BIBHI")
P_FIELD = 0b0_010_11_11
MOST_BYTES = HEAD.size + 65536
_WHOLE = 3
_FRACTIONS = 1 << 24
_NS = 1_000_000_000


class Packet(NamedTuple):
    """One packet without its primary header.

    kind: TELEMETRY or TELECOMMAND.
    apid: application process id, 11 bits.
    sequence: sequence count of its APID, modulo 16384.
    data: the packet's data field.
    secondary: True if the data begins with a secondary header.
    """

    kind: int
    apid: int
    sequence: int
    data: bytes
    secondary: bool = False


def encode(packet: Packet) -> bytes:
    """Encode a packet. Raises ValueError if it has no data or more than 65536 B."""
    if not 0 < len(packet.data) <= 65536:
        raise ValueError(f"a packet of {len(packet.data)} B of data")
    first = packet.kind << 12 | packet.secondary << 11 | packet.apid
    return HEAD.pack(first, _WHOLE << 14 | packet.sequence & 0x3FFF, len(packet.data) - 1) + packet.data


def decode(raw: bytes) -> Packet:
    """Decode a whole packet. Raises WireError("packet") for another version, a segment or a wrong length."""
    if len(raw) <= HEAD.size:
        raise WireError("packet", f"{len(raw)} B are no space packet")
    first, second, length = HEAD.unpack_from(raw)
    if first >> 13:
        raise WireError("packet", f"version {first >> 13} of space packets")
    if second >> 14 != _WHOLE:
        raise WireError("packet", "a segment of a packet: whole ones are taken")
    if len(raw) != HEAD.size + length + 1:
        raise WireError("packet", f"{len(raw)} B instead of {HEAD.size + length + 1}")
    return Packet(first >> 12 & 1, first & 0x7FF, second & 0x3FFF, raw[HEAD.size :], bool(first >> 11 & 1))


def stamp(onboard_ns: int, boot_id: int) -> bytes:
    """Encode the secondary header."""
    fractions = (onboard_ns * _FRACTIONS + _NS // 2) // _NS
    seconds, fraction = divmod(fractions, _FRACTIONS)
    return STAMP.pack(P_FIELD, seconds & 0xFFFFFFFF, fraction >> 16, fraction & 0xFFFF, boot_id)


class Splitter:
    """Splitter of a byte stream into packets; pieces may have any size."""

    def __init__(self) -> None:
        self._held = bytearray()

    def receive(self, data: bytes) -> list[bytes]:
        """Return the packets that are complete now.

        Raises WireError("packet") where no packet can begin; no packet is found after that.
        """
        self._held += data
        found = []
        while len(self._held) >= HEAD.size:
            first, _, length = HEAD.unpack_from(self._held)
            if first >> 13:
                raise WireError("packet", f"version {first >> 13} of space packets")
            size = HEAD.size + length + 1
            if len(self._held) < size:
                break
            found.append(bytes(self._held[:size]))
            del self._held[:size]
        return found
