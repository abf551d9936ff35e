"""Row `hostile`: 100,000 frames of an enemy without the keys, while genuine commands pass."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from onboard.drivers.link.port import checked
from protocol.link.datagrams import DOWNLINK_KEY_ID, KEY_DOWN, KEY_UP, MAX_JUMP, DatagramKind, Keyring, Sealer
from protocol.link.transactions import RequestState
from tests.bench_link.asked import P95_RTT
from tests.bench_link.figures import Figure, Told, count, quantile
from tests.bench_link.world import KEYS, STATION, World, profile

FRAMES, PER_TICK = 100_000, 20
LINK = profile("moon", loss=0.1)
_COMMAND_EVERY_S = 1.0


class Enemy:
    """Source of frames that must be refused, of all kinds in turn. heard: frames it recorded, in each direction."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self.heard: dict[str, list[bytes]] = {KEY_UP: [], KEY_DOWN: []}
        self._turn = 0

    def frames(self, towards: str, count: int, boot_id: int) -> Iterator[bytes]:
        for _ in range(count):
            self._turn += 1
            seen = self.heard[towards]
            makers = (
                self._noise,
                self._forged,
                self._bent,
                self._short,
                self._long,
                self._crossed,
                self._replayed,
                self._old_epoch,
                self._wrong_boot,
                self._far_counter,
            )
            maker = makers[self._turn % len(makers)]
            yield maker(towards, boot_id) if seen else self._noise(towards, boot_id)

    def _noise(self, towards: str, boot_id: int) -> bytes:
        return self._rng.bytes(int(self._rng.integers(0, 1300)))

    def _forged(self, towards: str, boot_id: int) -> bytes:
        """Return a frame that is right in all but the key."""
        return Sealer(bytes(32), _sender(towards), boot_id, counter=self._turn).seal(
            DatagramKind.TELECOMMAND, bytes(40)
        )

    def _bent(self, towards: str, boot_id: int) -> bytes:
        frame = bytearray(self._pick(towards))
        frame[int(self._rng.integers(len(frame)))] ^= 1 << int(self._rng.integers(8))
        return bytes(frame)

    def _short(self, towards: str, boot_id: int) -> bytes:
        frame = self._pick(towards)
        return frame[: int(self._rng.integers(len(frame)))]

    def _long(self, towards: str, boot_id: int) -> bytes:
        return self._pick(towards) + self._rng.bytes(int(self._rng.integers(1, 900)))

    def _crossed(self, towards: str, boot_id: int) -> bytes:
        other = self.heard[KEY_DOWN if towards == KEY_UP else KEY_UP]
        return other[int(self._rng.integers(len(other)))] if other else self._noise(towards, boot_id)

    def _replayed(self, towards: str, boot_id: int) -> bytes:
        return self._pick(towards)

    def _old_epoch(self, towards: str, boot_id: int) -> bytes:
        """Return a frame under the key of a past epoch."""
        return self._genuine_key(towards, epoch=9).seal(DatagramKind.TELECOMMAND, bytes(40))

    def _wrong_boot(self, towards: str, boot_id: int) -> bytes:
        """Return a frame sealed for the boot before."""
        return self._genuine_key(towards, boot_id=boot_id - 1).seal(DatagramKind.TELECOMMAND, bytes(40))

    def _far_counter(self, towards: str, boot_id: int) -> bytes:
        return self._genuine_key(towards, boot_id=boot_id, counter=4 * MAX_JUMP).seal(
            DatagramKind.TELECOMMAND, bytes(40)
        )

    def _genuine_key(self, towards: str, boot_id: int = 1, counter: int = 1 << 40, epoch: int = 0) -> Sealer:
        ring: Keyring = KEYS.command if towards == KEY_UP else KEYS.downlink
        key = ring.key(_sender(towards), epoch)
        assert key is not None
        return Sealer(key, _sender(towards), boot_id, counter=counter, epoch=epoch)

    def _pick(self, towards: str) -> bytes:
        seen = self.heard[towards]
        return seen[int(self._rng.integers(len(seen)))]


def _sender(towards: str) -> int:
    return STATION if towards == KEY_UP else DOWNLINK_KEY_ID


class Besieged(World):
    """A world in which the enemy sends to both ends in every tick."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.enemy, self.thrown, self.accepted = Enemy(self.seed), 0, 0
        self.per_tick = 0

    def _take_up(self, now_ns: int) -> list[bytes]:
        arrived = super()._take_up(now_ns)
        self.enemy.heard[KEY_UP] = (self.enemy.heard[KEY_UP] + arrived)[-500:]
        return arrived

    def _take_down(self, now_ns: int) -> list[bytes]:
        arrived = super()._take_down(now_ns)
        self.enemy.heard[KEY_DOWN] = (self.enemy.heard[KEY_DOWN] + arrived)[-500:]
        return arrived

    def tick(self) -> None:
        super().tick()
        half = self.per_tick // 2
        for frame in self.enemy.frames(KEY_UP, half, self.rover.boot_id):
            message = checked(self.rover.opener, frame, self.now_ns)
            self.rover.core.receive([message], self.now_ns - 1)
            self.accepted += message.accepted
        for frame in self.enemy.frames(KEY_DOWN, half, self.rover.boot_id):
            self.accepted += self.session.receive(frame, self.now_ns - 1)[0] == "ok"
        self.thrown += 2 * half


def siege(seed: int, frames: int, per_tick: int) -> tuple[Besieged, list[float]]:
    """Send a command a second under fire until `frames` frames were sent; return the waits for the answers, s."""
    world = Besieged(LINK, seed)
    world.run(6.0)
    world.per_tick, next_s = per_tick, 6.0
    end_s = 6.0 + frames / PER_TICK * 0.01
    while world.now_s < end_s:
        world.request("goto", {"x_m": next_s, "y_m": 0.0})
        next_s += _COMMAND_EVERY_S
        world.run(next_s)
    world.per_tick, requester = 0, world.session.requester
    world.run(end_s + 120.0, lambda: not requester.open)
    return world, [(r.history[0][0] - r.made_ns) / 1e9 for r in requester.requests.values()]


def row(quick: bool, told: Told) -> list[Figure]:
    """Measure how many enemy frames are accepted, and the effect on genuine traffic."""
    seeds = range(1 if quick else 3)
    frames, accepted, undone, thrown, waits_s = FRAMES // 10 if quick else FRAMES, 0, 0, 0, []
    for seed in seeds:
        told(f"seed {seed}: {frames} frames")
        world, waited_s = siege(seed, frames, PER_TICK)
        requests = world.session.requester.requests.values()
        undone += sum(r.state != RequestState.COMPLETED for r in requests) + abs(len(world.executed) - len(requests))
        accepted, thrown = accepted + world.accepted, thrown + world.thrown
        waits_s.append(waited_s)
    commands, rtt_s = sum(map(len, waits_s)), 2 * LINK.one_way_s
    return [
        count("hostile", "moon, 10 %", "frames accepted", accepted, 0, thrown),
        count("hostile", "moon, 10 %", "genuine commands not done once", undone, 0, commands),
        quantile("hostile", "moon, 10 %", "answer, p95", waits_s, 0.95, P95_RTT * rtt_s, "s"),
    ]
