"""TABLE of hostilities: input of an enemy, or of a failed device, to the flight program, and its true consequences.

    scanner ----+                                   raises  faults that it may raise
    CAN bus ----+--> Outside --> the ports          ends    faults by which a mission may end; none: it must go on
    link, disk -+                                   felt    count of the flight program that must rise

`act` is called in each tick of the hostility and changes the Outside (siege.py); `heal` once at its end. A mission that
ends by any other fault, or raises a fault of no row, reported an untruth. To add a row, add it here:
test_hostilities.py checks that each reaches the flight program.
"""

from __future__ import annotations

import errno
import math
import struct
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ground.gateway.desks.orders import MavCommand, Request, RoverState, order
from ground.gateway.frames import mavlink
from ground.gateway.origin import Origin
from onboard.core.rover import Rover
from onboard.records import BusTrouble, Frame, Inputs, RecordTrouble
from protocol.can.crc import seed as crc_seed
from protocol.can.crc import sound
from protocol.generated.can_codec import TABLE
from protocol.link.datagrams import DOWNLINK_KEY_ID, MAX_DATAGRAM, OVERHEAD, DatagramKind
from protocol.tables import commands
from protocol.tables.modes import Mode

if TYPE_CHECKING:
    from tests.scenarios.hostile.siege import Outside

Rng = np.random.Generator
Act = Callable[["Outside", Rng], None]
TICK_NS = 10_000_000
FEEDS, ENDLESS = b"\n" * 65_536, b"0" * 65_536
FLOOD_IDS, FOREIGN_IDS = range(0x100, 0x4E8), range(0x500, 0x540)
OLD_NS = 300_000_000  # age at which a recorded frame is sent again
AWAY = {"x_m": -40.0, "y_m": 40.0}  # outside of every field
OTHER, BABBLER, HOARDER = 2, 3, 4  # stations with keys of their own; the operator is 1
_HEAD = struct.Struct("<IqqqB")
_ARDUPILOT, _PX4 = (*range(18), 30), range(1, 11)


class Hostility(NamedTuple):
    """One row of the table.

    lasts_s: least and longest duration.
    felt_s: time within which `felt` must rise.
    in_sweep: True if only scans can detect it.
    """

    means: str
    act: Act
    raises: frozenset[str]
    felt: Callable[[Rover, Inputs], int]
    ends: frozenset[str] = frozenset()
    heal: Act = lambda out, rng: None
    lasts_s: tuple[float, float] = (2.0, 6.0)
    felt_s: float = 0.5
    in_sweep: bool = False


# -- the scanner -----------------------------------------------------------------------------------------------------


def _says(make: Callable[[Rng], bytes]) -> Act:
    """Replace the scanner's bytes in each tick by these."""

    def act(out: Outside, rng: Rng) -> None:
        out.pieces, out.strange = [(out.now_ns, make(rng))], True

    return act


def _damage(out: Outside, rng: Rng) -> None:
    """Change one byte of 500."""
    for n, (at_ns, data) in enumerate(out.pieces):
        raw = np.frombuffer(data, np.uint8).copy()
        hit = rng.random(len(raw)) < 0.002
        raw[hit] ^= rng.integers(1, 256, int(hit.sum()), np.uint8)
        out.pieces[n] = (at_ns, raw.tobytes())


def _jump(out: Outside, rng: Rng) -> None:
    if out.first or out.now_ns % 1_000_000_000 == 0:
        out.bench.lidar.jump_clock(float(rng.choice([-60_000.0, -700.0, 700.0, 60_000.0])))


# -- the bus ---------------------------------------------------------------------------------------------------------


def _flood(out: Outside, rng: Rng) -> None:
    out.frames += [Frame(can_id, bytes(8), out.now_ns) for can_id in FLOOD_IDS]


def _foreign(out: Outside, rng: Rng) -> None:
    out.frames += [Frame(int(rng.choice(FOREIGN_IDS)), rng.bytes(int(rng.integers(9))), out.now_ns) for _ in range(4)]


def _forge(out: Outside, rng: Rng) -> None:
    """Send a frame with any of our ids, an emergency stop's too, and a wrong checksum."""
    can_id = int(rng.choice([*TABLE]))
    data = rng.bytes(8)
    if sound(data, crc_seed(can_id)):
        data = data[:7] + bytes((data[7] ^ 1,))
    out.frames.append(Frame(can_id, data, out.now_ns))


def _repeat(out: Outside, rng: Rng) -> None:
    """Repeat a frame of this tick: its checksum is right, its counter stale."""
    if out.frames:
        out.frames.append(out.frames[int(rng.integers(len(out.frames)))]._replace(stamp_ns=out.now_ns))


def _recorded(out: Outside, rng: Rng) -> None:
    """Send old frames again, one of each id once in ten ticks."""
    old = {frame.can_id: frame for frame in out.seen_frames if frame.stamp_ns < out.now_ns - OLD_NS}
    out.frames += [
        frame._replace(stamp_ns=out.now_ns)
        for can_id, frame in old.items()
        if (out.now_ns // TICK_NS + can_id) % 10 == 0
    ]


def _errors(out: Outside, rng: Rng) -> None:
    for _ in range(20):
        out.bench.can.error(BusTrouble(int(rng.choice([BusTrouble.BUS_ERROR, BusTrouble.OVERFLOW, BusTrouble.OTHER]))))


# -- the link --------------------------------------------------------------------------------------------------------


def _goto(request_id: int, **changes: float) -> bytes:
    return commands.encode(commands.Telecommand(request_id, 0, 0, "goto", {**AWAY, **changes}))


def _forged(count: int) -> Act:
    """Send datagrams under a key that no station has."""

    def act(out: Outside, rng: Rng) -> None:
        sealer = out.sealer(bytes(32), 1)
        out.datagrams += [
            sealer.seal(DatagramKind.TELECOMMAND, _goto(int(rng.integers(1 << 31)))) for _ in range(count)
        ]

    return act


def _replay(out: Outside, rng: Rng) -> None:
    """Send all recorded datagrams of the operator ten times a tick."""
    out.datagrams += [*out.seen_datagrams] * 10


def _earlier_boot(out: Outside, rng: Rng) -> None:
    """Send commands sealed with the operator's key for another boot of the flight program."""
    key = out.keys.command.key(1)
    assert key is not None
    for boot_id in (out.boot_id - 1, out.boot_id + 1):
        out.datagrams += [
            out.sealer(key, 1, boot_id & 0xFFFFFFFF).seal(DatagramKind.TELECOMMAND, _goto(n)) for n in range(5)
        ]


def _foreign_key(out: Outside, rng: Rng) -> None:
    """Send the operator's id under another station's key."""
    key = out.keys.command.key(OTHER)
    assert key is not None
    out.datagrams += [out.sealer(key, 1).seal(DatagramKind.TELECOMMAND, _goto(n)) for n in range(10)]


def _viewer(out: Outside, rng: Rng) -> None:
    """Send commands sealed with the downlink key, as the operator and as the rover."""
    key = out.keys.downlink.key(DOWNLINK_KEY_ID)
    assert key is not None
    for key_id in (1, DOWNLINK_KEY_ID):
        out.datagrams += [out.sealer(key, key_id).seal(DatagramKind.TELECOMMAND, _goto(n)) for n in range(5)]


def _without_lease(out: Outside, rng: Rng) -> None:
    """Send orders of a second station that need the lease, while the operator has it."""
    orders = (
        ("goto", AWAY),
        ("turn", {"heading_rad": 1.0}),
        ("return", {}),
        ("mission", {"goals_m": (1.0, 1.0)}),
        ("fence_add", {"fence": "here", "kind": "keep_out", "corners_m": (-9.0, -9.0, 9.0, -9.0, 9.0, 9.0)}),
        ("param_set", {"parameter": "motion.cruise_mps", "value": "0.2"}),
        ("keys_rotate", {"epoch": 1.0}),
        ("contacts_set", {"windows_s": (90_000.0, 90_001.0)}),
        ("faults_mask", {"fault": "JOB_LATE", "lasting_s": 60.0}),
    )
    name, arguments = orders[int(rng.integers(len(orders)))]
    asked = commands.Telecommand(int(rng.integers(1 << 31)), 0, 0, name, arguments)
    out.datagrams.append(out.station(OTHER).seal(DatagramKind.TELECOMMAND, commands.encode(asked)))


def absurd_payloads(rng: Rng) -> list[tuple[DatagramKind, bytes]]:
    """Return damaged and absurd payloads of a station with a key; none of them is a valid command."""

    def head(command_id: int) -> bytes:
        return _HEAD.pack(int(rng.integers(1 << 30, 1 << 31)), 0, 0, 0, command_id)

    def numbers(*values: float) -> bytes:
        return struct.pack(f"<{len(values)}d", *values)

    nan, inf = math.nan, math.inf
    sealed = [
        b"",
        b"\0",
        rng.bytes(3),
        head(0),
        head(99),
        head(255),
        rng.bytes(1000),
        bytes(MAX_DATAGRAM - OVERHEAD),
        *(head(1) + numbers(*xyh) for xyh in ((nan, nan, nan), (inf, -inf, 0.0), (1e308, 1.0, 0.0), (1.0, 1.0, 1e9))),
        head(1),
        head(1) + numbers(1.0),
        head(1) + numbers(1.0, 1.0, nan) + b"more",
        head(10) + numbers(nan),
        head(10) + numbers(-1e300),
        head(11) + numbers(*[1e30] * 5),
        head(12) + b"\xff",
        head(12) + b"\0",
        head(12) + b"\x01" + struct.pack("<2i", -(1 << 31), (1 << 31) - 1),
        head(6) + numbers(3.5, nan, nan, nan),
        head(16) + b"\xff" + bytes(200),
        head(21) + b"\x05\xff\xfe\xfd\xfc\xfb",
        head(23) + b"\x03pit" + numbers(1e9) + b"\x03",
        head(23) + b"\x10" + b"\x1b[2J" * 4,
    ]
    others = [
        (kind, rng.bytes(size))
        for kind in (DatagramKind.MAVLINK, DatagramKind.BULK_CHUNK, DatagramKind.BULK_BITMAP, DatagramKind.REPORT)
        for size in (0, 1, 40)
    ]
    return [(DatagramKind.TELECOMMAND, payload) for payload in sealed] + others


def _absurd(out: Outside, rng: Rng) -> None:
    """Send these payloads from a station without the lease, and under the operator's own key."""
    words = absurd_payloads(rng)
    for seal in (out.station(BABBLER).seal, out.bench.operator.seal):
        out.datagrams.append(seal(*words[int(rng.integers(len(words)))]))


def _questions(out: Outside, rng: Rng) -> None:
    """Ask for the time from a station with a key, each time as a new request."""
    for _ in range(3):
        asked = commands.Telecommand(int(rng.integers(1 << 31)), 0, 0, "time", {})
        out.datagrams.append(out.station(HOARDER).seal(DatagramKind.TELECOMMAND, commands.encode(asked)))


def _mode_words(out: Outside, rng: Rng) -> None:
    """Send a ground program's modes through the gateway of a second station, and its orders to the rover.

    Without AUTO.LOITER, which is a valid stop of a station with a key, and no hostility.
    """
    foreign = [*((custom, 0) for custom in _ARDUPILOT), *((custom, sub) for custom in _PX4 for sub in range(11))]
    known = RoverState(Origin(0.0, 0.0), Mode.AUTONOMOUS, 0.0, True, goals_m=((3.0, 0.0), (6.0, 1.0)))
    wanted = int(rng.integers(len(foreign) + 20))
    custom, sub = foreign[wanted] if wanted < len(foreign) else (4, int(rng.choice([4, 5])))
    if (custom, sub) == (4, 3):
        return
    base = float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
    made = order(MavCommand(mavlink.MAV_CMD_DO_SET_MODE, (base, float(custom), float(sub), 0.0)), known)
    if isinstance(made, Request):
        asked = commands.Telecommand(int(rng.integers(1 << 31)), 0, 0, made.name, dict(made.arguments))
        out.datagrams.append(out.station(OTHER).seal(DatagramKind.TELECOMMAND, commands.encode(asked)))


def _black_out(out: Outside, rng: Rng) -> None:
    out.silent = True


def _flood_behind(out: Outside, rng: Rng) -> None:
    """Send the whole hoard three times, among thousands of forged datagrams."""
    hoard = out.hoard
    out.hoard, out.silent, out.datagrams = [], False, hoard + out.datagrams
    _forged(5000)(out, rng)
    out.datagrams += hoard * 2


# -- the disk --------------------------------------------------------------------------------------------------------


def _fill(out: Outside, rng: Rng) -> None:
    out.bench.disk.refuses = errno.ENOSPC


def _empty(out: Outside, rng: Rng) -> None:
    out.bench.disk.refuses = 0


# -- what the flight program counts ----------------------------------------------------------------------------------


def _dropped(rover: Rover, inputs: Inputs) -> int:
    return rover.lidar.flood.dropped_bytes


def _bad_scans(rover: Rover, inputs: Inputs) -> int:
    return rover.lidar.bad + rover.lidar.counts["stray"]


def _jumps(rover: Rover, inputs: Inputs) -> int:
    quality = rover.lidar.clock.quality
    return quality.jumps + quality.reboots


def _unknown(rover: Rover, inputs: Inputs) -> int:
    return rover.nodes.unknown_frames


def _bad_frames(rover: Rover, inputs: Inputs) -> int:
    return rover.nodes.bad_frames


def _out_of_order(rover: Rover, inputs: Inputs) -> int:
    counts = rover.nodes.guard_counts
    return counts.lost + counts.repeated + counts.twin


def _error_frames(rover: Rover, inputs: Inputs) -> int:
    return sum(rover.nodes.bus.status.error_frames)


def _refused(*kinds: str) -> Callable[[Rover, Inputs], int]:
    return lambda rover, inputs: sum(rover.downlink.refused.get(kind, 0) for kind in kinds)


def _heard(station: int) -> Callable[[Rover, Inputs], int]:
    """Return when a datagram of a station was last accepted, in ticks."""
    return lambda rover, inputs: rover.downlink.heard_ns.get(station, 0) // TICK_NS


def _silence(rover: Rover, inputs: Inputs) -> int:
    """Return the ticks without contact beyond the 5 s between two datagrams of a waiting operator."""
    return max(0, (inputs.now_ns - rover.downlink.last_contact_ns) // TICK_NS - 600)


def _full(rover: Rover, inputs: Inputs) -> int:
    return int(inputs.record.trouble is RecordTrouble.FULL)


GARBLED = frozenset({"LIDAR_GARBLED", "LIDAR_SILENT"})
UNTIMED = frozenset({"LIDAR_CLOCK", "LIDAR_SILENT"})
LOADED = frozenset({"CAN_BABBLE", "CAN_BUS_OFF", "CAN_CORRUPT", "WHEEL_STALE", "WHEEL_SILENT", "IMU_DEAD", "NODE_LOST"})
TWICE = frozenset({"CAN_CORRUPT", "NODE_TWICE"})
NONE = frozenset[str]()
HOSTILITIES: Mapping[str, Hostility] = {
    "scanner_feeds": Hostility(
        "the scanner sends line feeds alone, 6.5 MB a second", _says(lambda rng: FEEDS), GARBLED, _dropped, ends=GARBLED
    ),
    "scanner_endless": Hostility(
        "the scanner sends one line without end, 6.5 MB a second",
        _says(lambda rng: ENDLESS),
        GARBLED,
        _dropped,
        ends=GARBLED,
    ),
    "scanner_garbage": Hostility(
        "the scanner sends random bytes, 0.4 MB a second",
        _says(lambda rng: rng.bytes(4000)),
        GARBLED,
        _bad_scans,
        ends=GARBLED,
    ),
    "scanner_damaged": Hostility(
        "one of 500 bytes of the scanner is another", _damage, GARBLED, _bad_scans, ends=GARBLED, in_sweep=True
    ),
    "scanner_clock": Hostility(
        "the scanner's counter jumps each second by up to a minute, back and ahead",
        _jump,
        UNTIMED,
        _jumps,
        ends=UNTIMED,
        in_sweep=True,
    ),
    "can_flood": Hostility(
        "1000 frames a tick of 1000 ids on the bus, ours too",
        _flood,
        LOADED,
        _unknown,
        ends=LOADED - {"CAN_CORRUPT", "WHEEL_STALE", "IMU_DEAD"},
    ),
    "can_foreign": Hostility("400 frames a second of ids that are not ours", _foreign, NONE, _unknown),
    "can_forged": Hostility(
        "100 frames a second of our ids, their checksums wrong", _forge, frozenset({"CAN_CORRUPT"}), _bad_frames
    ),
    "can_repeated": Hostility(
        "100 sound frames a second once more, their counters stale",
        _repeat,
        TWICE,
        _bad_frames,
        ends=frozenset({"NODE_TWICE"}),
    ),
    "can_recorded": Hostility(
        "sound frames of 0.3 s ago, each id ten times a second",
        _recorded,
        # while a wheel steers, its angle of 0.3 s ago is 9 degrees off
        TWICE | {"CLOCK_JUMP", "TILT_STALL", "STEER_STUCK"},
        _out_of_order,
        ends=frozenset({"NODE_TWICE"}),
    ),
    "can_errors": Hostility("2000 error frames a second", _errors, NONE, _error_frames),
    "link_forged": Hostility("20,000 forged datagrams a second", _forged(200), NONE, _refused("tag")),
    "link_replayed": Hostility("all that the operator said, again and again", _replay, NONE, _refused("replay")),
    "link_earlier_boot": Hostility(
        "commands under the operator's key for another start of the rover", _earlier_boot, NONE, _refused("boot")
    ),
    "link_foreign_key": Hostility("commands under another station's key", _foreign_key, NONE, _refused("tag")),
    "link_viewer_key": Hostility("commands under the key of a viewer", _viewer, NONE, _refused("tag")),
    "link_without_lease": Hostility(
        "a second station orders what it may not, 100 times a second", _without_lease, NONE, _heard(OTHER)
    ),
    "link_absurd": Hostility(
        "damaged and absurd commands (NaN, 1e308, cut off) of stations with keys, the operator's too",
        _absurd,
        NONE,
        _heard(BABBLER),
    ),
    "link_questions": Hostility("300 questions a second of a station with a key", _questions, NONE, _heard(HOARDER)),
    "link_mode_words": Hostility(
        "a ground program of a second station sets the modes of other autopilots", _mode_words, NONE, _heard(OTHER)
    ),
    "link_blackout": Hostility(
        "nothing passes the link; then all at once, with 5000 forged datagrams",
        _black_out,
        NONE,
        _silence,
        heal=_flood_behind,
        lasts_s=(20.0, 40.0),
        felt_s=8.0,
    ),
    "disk_full": Hostility("no room is left on the disk", _fill, frozenset({"DISK_FULL"}), _full, heal=_empty),
}
