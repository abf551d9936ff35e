"""The rover's surroundings on the wall clock, a process each: bus, scanner, intruders without the keys; each can flood.

bus         a socketcand gateway with the seven nodes on a stand; floods with frames of a thousand ids
scanner     a TCP server; floods with line feeds
datagrams   a UDP socket; floods with forged commands
hellos      1000 UDP sockets of 250 addresses; each asks for a place, with hellos and with openings of zenoh
huge        a UDP socket; floods with datagrams of 64 kB
disk        fills a disk, and takes any space that becomes free
"""

from __future__ import annotations

import os
import secrets
import select
import socket
import time
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.sharedctypes import Synchronized
from multiprocessing.synchronize import Event
from pathlib import Path

from hil.devices.can.hub import CanHub
from hil.devices.can.wheels_off_ground import TICK_NS, Stand
from onboard.records import Frame
from protocol.link.datagrams import DatagramKind, Sealer
from protocol.link.direct import WORD_BYTES, Word

SPAWN = get_context("spawn")
FLOOD_FRAMES = [Frame(0x100 + n, bytes(8)) for n in range(1000)]
FEEDS = b"\n" * 65_536
PLACES = 1000  # sockets that each ask for a place at the rover
# First message of a zenoh 1.10 end: 120 of them blocked a listener of zenoh for 7 s.
OPENING = bytes.fromhex("c109f108a8cf041c793302c5d4c806371ede9f0ab004812701")


def bus(port: int, floods: Event, ends: Event, fastest_radps: Synchronized[float]) -> None:
    """Run the bus. fastest_radps: rate of the fastest wheel."""
    hub, stand = CanHub(port=port), Stand()
    begun_ns, now_ns = time.monotonic_ns(), 0
    while not ends.is_set():
        now_ns += TICK_NS
        while (left_ns := begun_ns + now_ns - time.monotonic_ns()) > 0:
            hub.wait(left_ns / 1e9)
        hub.write(stand.step(hub.read(now_ns), now_ns))
        if floods.is_set():
            hub.write(FLOOD_FRAMES)
        fastest_radps.value = max(abs(drive.rate_radps) for drive in stand.nodes.drives())
    hub.close()


def scanner(port: int, floods: Event, ends: Event) -> None:
    """Run the scanner, which answers nothing."""
    with socket.create_server(("127.0.0.1", port)) as server:
        server.settimeout(0.2)
        while not ends.is_set():
            try:
                rover, _ = server.accept()
            except TimeoutError:
                continue
            with rover:
                _speak(rover, floods, ends)


def _speak(rover: socket.socket, floods: Event, ends: Event) -> None:
    rover.setblocking(False)
    while not ends.is_set():
        readable, writable, _ = select.select([rover], [rover] if floods.is_set() else [], [], 0.05)
        try:
            if readable and not rover.recv(65_536):
                return
            if writable:
                rover.send(FEEDS)
        except BlockingIOError:
            continue
        except OSError:
            return


def datagrams(port: int, floods: Event, ends: Event) -> None:
    """Send as many as this machine can."""
    sealer = Sealer(bytes(32), 1, 1)
    forged = [sealer.seal(DatagramKind.TELECOMMAND, bytes(40)) for _ in range(1000)]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        while not ends.is_set():
            if not floods.wait(0.2):
                continue
            for datagram in forged:
                with suppress(OSError):
                    out.sendto(datagram, ("127.0.0.1", port))


def hellos(port: int, floods: Event, ends: Event) -> None:
    """Send as many as this machine can, from addresses 127.0.1.1 to 127.0.1.250."""
    mine = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(PLACES)]
    for number, each in enumerate(mine):
        each.bind((f"127.0.1.{1 + number % 250}", 0))
    while not ends.is_set():
        if not floods.wait(0.2):
            continue
        for number, each in enumerate(mine):
            hello = bytes([Word.HELLO, number % 3]) + secrets.token_bytes(WORD_BYTES - 2)
            for datagram in (hello, OPENING):
                with suppress(OSError):
                    each.sendto(datagram, ("127.0.0.1", port))
    for each in mine:
        each.close()


def huge(port: int, floods: Event, ends: Event) -> None:
    """Send datagrams of the greatest length."""
    datagram = bytes(65_507)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        while not ends.is_set():
            if not floods.wait(0.2):
                continue
            for _ in range(100):
                with suppress(OSError):
                    out.sendto(datagram, ("127.0.0.1", port))


def disk(folder: Path, floods: Event, ends: Event) -> None:
    """Fill the disk to the last byte during the flood."""
    with (folder / "others").open("wb", buffering=0) as others:
        while not ends.is_set():
            if not floods.wait(0.2):
                if others.tell():
                    others.seek(0)
                    others.truncate()
                continue
            for size in (1 << 20, 4096, 1):
                with suppress(OSError):
                    while True:
                        others.write(bytes(size))
            ends.wait(0.005)
        os.ftruncate(others.fileno(), 0)
