"""The enemy of row `hostile-udp` in its own process: many sockets, no key, recorded datagrams of the station."""

from __future__ import annotations

import socket
import time
from contextlib import ExitStack, suppress
from multiprocessing.connection import Connection
from multiprocessing.sharedctypes import Synchronized
from multiprocessing.synchronize import Event

import numpy as np

from protocol.link.datagrams import KEY_UP
from protocol.link.direct import WORD_BYTES, Word
from tests.bench_link.hostile import Enemy

SEED, PORTS, PER_TURN, FRESH = 1, 400, 200, 21
TURN_S = 0.01  # 20,000 datagrams a second if no turn is late
# First message of a zenoh 1.10 end: 120 of them blocked a listener of zenoh for 7 s.
OPENING = bytes.fromhex("c109f108a8cf041c793302c5d4c806371ede9f0ab004812701")


def run(port: int, ear: Connection, fires: Event, ends: Event, thrown: Synchronized[int]) -> None:
    """Report its own addresses, record what the station sends, and send while `fires` is set."""
    enemy, rng, hellos = Enemy(SEED), np.random.default_rng(SEED), list[bytes]()
    with ExitStack() as stack:
        mine = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(PORTS)]
        for each in mine:
            each.connect(("127.0.0.1", port))
        ear.send([each.getsockname() for each in mine])
        while not ends.is_set():
            while ear.poll():
                data = ear.recv_bytes()
                kept = hellos if data[0] == Word.HELLO else enemy.heard[KEY_UP]
                kept[:] = [*kept[-100:], data]
            if not fires.wait(0.05):
                continue
            due_s = time.monotonic() + TURN_S
            _throw(enemy, rng, hellos, mine, thrown)
            time.sleep(max(0.0, due_s - time.monotonic()))


def _throw(
    enemy: Enemy, rng: np.random.Generator, hellos: list[bytes], mine: list[socket.socket], thrown: Synchronized[int]
) -> None:
    """Send PER_TURN datagrams, a few of them made in this turn."""
    fresh = list(enemy.frames(KEY_UP, FRESH, 1))
    word = bytes([Word.HELLO, thrown.value % 5]) + rng.bytes(WORD_BYTES - 2)
    hello = hellos[-1] if hellos else word
    for number in range(PER_TURN):
        datagram = (OPENING, word, hello, fresh[number % FRESH])[number % 4]
        with suppress(OSError):  # of a rover that has ended
            mine[(thrown.value + number) % PORTS].send(datagram)
    thrown.value += PER_TURN
