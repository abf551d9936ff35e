"""Flight under hostilities: they change the input from outside, which then passes the flight program's own ports.

    bench and operator -> Outside -> hostilities (hostilities.py) -> Doors (doors.py) -> Inputs

An attack lasts its time and then until the flight program has counted it, LONGEST_S at most, so that none stays
undetected for lack of time. The flight ends when the order's outcome is known, every attack is over and AFTER_S have
passed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory, Observe
from hil.scenarios.model import Scenario
from onboard.records import Chunk, Frame, Inputs, LinkMessage, Outputs, PortState
from protocol.link.datagrams import Sealer, bench_keys
from tests.scenarios.hostile.doors import Doors
from tests.scenarios.hostile.hostilities import HOSTILITIES

NS = 1_000_000_000
LONGEST_S, AFTER_S = 90.0, 5.0
STATIONS = 4


@dataclass(slots=True)
class Attack:
    """One hostility.

    felt: rise of the flight program's count.
    ended_s: NaN while it lasts.
    """

    name: str
    begin_s: float
    lasts_s: float
    rng: np.random.Generator
    before: int | None = None
    felt: int = 0
    ended_s: float = float("nan")

    @property
    def over(self) -> bool:
        """True after its end."""
        return self.ended_s == self.ended_s


class Outside:
    """Input from outside in this tick, for hostilities to change; and the recordings of an intruder.

    frames, pieces, datagrams: of bus, scanner (with times) and link.
    silent: nothing passes the link in either direction; sent datagrams wait in `hoard`.
    strange: the scanner's bytes are not its own.
    first: True in an attack's first tick.
    seen_frames, seen_datagrams: genuine ones of the last seconds.
    """

    def __init__(self, bench: InMemory, boot_id: int) -> None:
        self.bench, self.boot_id, self.now_ns = bench, boot_id, 0
        self.frames: list[Frame] = []
        self.pieces: list[tuple[int, bytes]] = []
        self.datagrams: list[bytes] = []
        self.hoard: list[bytes] = []
        self.silent = self.strange = self.first = False
        self.seen_frames: deque[Frame] = deque(maxlen=2000)
        self.seen_datagrams: deque[bytes] = deque(maxlen=200)
        self.keys = bench_keys(bench.scenario.seed, STATIONS)
        self._sealers: dict[tuple[Any, ...], Sealer] = {}

    def sealer(self, key: bytes, key_id: int, boot_id: int | None = None) -> Sealer:
        """Return the sealer of a key; the same one each time, so that its counter rises."""
        boot_id = self.boot_id if boot_id is None else boot_id
        return self._sealers.setdefault((key, key_id, boot_id), Sealer(key, key_id, boot_id))

    def station(self, key_id: int) -> Sealer:
        """Return the sealer of a station with its own key."""
        key = self.keys.command.key(key_id)
        assert key is not None
        return self.sealer(key, key_id)


class Siege(InMemory):
    """The scenario with these attacks."""

    def __init__(self, scenario: Scenario, attacks: Sequence[Attack], record: Path | None = None) -> None:
        self._said: tuple[bytes, ...] = ()  # the operator's datagrams of this tick
        super().__init__(scenario, step_ns=CAMPAIGN_STEP_NS, record=record)
        assert self.rover is not None
        config = self.rover.config
        self.attacks = attacks
        self.outside = Outside(self, config.link.boot_count)
        self._doors = Doors(config, scenario.seed)

    @property
    def ended(self) -> bool:
        """True at the end as the module defines it."""
        after_ns = self.tick * 10_000_000 - AFTER_S * NS
        quiet = all(attack.over and attack.ended_s * NS < after_ns for attack in self.attacks)
        return super().ended and (quiet or self.tick / 100 >= self.scenario.limit_s)

    def step(self, observe: Observe | None = None) -> None:
        """Run one tick and store the effect of each attack."""

        def look(tick: int, inputs: Inputs, outputs: Outputs, rover: Any, state: Any) -> None:
            for attack in self.attacks:
                if attack.before is not None and not attack.over:
                    attack.felt = max(attack.felt, HOSTILITIES[attack.name].felt(rover, inputs) - attack.before)
            if observe:
                observe(tick, inputs, outputs, rover, state)

        super().step(look)

    def free(self) -> None:
        """Close the ports as well."""
        super().free()
        self._doors.close()

    def _link_says(self, now_ns: int) -> tuple[LinkMessage, ...]:
        self._said = self.operator.datagrams(now_ns)
        return ()

    def _cut_off(self, now_ns: int) -> bool:
        return self.outside.silent or super()._cut_off(now_ns)

    def _inputs(self, now_ns: int) -> Inputs:
        quiet, out = super()._inputs(now_ns), self.outside
        out.now_ns, out.strange = now_ns, False
        out.frames, out.datagrams = [*quiet.can_frames], [*self._said]
        out.pieces = [(chunk.rx_ns, chunk.data) for chunk in quiet.lidar_chunks]
        out.seen_frames.extend(out.frames)
        out.seen_datagrams.extend(out.datagrams)
        for attack in self.attacks:
            self._wage(attack, quiet)
        if out.silent:
            out.hoard, out.datagrams = out.hoard + out.datagrams, []
        is_open = quiet.lidar_state is PortState.OPEN
        frames = sorted(out.frames, key=lambda frame: frame.stamp_ns)
        chunks: tuple[Chunk, ...] = self._doors.lidar(out.pieces if is_open else None, now_ns, out.strange)
        return replace(
            quiet,
            can_frames=self._doors.can(frames, now_ns),
            lidar_chunks=chunks,
            link_messages=self._doors.link(out.datagrams, now_ns),
        )

    def _wage(self, attack: Attack, inputs: Inputs) -> None:
        """Run an attack's part in this tick: its begin, its action, its end."""
        now_s, row = inputs.now_ns / NS, HOSTILITIES[attack.name]
        if attack.over or now_s < attack.begin_s or self.rover is None:
            return
        lasted_s = now_s - attack.begin_s
        if lasted_s > attack.lasts_s and (attack.felt or lasted_s > LONGEST_S):
            attack.ended_s = now_s
            row.heal(self.outside, attack.rng)
            return
        self.outside.first = attack.before is None
        if attack.before is None:
            attack.before = row.felt(self.rover, inputs)
        row.act(self.outside, attack.rng)
