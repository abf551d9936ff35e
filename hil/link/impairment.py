"""Impairment model of a link: a pure, seeded model of one direction on bench time.

    offer -> drop-tail queue -> line at its rate -> blackout? shadow? noise? -> delay, jitter, reordering, copy -> due

Rule 1: same profile, seed and offers (bytes and times) give the same drop list and the same arrival times.
Rule 2: a datagram is lost by the state of the link at the moment its last bit leaves the line.
Rule 3: jitter keeps the order; only a datagram drawn for reordering is overtaken.
Rule 4: nothing arrives at the time it was offered, so a bench tick never depends on its own output.
Each cause has a generator of its own: a change of one leaves the drop list of the others unchanged.
"""

from __future__ import annotations

import difflib
import heapq
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from hil.own_functions import generator
from onboard.config import ConfigError, from_tree, value
from onboard.toml_text import TomlError, read_toml

OVERHEAD_BYTES = 28  # IPv4 + UDP, on the line with every datagram
_S = 1_000_000_000
CAUSES = ("queue_full", "blackout", "shadow", "noise")
PROFILES = Path(__file__).with_name("profiles.toml")


@dataclass(frozen=True, slots=True)
class Profile:
    """Properties of a link: both rates, and the impairments, equal in both directions."""

    note: str = value("", "what this link stands for")
    down_bps: float = value(256e3, "line rate rover to ground", low=1000, high=1e10)
    up_bps: float = value(256e3, "line rate ground to rover", low=1000, high=1e10)
    one_way_s: float = value(0.0, "delay of one direction", low=0, high=3600)
    jitter_s: float = value(0.0, "extra delay, uniform between 0 and this", low=0, high=60)
    loss: float = value(0.0, "probability that noise loses a datagram", low=0, high=1)
    mean_bad_s: float = value(0.0, "Gilbert-Elliott: mean length of a shadow, all lost; 0 = none", low=0, high=1e6)
    mean_good_s: float = value(0.0, "Gilbert-Elliott: mean length between shadows", low=0, high=1e6)
    duplicate: float = value(0.0, "probability that a datagram arrives twice", low=0, high=1)
    reorder: float = value(0.0, "probability that a datagram is held back", low=0, high=1)
    reorder_s: float = value(0.5, "how long at most", low=0, high=60)
    blackout_first_s: float = value(0.0, "start of the first blackout, bench time", low=0, high=1e9)
    blackout_every_s: float = value(0.0, "from start to start; 0 = only one", low=0, high=1e9)
    blackout_length_s: float = value(0.0, "length of a blackout; 0 = none", low=0, high=1e9)
    blackouts_s: tuple[float, ...] = value((), "further blackouts: start, end, start, end ... in bench time")
    queue_s: float = value(2.0, "length of the drop-tail queue before the line", low=0.001, high=60)


@dataclass(slots=True)
class Counts:
    """Number of datagrams of one direction since the start."""

    offered: int = 0
    offered_bytes: int = 0
    queue_full: int = 0
    blackout: int = 0
    shadow: int = 0
    noise: int = 0
    duplicated: int = 0
    reordered: int = 0
    delivered: int = 0
    delivered_bytes: int = 0

    @property
    def lost(self) -> int:
        """Lost datagrams of all causes."""
        return sum(self.causes().values())

    def causes(self) -> dict[str, int]:
        """Lost datagrams by their cause."""
        return {cause: getattr(self, cause) for cause in CAUSES}

    def report(self) -> dict[str, int]:
        """Fields for the bench's report."""
        return {**asdict(self), "lost": self.lost}


def load_profile(name: str, path: Path = PROFILES) -> Profile:
    """Read a named table of the profile file. Raises ConfigError with file, key and a suggestion."""
    tables = _tables(path)
    if name not in tables:
        near = difflib.get_close_matches(name, tables, n=1)
        hint = f"did you mean `{near[0]}`?" if near else f"known: {', '.join(tables)}"
        raise ConfigError(f"{path}: no link profile `{name}`; {hint}")
    table = dict(tables[name])
    blackouts_s = _pairs(table.pop("blackouts_s", []), f"{path}: `{name}.blackouts_s`")
    return replace(from_tree(Profile, table, str(path), f"{name}."), blackouts_s=blackouts_s)


def profile_names(path: Path = PROFILES) -> tuple[str, ...]:
    """Names in a profile file, in its order. Raises ConfigError as load_profile does."""
    return tuple(_tables(path))


def _tables(path: Path) -> dict[str, dict[str, object]]:
    try:
        return read_toml(path)
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file of link profiles") from None
    except TomlError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error


def _pairs(given: object, what: str) -> tuple[float, ...]:
    numbers = given if isinstance(given, list) and all(isinstance(t, (int, float)) for t in given) else [0.0]
    if len(numbers) % 2 or sorted(numbers) != numbers:
        raise ConfigError(f"{what} should be rising pairs of start and end, found {given!r}")
    return tuple(map(float, numbers))


class _Shadow:
    """Gilbert-Elliott state in continuous time: exponential durations of good and bad."""

    def __init__(self, mean_good_s: float, mean_bad_s: float, rng: np.random.Generator) -> None:
        self._means_s = (mean_good_s, mean_bad_s)
        self._rng = rng
        self._bad = mean_bad_s > 0 and rng.random() < mean_bad_s / (mean_bad_s + mean_good_s)
        self._until_ns = 0
        self._stay()

    def _stay(self) -> None:
        self._until_ns += 1 + int(self._rng.exponential(self._means_s[self._bad]) * _S)

    def bad(self, at_ns: int) -> bool:
        """True while the link is in shadow; times of successive calls must not decrease."""
        if not self._means_s[1]:
            return False
        while at_ns >= self._until_ns:
            self._bad = not self._bad
            self._stay()
        return self._bad


class Impairment:
    """One direction of a link. `offer` puts a datagram in, `due` takes out the arrived ones.

    arrivals_ns: arrival times of the copies of the last offered datagram; empty if it is lost
    """

    def __init__(self, profile: Profile, rate_bps: float, rng: np.random.Generator) -> None:
        self._profile = profile
        self.rate_bps = rate_bps
        self.arrivals_ns: tuple[int, ...] = ()
        shadow, self._noise, self._jitter, self._copy, self._hold = rng.spawn(5)
        self._shadow = _Shadow(profile.mean_good_s, profile.mean_bad_s, shadow)
        self._line_free_ns = 0
        self._last_due_ns = 0
        self._sequence = 0
        self._flying: list[tuple[int, int, bytes]] = []
        self.counts = Counts()

    @property
    def next_due_ns(self) -> int | None:
        """Arrival time of the next datagram; None if there is none on its way."""
        return self._flying[0][0] if self._flying else None

    @property
    def under_way(self) -> int:
        """Number of datagrams that will arrive and have not yet."""
        return len(self._flying)

    def offer(self, datagram: bytes, now_ns: int) -> str:
        """Offer a datagram to the link. Returns "" if it will arrive, else the cause of its loss (CAUSES)."""
        counts, self.arrivals_ns = self.counts, ()
        counts.offered += 1
        counts.offered_bytes += len(datagram)
        line_ns = round((len(datagram) + OVERHEAD_BYTES) * 8 * _S / self.rate_bps)
        sent_ns = max(now_ns, self._line_free_ns) + line_ns
        if sent_ns - now_ns > self._profile.queue_s * _S and self._line_free_ns > now_ns:
            counts.queue_full += 1
            return "queue_full"
        self._line_free_ns = sent_ns
        cause = self._loss(sent_ns)
        if cause:
            setattr(counts, cause, getattr(counts, cause) + 1)
            return cause
        self._launch(datagram, sent_ns, now_ns)
        return ""

    def due(self, now_ns: int) -> list[bytes]:
        """Datagrams that have arrived by now, in their order."""
        arrived = []
        while self._flying and self._flying[0][0] <= now_ns:
            arrived.append(heapq.heappop(self._flying)[2])
        self.counts.delivered += len(arrived)
        self.counts.delivered_bytes += sum(map(len, arrived))
        return arrived

    def _loss(self, sent_ns: int) -> str:
        noise = self._noise.random() < self._profile.loss
        if self.dark(sent_ns):
            return "blackout"
        if self._shadow.bad(sent_ns):
            return "shadow"
        return "noise" if noise else ""

    def dark(self, at_ns: int) -> bool:
        """True during a blackout."""
        p, at_s = self._profile, at_ns / _S
        if any(start_s <= at_s < end_s for start_s, end_s in zip(p.blackouts_s[::2], p.blackouts_s[1::2])):
            return True
        since_s = at_s - p.blackout_first_s
        if since_s < 0 or not p.blackout_length_s:
            return False
        return (since_s % p.blackout_every_s if p.blackout_every_s else since_s) < p.blackout_length_s

    def _launch(self, datagram: bytes, sent_ns: int, now_ns: int) -> None:
        p = self._profile
        due_ns = sent_ns + round((p.one_way_s + p.jitter_s * self._jitter.random()) * _S)
        due_ns = max(due_ns, self._last_due_ns, now_ns + 1)
        held, copied = self._hold.random() < p.reorder, self._copy.random() < p.duplicate
        if held:
            self.counts.reordered += 1
            self._fly(due_ns + round(p.reorder_s * self._hold.random() * _S), datagram)
        else:
            self._last_due_ns = due_ns
            self._fly(due_ns, datagram)
        if copied:
            self.counts.duplicated += 1
            self._fly(due_ns + round(p.reorder_s * self._copy.random() * _S), datagram)

    def _fly(self, due_ns: int, datagram: bytes) -> None:
        heapq.heappush(self._flying, (due_ns, self._sequence, datagram))
        self.arrivals_ns += (due_ns,)
        self._sequence += 1


def both_directions(profile: Profile, seed: int) -> tuple[Impairment, Impairment]:
    """(down, up) models of one link, each with a generator of its own from the seed."""
    down, up = generator(seed).spawn(2)
    return Impairment(profile, profile.down_bps, down), Impairment(profile, profile.up_bps, up)
