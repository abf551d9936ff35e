"""TABLE of commands with arguments, units, ranges and the modes that allow them; wire encoding of telecommands.

A telecommand's payload: request id u32, issued, expiry and start i64 ns each (onboard time; expiry 0: none, start: no
earlier than this, 0: at once), command id u8, then the row's arguments in its order (protocol.tables.arguments).
"""

from __future__ import annotations

import difflib
import math
import struct
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from protocol import WireError
from protocol.products import PRODUCT_NAMES
from protocol.tables.arguments import Argument as Argument
from protocol.tables.arguments import ArgumentKind as ArgumentKind
from protocol.tables.arguments import Value as Value
from protocol.tables.arguments import check as check_argument
from protocol.tables.arguments import from_words, pack, unpack
from protocol.tables.faults import BY_NAME as FAULTS
from protocol.tables.modes import TABLE as MODES
from protocol.tables.modes import TRANSITIONS, Mode

Arguments = Mapping[str, Value]
_HEAD = struct.Struct("<IqqqB")
_FAR_M = 10_000.0


@dataclass(frozen=True, slots=True)
class Command:
    """One row of the command table.

    id: number on the wire, never reused.
    name: name in code and reports.
    arguments: arguments in wire order.
    modes: modes in which the command is allowed.
    meaning: text for people.
    example: arguments as typed, for the help.
    sends: name of the object that the completed command sends down.
    free: True if the command needs no control lease.
    """

    id: int
    name: str
    arguments: tuple[Argument, ...]
    modes: tuple[Mode, ...]
    meaning: str
    example: str = ""
    sends: str = ""
    free: bool = False

    @property
    def typed(self) -> str:
        """Name as people type it: `faults mask` if the first word is a family, else the name with dashes."""
        family, _, rest = self.name.partition("_")
        return f"{family} {rest}" if family in FAMILIES and rest else self.name.replace("_", "-")

    @property
    def moves(self) -> bool:
        """True if the command starts a mode in which the wheels run: it must not start long after it was issued."""
        runs = {row.mode for row in MODES if row.wheels == "run"}
        return any(way.event == self.name and way.next in runs for way in TRANSITIONS)

    @property
    def frees(self) -> bool:
        """True if the command moves the rover or lets it move again: it `moves`, or leaves SAFE or ESTOP."""
        return self.moves or any(
            way.event == self.name and way.state in _HOLDS and way.next not in _HOLDS for way in TRANSITIONS
        )


FAMILIES = ("map", "faults", "param", "fence", "sequence", "lease", "contacts", "keys")
_ALL = tuple(Mode)
_HOLDS = (Mode.SAFE, Mode.ESTOP)
_STANDS = (Mode.STANDBY, Mode.SAFE)
_READY = (Mode.STANDBY, Mode.AUTONOMOUS)
_TELEOP = (Mode.STANDBY, Mode.TELEOP)
_FAULT = Argument("fault", "", 0, 0, "name of its row", text=True, most=24, known=FAULTS)
_SEQUENCE = Argument("sequence", "", 0, 0, "its name", text=True, most=16)
_PARAMETER = Argument("parameter", "", 0, 0, "section.key, as in the configuration file", text=True, most=48)
TABLE = (
    Command(
        1,
        "goto",
        (
            Argument("x_m", "m", -_FAR_M, _FAR_M, "east in the map frame"),
            Argument("y_m", "m", -_FAR_M, _FAR_M, "north in the map frame"),
            Argument("heading_rad", "rad", -math.pi, math.pi, "final yaw; left out: any", required=False),
        ),
        _READY,
        "drive to a place by itself",
        "12 3",
    ),
    Command(2, "stop", (), _ALL, "end all motion; AUTONOMOUS, TELEOP and SEQUENCE become STANDBY", free=True),
    Command(3, "safe", (), _ALL, "go to SAFE", free=True),
    Command(4, "resume", (), (Mode.SAFE,), "leave SAFE for STANDBY"),
    Command(5, "status", (), _ALL, "report mode, phase and pose", free=True),
    Command(
        6,
        "get",
        (
            Argument("product", "", 0, 0, "what to send down", choices=PRODUCT_NAMES),
            Argument(
                "from_s", "s", 0.0, 1e8, "of the record: onboard time; left out: 10 s before to_s", required=False
            ),
            Argument("to_s", "s", 0.0, 1e8, "of the record: onboard time; left out: a second ago", required=False),
            Argument(
                "channels",
                "",
                0,
                0,
                "of the record; slim: without scanner, bus, link, plans",
                required=False,
                choices=("all", "slim"),
            ),
        ),
        _ALL,
        "send a product down",
        "record 120 130 slim",
        free=True,
    ),
    Command(7, "emergency_stop", (), _ALL, "wheels off at once, latched", free=True),
    Command(8, "reset", (), (Mode.ESTOP,), "release the latch of the emergency stop"),
    Command(9, "scan", (), (Mode.STANDBY,), "scan where the rover stands and enter it in the map"),
    Command(
        10,
        "turn",
        (Argument("heading_rad", "rad", -math.pi, math.pi, "yaw in the map frame"),),
        _TELEOP,
        "turn on the spot, as the operator sees fit",
        "90",
    ),
    Command(
        11,
        "drive",
        (
            Argument("vx_mps", "m/s", -0.2, 0.2, "speed ahead"),
            Argument("vy_mps", "m/s", -0.2, 0.2, "speed to the left"),
            Argument("yaw_radps", "rad/s", -0.25, 0.25, "turning to the left"),
            Argument("duration_s", "s", 0.1, 60.0, "ends it, steering included"),
            Argument("distance_m", "m", 0.05, 10.0, "ends it as well"),
        ),
        _TELEOP,
        "move as told, no map asked, until one of its bounds is reached",
        "0.1 0 0 20 1.5",
    ),
    Command(
        12,
        "mission",
        (Argument("goals_m", "m", -_FAR_M, _FAR_M, "east and north of each", most=16),),
        _READY,
        "drive to one goal after the other by itself",
        "4 0 8 3 0 0",
    ),
    Command(13, "map_clear", (), (Mode.STANDBY,), "forget the rover's own map, on its disk too"),
    Command(14, "faults_list", (), _ALL, "report which faults are active and which rows are masked", free=True),
    Command(
        15, "faults_clear", (_FAULT,), _STANDS, "end the mask of a row and check its condition again", "ENCODER_BAD"
    ),
    Command(
        16,
        "faults_mask",
        (
            _FAULT,
            Argument("lasting_s", "s", 1.0, 86_400.0, "until the mask ends by itself"),
        ),
        (*_READY, Mode.TELEOP, Mode.SAFE),
        "do not take a row's response for a while",
        "COMMAND_LOST 600",
    ),
    Command(17, "time", (), _ALL, "report onboard time, and UTC where the rover knows it", free=True),
    Command(18, "reboot", (), _STANDS, "end the flight program in a second; it comes up in STANDBY"),
    Command(
        19,
        "param_list",
        (),
        _ALL,
        "send all parameters, their ranges and the changes made",
        sends="parameters",
        free=True,
    ),
    Command(20, "param_get", (_PARAMETER,), _ALL, "report a parameter", "motion.cruise_mps", free=True),
    Command(
        21,
        "param_set",
        (
            _PARAMETER,
            Argument("value", "", 0, 0, "as in the configuration file", text=True, most=64),
        ),
        (*_READY, Mode.TELEOP, Mode.SAFE),
        "change a parameter",
        "motion.cruise_mps 0.09",
    ),
    Command(22, "param_save", (), (*_READY, Mode.TELEOP, Mode.SAFE), "keep the parameters for the next start"),
    Command(
        23,
        "fence_add",
        (
            Argument("fence", "", 0, 0, "its name; one of the same name is replaced", text=True, most=16),
            Argument("kind", "", 0, 0, "keep_out: never entered; goal: goals lie within", choices=("keep_out", "goal")),
            Argument("corners_m", "m", -_FAR_M, _FAR_M, "east and north of each", most=16, least=3),
        ),
        _ALL,
        "put a fence in force",
        "pit keep_out 2 1 4 1 4 3 2 3",
    ),
    Command(
        24,
        "fence_clear",
        (Argument("fence", "", 0, 0, "its name; left out: all", required=False, text=True, most=16),),
        _ALL,
        "take a fence out of force",
        "pit",
    ),
    Command(25, "fence_list", (), _ALL, "send the fences that are in force", sends="fences", free=True),
    Command(26, "return", (), _READY, "drive back to the start along the way that was driven"),
    Command(
        27,
        "sequence_upload",
        (
            _SEQUENCE,
            Argument("number", "", 1.0, 32.0, "of the step, from 1"),
            Argument("line", "", 0, 0, "the step, as protocol.tables.sequences has it", text=True, most=100),
        ),
        _ALL,
        "one step of a sequence",
        "survey 1 after 5 or continue goto 3 1",
    ),
    Command(28, "sequence_clear", (_SEQUENCE,), (*_READY, Mode.SAFE), "forget a sequence", "survey"),
    Command(
        29, "sequence_check", (_SEQUENCE,), _ALL, "send what each step would do", "survey", sends="sequence", free=True
    ),
    Command(30, "sequence_run", (_SEQUENCE,), (Mode.STANDBY,), "run a sequence", "survey"),
    Command(31, "sequence_abort", (), (Mode.SEQUENCE,), "end the sequence and what it does"),
    Command(40, "lease_ask", (), _ALL, "ask for the control lease; who holds it is told", free=True),
    Command(41, "lease_release", (), _ALL, "give the control lease to who waits for it, or free it", free=True),
    Command(42, "lease_show", (), _ALL, "report who holds the control lease and who waits for it", free=True),
    Command(
        43,
        "contacts_set",
        (Argument("windows_s", "s", 0, 2_000_000.0, "begin and end of each, onboard time", most=16),),
        _ALL,
        "say nothing outside of these windows",
        "600 1200 4200 4800",
    ),
    Command(44, "contacts_clear", (), _ALL, "speak at any time"),
    Command(
        45,
        "keys_rotate",
        (Argument("epoch", "", 0, 255, "one that is loaded, later than the present one"),),
        _ALL,
        "put a key epoch in force, for good",
        "1",
    ),
)
_BY_NAME = {row.name: row for row in TABLE}
_BY_ID = {row.id: row for row in TABLE}
HALTING = ("stop", "safe", "emergency_stop")
_HALTING = frozenset(_BY_NAME[name].id for name in HALTING)


class RefusedError(ValueError):
    """The command cannot be executed now; the text gives the reason and what is allowed."""


def named(name: str, known: Collection[str], what: str) -> str:
    """Return `name` if it is known. Raises RefusedError with the known names and the nearest match."""
    if name in known:
        return name
    near = difflib.get_close_matches(name, known, n=1)
    raise RefusedError(
        f"unknown {what} `{name}`; "
        + (f"did you mean `{near[0]}`?" if near else f"known: {', '.join(known) or 'none'}")
    )


def command(name: str) -> Command:
    """Return the row of a name. Raises RefusedError with the known names and the nearest match."""
    return _BY_NAME[named(name, _BY_NAME, "command")]


def check(name: str, arguments: Arguments) -> dict[str, Value]:
    """Check arguments and return them in the row's order, numbers as float, without those left out.

    Raises ValueError with the argument's name, the given value and the allowed values.
    """
    row = command(name)
    unknown = [key for key in arguments if key not in {a.name for a in row.arguments}]
    if unknown:
        names = ", ".join(a.name for a in row.arguments) or "none"
        raise ValueError(f"{name}: unknown argument `{unknown[0]}`; takes {names}")
    checked: dict[str, Value] = {}
    for argument in row.arguments:
        given = arguments.get(argument.name)
        if given is None:
            if argument.required:
                raise ValueError(f"{name}: `{argument.name}` is missing ({argument.allowed})")
            continue
        try:
            value = checked[argument.name] = check_argument(argument, given)
            if argument.known:
                named(str(value), argument.known, argument.name)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
    return checked


def parse(words: Sequence[str]) -> tuple[str, dict[str, Value]]:
    """Parse a typed command (`goto 12 3 90`): arguments in the row's order, angles in degrees. Raises ValueError."""
    name, given = _name_of(words)
    row = command(name)
    arguments: dict[str, Value] = {}
    for argument in row.arguments:
        count = len(given) if argument.takes_rest and argument is row.arguments[-1] else 1
        taken, given = given[:count], given[count:]
        if taken:
            try:
                arguments[argument.name] = from_words(argument, taken)
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from None
    if given:
        takes = " ".join(argument.name for argument in row.arguments) or "nothing"
        raise ValueError(f"{row.typed} takes {takes}, found {' '.join(words[len(row.typed.split()) :])}")
    return name, check(name, arguments)


def _name_of(words: Sequence[str]) -> tuple[str, Sequence[str]]:
    """Split off the row's name; accepts `faults mask X 60` and `emergency-stop` as well as the names in the table."""
    if words[0] in FAMILIES:
        known = [row.typed.split()[1] for row in TABLE if row.typed.startswith(words[0] + " ")]
        return f"{words[0]}_{named(words[1] if len(words) > 1 else '', known, words[0] + ' command')}", words[2:]
    return words[0].replace("-", "_"), words[1:]


def allowed_in(mode: Mode) -> tuple[str, ...]:
    """Names of the commands that a mode allows."""
    return tuple(row.name for row in TABLE if mode in row.modes)


def check_mode(name: str, mode: Mode) -> None:
    """Raise RefusedError if `mode` does not allow the command, with the modes that do and the commands allowed now."""
    row = command(name)
    if mode not in row.modes:
        others = sorted(allowed_in(mode), key=lambda other: len(command(other).modes))  # the most specific ones first
        where = ", ".join(allowed.name for allowed in row.modes)
        now = ", ".join(command(other).typed for other in others)
        raise RefusedError(f"{row.typed} is refused in {mode.name}: it needs {where}; allowed now: {now}")


class Telecommand(NamedTuple):
    """One request as sent over the link. Times are onboard time.

    request_id: id of the request, unique within its station.
    issued_ns: issue time; 0: unknown.
    expiry_ns: the command is not executed after this time; 0: never expires.
    name: name of the command.
    arguments: values by name.
    start_ns: the command is not started before this time; 0: at once.
    """

    request_id: int
    issued_ns: int
    expiry_ns: int
    name: str
    arguments: dict[str, Value]
    start_ns: int = 0


def encode(telecommand: Telecommand) -> bytes:
    """Encode the payload. Raises ValueError as `check` does."""
    row = command(telecommand.name)
    arguments = check(telecommand.name, telecommand.arguments)
    times_ns = telecommand.issued_ns, telecommand.expiry_ns, telecommand.start_ns
    head = _HEAD.pack(telecommand.request_id, *times_ns, row.id)
    return head + b"".join(pack(argument, arguments.get(argument.name)) for argument in row.arguments)


def halts(payload: bytes) -> bool:
    """True for a telecommand to execute at once that only ends motion; no lease, boot id or version is required."""
    if len(payload) != _HEAD.size:
        return False
    *_, start_ns, command_id = _HEAD.unpack(payload)
    return start_ns == 0 and command_id in _HALTING


def request_id_of(payload: bytes) -> int | None:
    """Return the request id, also if the rest is malformed; None if the payload is too short."""
    return int.from_bytes(payload[:4], "little") if len(payload) >= 4 else None


def decode(payload: bytes) -> Telecommand:
    """Decode a request; ranges are not checked here.

    Raises WireError("telecommand") on an unknown id or a wrong length.
    """
    if len(payload) < _HEAD.size:
        raise WireError("telecommand", f"{len(payload)} B")
    request_id, issued_ns, expiry_ns, start_ns, command_id = _HEAD.unpack_from(payload)
    row = _BY_ID.get(command_id)
    if row is None:
        raise WireError("telecommand", f"unknown command id {command_id}")
    arguments: dict[str, Value] = {}
    at = _HEAD.size
    for argument in row.arguments:
        value, at = unpack(argument, payload, at)
        if value is not None:
            arguments[argument.name] = value
    if at != len(payload):
        raise WireError("telecommand", f"{row.name} with {len(payload)} B")
    return Telecommand(request_id, issued_ns, expiry_ns, row.name, arguments, start_ns)
