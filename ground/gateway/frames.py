"""MAVLink frames: cut from a datagram, checked, decoded and encoded. The common set, as pymavlink defines it.

Only the ground loads the whole common set (12 MB of memory, 0.3 s); the rover has protocol.generated.eldorado_dialect.
"""

from __future__ import annotations

import struct
from typing import Any

from pymavlink.dialects.v20 import common

from protocol import WireError
from protocol.visible import visible

mavlink: Any = common

SYSTEM_ID, COMPONENT_ID = 1, 1  # the rover's, as in onboard/core/telemetry.py
_V1, _V2 = 0xFE, 0xFD
SIGNED = 0x01
SIGNATURE_BYTES = 13
_READER = mavlink.MAVLink(None)  # has no key: it checks lengths and checksums, and stores nothing


def cut(datagram: bytes) -> list[bytes]:
    """Return the whole frames of a datagram, up to the first bytes that are no frame. `decode` checks the checksums."""
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
    """Return whether a frame of `cut` is MAVLink 1."""
    return frame[0] == _V1


def signed(frame: bytes) -> bool:
    """Return whether a frame of `cut` carries a signature."""
    return frame[0] == _V2 and bool(frame[2] & SIGNED)


def decode(frame: bytes) -> Any:
    """Return the message of a frame of `cut`.

    Raises WireError("mavlink"), or "unknown" for a message not in the set.
    """
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
    """Return a text field without trailing zeros, with control characters made visible."""
    raw = getattr(message, f"_{field}_raw", None)
    if raw is None:
        raw = str(getattr(message, field)).encode()
    return visible(bytes(raw).split(b"\0")[0].decode(errors="replace"))


class Writer:
    """Encoder of the rover's frames for one client: numbered, and signed if there is a key."""

    def __init__(self, key: bytes | None = None, link: int = 0) -> None:
        self._mavlink = mavlink.MAVLink(None, srcSystem=SYSTEM_ID, srcComponent=COMPONENT_ID)
        if key is not None:
            self._mavlink.signing.secret_key = key
            self._mavlink.signing.link_id = link
            self._mavlink.signing.sign_outgoing = True

    def write(self, message: Any, stamp: int) -> bytes:
        """Encode one frame.

        stamp: signing time, in 10 us since 2015 UTC; each frame's is above that of the frame before.
        """
        signing = self._mavlink.signing
        signing.timestamp = max(signing.timestamp, stamp)
        frame: bytes = message.pack(self._mavlink)
        self._mavlink.seq = (self._mavlink.seq + 1) % 256
        return frame
