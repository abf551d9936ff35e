"""MAVLink frames: cut out of a datagram, checked and decoded, and made. The common set, as pymavlink has it.

Only the ground knows the whole common set (12 MB of memory, 0.3 s to load): the rover keeps protocol.eldorado_dialect.
"""

from __future__ import annotations

import struct
from typing import Any

from pymavlink.dialects.v20 import common

from protocol import WireError
from protocol.visible import visible

mavlink: Any = common

SYSTEM_ID, COMPONENT_ID = 1, 1  # the rover's, as onboard/core/telemetry.py has it
_V1, _V2 = 0xFE, 0xFD
SIGNED = 0x01
SIGNATURE_BYTES = 13
_READER = mavlink.MAVLink(None)  # holds no key: it checks lengths and checksums, and keeps nothing of what it reads


def cut(datagram: bytes) -> list[bytes]:
    """The whole frames in a datagram; what is no frame ends it. Checksums are `decode`'s business."""
    frames, at = [], 0
    while at + 8 <= len(datagram):
        if datagram[at] == _V2:
            length = 12 + datagram[at + 1] + (SIGNATURE_BYTES if datagram[at + 2] & SIGNED else 0)
        elif datagram[at] == _V1:
            length = 8 + datagram[at + 1]
        else:
            break
        if at + length > len(datagram):
            break
        frames.append(datagram[at : at + length])
        at += length
    return frames


def first(frame: bytes) -> bool:
    """Whether a frame of `cut` is of MAVLink 1."""
    return frame[0] == _V1


def signed(frame: bytes) -> bool:
    """Whether a frame of `cut` carries a signature."""
    return frame[0] == _V2 and bool(frame[2] & SIGNED)


def decode(frame: bytes) -> Any:
    """The message of a frame of `cut`. Raises WireError("mavlink"), or "unknown" where it is not of the set."""
    if frame[0] == _V2 and frame[2] & ~SIGNED:
        raise WireError("mavlink", f"incompatibility flags {frame[2]:#x}")
    try:
        message = _READER.decode(bytearray(frame))
    except (mavlink.MAVError, struct.error, ValueError) as error:
        raise WireError("mavlink", str(error)) from error
    if isinstance(message, mavlink.MAVLink_unknown):
        raise WireError("unknown")  # its checksum cannot be checked
    return message


def text_of(message: Any, field: str) -> str:
    """A text field, without the zeros behind it, control characters visible."""
    raw = getattr(message, f"_{field}_raw", None)
    if raw is None:
        raw = str(getattr(message, field)).encode()
    return visible(bytes(raw).split(b"\0")[0].decode(errors="replace"))


class Writer:
    """Messages in, frames of the rover out; numbered for one client, signed where there is a key."""

    def __init__(self, key: bytes | None = None, link: int = 0) -> None:
        self._mavlink = mavlink.MAVLink(None, srcSystem=SYSTEM_ID, srcComponent=COMPONENT_ID)
        if key is not None:
            self._mavlink.signing.secret_key = key
            self._mavlink.signing.link_id = link
            self._mavlink.signing.sign_outgoing = True

    def write(self, message: Any, stamp: int) -> bytes:
        """One frame. stamp: signing time, 10 us since 2015 in UTC; a frame's is always above the last one's."""
        signing = self._mavlink.signing
        signing.timestamp = max(signing.timestamp, stamp)
        frame: bytes = message.pack(self._mavlink)
        self._mavlink.seq = (self._mavlink.seq + 1) % 256
        return frame
