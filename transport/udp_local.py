"""Local address of each received datagram, and answers from that address, on a socket bound to all addresses.

Linux gives the address as ancillary data (ip(7) IP_PKTINFO, ipv6(7) IPV6_PKTINFO). Without it the system picks the
source address by the route back. A station behind a connected socket or a firewall asked another address and would
never receive the answer.
"""

from __future__ import annotations

import socket
import struct

from protocol.link.direct import Address

_IP_PKTINFO = 8  # <linux/in.h>; Python has no name for it
_INFO_4, _INFO_6 = struct.Struct("=i4s4s"), struct.Struct("=16si")  # interface, source, destination; address, interface
_ROOM_BYTES = socket.CMSG_SPACE(max(_INFO_4.size, _INFO_6.size))
_KINDS = {socket.AF_INET: (socket.IPPROTO_IP, _IP_PKTINFO, _IP_PKTINFO),
          socket.AF_INET6: (socket.IPPROTO_IPV6, socket.IPV6_RECVPKTINFO, socket.IPV6_PKTINFO)}  # fmt: skip


def prepare(made: socket.socket) -> None:
    """Enable the local address in the results of `received`."""
    level, wanted, _ = _KINDS[made.family]
    made.setsockopt(level, wanted, 1)


def received(source: socket.socket, most: int) -> tuple[bytes, Address, str]:
    """Return a datagram, its sender, and the local address it was sent to; '' if not known. Raises OSError."""
    datagram, beside, _, (host, port, *_) = source.recvmsg(most, _ROOM_BYTES)
    level, _, kind = _KINDS[source.family]
    for its_level, its_kind, data in beside:
        if (its_level, its_kind) == (level, kind):
            v4 = source.family == socket.AF_INET
            address = _INFO_4.unpack(data)[1] if v4 else _INFO_6.unpack(data)[0]
            return datagram, (host, port), socket.inet_ntop(source.family, address)
    return datagram, (host, port), ""


def send(out: socket.socket, datagram: bytes, to: Address, local: str) -> None:
    """Send from this local address; '': from the one that the system picks. Raises OSError."""
    if not local:
        out.sendto(datagram, to)
        return
    level, _, kind = _KINDS[out.family]
    address = socket.inet_pton(out.family, local)
    v4 = out.family == socket.AF_INET
    info = _INFO_4.pack(0, address, bytes(4)) if v4 else _INFO_6.pack(address, 0)
    out.sendmsg([datagram], [(level, kind, info)], 0, to)
