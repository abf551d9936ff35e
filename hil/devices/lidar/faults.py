"""TABLE of the faults of sensor and cable, and their schedule: `KIND[=VALUE]@BEGIN[+SECONDS]`.

Place where each fault acts:

    state machine ------> scan ---------> bytes ----------> wire
    fail unstable drill   stamp echo      flip lose         split merge
    refuse reboot jump    semicolon dust  double garbage    slow stall cable
                          clash
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from hil.devices.lidar.optics import Optics
from hil.devices.lidar.profile import Profile
from hil.devices.lidar.states import DRILLS, Machine, SensorState
from hil.own_functions import generator
from onboard.config import ConfigError, from_tree
from onboard.toml_text import TomlError, read_toml
from protocol import scip

NS = 1_000_000_000


class Sensor(Protocol):
    """Parts of a `lidar.Lidar` that a fault may change."""

    profile: Profile
    machine: Machine
    optics: Optics
    slow_ns: int
    stalled: bool
    unplugged: bool

    def reboot(self) -> None: ...  # noqa: D102
    def jump_clock(self, by_ms: float) -> None: ...  # noqa: D102


Act = Callable[[Sensor, str], None]


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind of fault.

    means: meaning of VALUE
    value: default of VALUE
    begin, heal: changes at its begin and end, besides `Faults.active`
    words: allowed texts of VALUE; if empty, VALUE is a number that is not negative
    """

    means: str
    value: str
    begin: Act | None = None
    heal: Act | None = None
    words: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class ScheduledFault:
    """One row of a schedule.

    kind: row of KINDS
    at_s: begin, s
    for_s: duration, s
    value: as in KINDS, "" for the default
    """

    kind: str = ""
    at_s: float = 0.0
    for_s: float = 1e9
    value: str = ""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ConfigError(f"fault {self.kind!r} should be one of {', '.join(sorted(KINDS))}")
        words, number = KINDS[self.kind].words, r"-?\d*\.?\d+" if self.kind == "jump" else r"\d*\.?\d+"
        if self.value and (self.value not in words if words else not re.fullmatch(number, self.value)):
            raise ConfigError(f"fault {self.kind}={self.value} should be {' or '.join(sorted(words)) or 'a number'}")


def parse_fault(text: str) -> ScheduledFault:
    """Parse `flip=0.001@10+5`: from second 10 on, for 5 s. Raises ConfigError."""
    found = re.fullmatch(r"(\w+)(?:=([^@]+))?@(\d*\.?\d+)(?:\+(\d*\.?\d+))?", text)
    if not found:
        raise ConfigError(f"--fault {text!r} should look like KIND@BEGIN or flip=0.001@10+5 (KIND=VALUE@BEGIN+SECONDS)")
    kind, value, at_s, for_s = found.groups()
    return ScheduledFault(kind, float(at_s), float(for_s or 1e9), value or "")


def load_faults(path: Path) -> tuple[ScheduledFault, ...]:
    """Read the rows `[[fault]]` (kind, at_s, for_s, value) of a TOML file. Raises FileNotFoundError, ConfigError."""
    try:
        tree = read_toml(path)
    except TomlError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error
    if set(tree) - {"fault"} or not isinstance(tree.get("fault", []), list):
        raise ConfigError(f"{path}: should hold tables [[fault]], found {', '.join(tree)}")
    rows = [{k: str(v) if k == "value" else v for k, v in row.items()} for row in tree.get("fault", [])]
    return tuple(from_tree(ScheduledFault, row, str(path), "fault.") for row in rows)


# -- what a beginning and an end do ----------------------------------------------------------------------------


def _put(name: str) -> tuple[Act, Act]:
    """Begin and heal functions for a ratio of the optics; heal restores the value of the profile."""

    def begin(sensor: Sensor, value: str) -> None:
        setattr(sensor.optics, name, float(value))

    def heal(sensor: Sensor, _: str) -> None:
        setattr(sensor.optics, name, sensor.profile.dropout_ratio if name == "dropout_ratio" else 0.0)

    return begin, heal


def _slow(sensor: Sensor, value: str) -> None:
    sensor.slow_ns = int(float(value) * 1e6)


def _stall(sensor: Sensor, value: str) -> None:
    sensor.stalled = True


def _go_on(sensor: Sensor, value: str) -> None:
    sensor.stalled, sensor.slow_ns = False, 0


def _unplug(sensor: Sensor, value: str) -> None:
    sensor.unplugged = True


def _plug(sensor: Sensor, value: str) -> None:
    sensor.unplugged = False


def _fail(sensor: Sensor, value: str) -> None:
    sensor.machine.state = SensorState.FAULT


def _recover(sensor: Sensor, value: str) -> None:
    sensor.machine.recover()


def _shake(sensor: Sensor, value: str) -> None:
    sensor.machine.unstable = True


def _steady(sensor: Sensor, value: str) -> None:
    sensor.machine.unstable = False


def _refuse(sensor: Sensor, value: str) -> None:
    sensor.machine.refusal = value


def _allow(sensor: Sensor, value: str) -> None:
    sensor.machine.refusal = ""


def _drill(sensor: Sensor, value: str) -> None:
    sensor.machine.start_drill(value)


def _reboot(sensor: Sensor, value: str) -> None:
    sensor.reboot()


def _jump(sensor: Sensor, value: str) -> None:
    sensor.jump_clock(float(value))


KINDS: Mapping[str, FaultKind] = {
    "flip": FaultKind("share of the bytes that leave with one bit changed", "0.0002"),
    "lose": FaultKind("share of the bytes that are lost", "0.0002"),
    "double": FaultKind("share of the bytes that come twice", "0.0002"),
    "garbage": FaultKind("random bytes before each reply and burst", "40"),
    "split": FaultKind("most bytes in one piece", "1"),
    "merge": FaultKind("ms between deliveries; what leaves in between arrives together", "100"),
    "slow": FaultKind("ms later than usual", "200", _slow, _go_on),
    "stall": FaultKind("no byte leaves", "1", _stall, _go_on),
    "cable": FaultKind("the link is gone: end of file, then refused", "1", _unplug, _plug),
    "stamp": FaultKind("share of the scans that repeat the stamp before them", "1"),
    "echo": FaultKind("share of the scans with another request's echo", "1"),
    "semicolon": FaultKind("share of the scans whose block sums are all `;` (legal: low digits change to fit)", "1"),
    "dust": FaultKind("share of the beams that return nothing", "0.5", *_put("dropout_ratio")),
    "clash": FaultKind("share of the beams that meet another sensor's light (code 3)", "0.2", *_put("clash_ratio")),
    "fail": FaultKind("the sensor fails: stream ended with status 50, then 0L, STAT says so", "1", _fail, _recover),
    "unstable": FaultKind("the motor is unstable: status 0M", "1", _shake, _steady),
    "refuse": FaultKind(
        "status of the answer to everything", "0A", _refuse, _allow, frozenset(("0A", "0B", "0I", "0M"))
    ),
    "drill": FaultKind("the vendor's fault simulation, as by DB", "03", _drill, _recover, frozenset(DRILLS)),
    "reboot": FaultKind("power off and on", "1", _reboot),
    "jump": FaultKind("ms that the counter jumps ahead", "5000", _jump),
}


class Faults:
    """Faults of one sensor: schedule, and effects on scans and bytes.

    active: kind -> value of the running faults
    """

    def __init__(self, seed: int, schedule: tuple[ScheduledFault, ...] = ()) -> None:
        self.active: dict[str, str] = {}
        self._rng = generator((seed, 1))  # own generator: a fault changes only what it damages
        self._waiting = sorted(schedule, key=lambda fault: fault.at_s)
        self._running: list[tuple[int, str]] = []
        self._stamp = b""

    def begin(self, sensor: Sensor, kind: str, value: str = "") -> None:
        """Begin a fault; a second call with another value changes it."""
        self.active[kind] = value or KINDS[kind].value
        if act := KINDS[kind].begin:
            act(sensor, self.active[kind])

    def end(self, sensor: Sensor, kind: str) -> None:
        """Heal a fault."""
        value = self.active.pop(kind, "")
        if act := KINDS[kind].heal:
            act(sensor, value)

    def settle(self, sensor: Sensor, now_ns: int) -> None:
        """Begin and heal the faults that are due."""
        while self._waiting and int(self._waiting[0].at_s * NS) <= now_ns:
            fault = self._waiting.pop(0)
            self.begin(sensor, fault.kind, fault.value)
            self._running.append((int((fault.at_s + fault.for_s) * NS), fault.kind))
        for row in [row for row in self._running if row[0] <= now_ns]:
            self._running.remove(row)
            self.end(sensor, row[1])

    def due_ns(self) -> int | None:
        """Time of the next begin or heal; None at the end of the schedule."""
        times = [int(fault.at_s * NS) for fault in self._waiting[:1]] + [end_ns for end_ns, _ in self._running]
        return min(times, default=None)

    def _strikes(self, kind: str) -> bool:
        return kind in self.active and self._rng.random() < float(self.active[kind])

    def scan(self, asked: scip.ScanRequest, frame: bytes) -> bytes:
        """Apply the faults of whole scans, as the scan leaves the sensor."""
        lines = frame.split(b"\n")
        if len(lines) < 4:
            return frame
        if self._strikes("stamp") and self._stamp:
            lines[2] = self._stamp
        self._stamp = lines[2]
        if self._strikes("echo"):
            lines[0] = lines[0][:5] + bytes((lines[0][5] ^ 1,)) + lines[0][6:]
        if asked.kind.echoes == 1 and self._strikes("semicolon"):
            blocks, width = lines[3:-2], asked.kind.characters
            lines[3:-2] = [_with_sum(block[:-1], k, width) for k, block in enumerate(blocks)]
        return b"\n".join(lines)

    def damage(self, data: bytes) -> bytes:
        """Apply the faults of the cable to a reply or a part of a scan."""
        active, rng = self.active, self._rng
        raw = np.frombuffer(data, np.uint8)
        if "flip" in active:
            hit = rng.random(len(raw)) < float(active["flip"])
            raw = np.where(hit, raw ^ (1 << rng.integers(0, 8, len(raw))).astype(np.uint8), raw)
        if "lose" in active:
            raw = raw[rng.random(len(raw)) >= float(active["lose"])]
        if "double" in active:
            raw = np.repeat(raw, 1 + (rng.random(len(raw)) < float(active["double"])))
        noise = rng.integers(0, 256, int(float(active["garbage"])), np.uint8).tobytes() if "garbage" in active else b""
        return noise + raw.astype(np.uint8).tobytes()

    def pieces(self, at_ns: int, data: bytes) -> list[tuple[int, bytes]]:
        """Split data into pieces that arrive together, with their times."""
        if "merge" in self.active:
            period_ns = max(1, int(float(self.active["merge"]) * 1e6))
            at_ns = -(-at_ns // period_ns) * period_ns
        whole = max(1, len(data))  # an empty rest is also a piece
        size = max(1, int(float(self.active["split"]))) if "split" in self.active else whole
        return [(at_ns, data[k : k + size]) for k in range(0, whole, size)]


def _with_sum(block: bytes, number: int, characters: int) -> bytes:
    """Block whose sum is `;`: the last low digit of a value in it is changed to fit (by at most 63 mm)."""
    at = max((k for k in range(len(block)) if (number * scip.BLOCK + k) % characters == characters - 1), default=-1)
    if at < 0:
        return block + scip.checksum(block)
    difference = (0x3B - scip.checksum(block)[0]) & 0x3F
    digit = ((block[at] - 0x30 + difference) & 0x3F) + 0x30
    return block[:at] + bytes((digit,)) + block[at + 1 :] + b";"
