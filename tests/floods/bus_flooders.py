"""Surroundings of carrier A: the forwarding node, and intruders on its two endpoints, without the keys.

sessions    1000 connections that send nothing and 100 zenoh sessions; 500 new ones a second, the oldest close
samples     zenoh sessions that put datagrams of 1 kB and samples of 100 kB on every key, towards rover and station
"""

from __future__ import annotations

import socket
import time
from collections import deque
from contextlib import ExitStack, suppress
from itertools import cycle
from multiprocessing.synchronize import Event

import zenoh

from hil.link.emulator import LinkEmulator, run_wall
from hil.link.impairment import Profile
from protocol.link import carrier
from protocol.link.datagrams import KEY_DOWN, KEY_UP

Ports = tuple[int, int]  # the node's, towards rover and station
SILENT, SESSIONS, EVERY_S = 1000, 100, 0.002
LINE = Profile(down_bps=1e9, up_bps=1e9, one_way_s=0.001)


def locator(port: int) -> str:
    """Return the node's address."""
    return f"tcp/127.0.0.1:{port}"


def node(ports: Ports, ends: Event) -> None:
    """Run the node; it forwards everything."""
    with LinkEmulator(LINE, 1, *map(locator, ports)) as emulator:
        run_wall(emulator.turn, lambda _: ends.is_set())


def _session(stack: ExitStack, port: int) -> zenoh.Session:
    config = zenoh.Config()
    for name, text in carrier.settings(connect=locator(port)):
        config.insert_json5(name, text)
    return stack.enter_context(zenoh.open(config))


def sessions(ports: Ports, floods: Event, ends: Event) -> None:
    """Open connections and sessions during the flood; a new one closes the oldest."""
    turn = cycle(ports)
    while not ends.is_set():
        if not floods.wait(0.2):
            continue
        silent, held = deque[socket.socket](), deque[ExitStack]()
        while floods.is_set() and not ends.is_set():
            _connect(silent, next(turn))
            if len(silent) % 10 == 0:
                _open(held, next(turn))
            ends.wait(EVERY_S)
        for each in (*silent, *held):
            with suppress(zenoh.ZError):
                each.close()


def _connect(silent: deque[socket.socket], port: int) -> None:
    if len(silent) == SILENT:
        silent.popleft().close()
    with suppress(OSError):
        silent.append(socket.create_connection(("127.0.0.1", port), timeout=0.05))


def _open(held: deque[ExitStack], port: int) -> None:
    if len(held) == SESSIONS:
        with suppress(zenoh.ZError):
            held.popleft().close()
    held.append(ExitStack())
    with suppress(zenoh.ZError):
        _session(held[-1], port)


def samples(ports: Ports, floods: Event, ends: Event) -> None:
    """Put as many samples a second as the node accepts."""
    with ExitStack() as stack:
        towards = (
            (ports[0], KEY_DOWN),
            (ports[1], KEY_UP),
            (ports[0], carrier.question_key(carrier.ROVER)),
            (ports[1], carrier.question_key(carrier.GROUND)),
        )
        time.sleep(0.5)  # zenoh sends nothing to a key without a subscriber
        puts = [
            _session(stack, port).declare_publisher(key, congestion_control=zenoh.CongestionControl.DROP)
            for port, key in towards
        ]
        while not ends.is_set():
            if not floods.wait(0.2):
                continue
            for put in puts:
                put.put(bytes(100_000))
                for _ in range(100):
                    put.put(bytes(1000))
