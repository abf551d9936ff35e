"""TABLE of the commands: action of the sensor for each request, and the statuses of its refusals.

Order of the checks: command (0E), string (0G, 0H), length (0C, 0D), features of the model (0F, 03, 04), state (10, 0L,
0M), fields. A status whose meaning no source gives is marked [?]; they are in docs/lidar.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from hil.devices.lidar.profile import Profile
from hil.devices.lidar.states import DRILLS, Machine, SensorState, Task
from hil.devices.lidar.turns import BEAMS
from protocol import scip

REQUEST_LIMIT = 64  # bytes of a line; the longest legal one, MD with a string, has 32
SHOTS_LIMIT = 8  # GD requests without an answer yet
RB_WITHIN_NS = 1_000_000_000
BAUDS = ("019200", "038400", "057600", "115200", "250000", "500000", "750000")
ALWAYS = frozenset(("VV", "PP", "II", "%ST", "QT", "RB"))
# state -> (status of a refusal, commands that are not refused)
CLOSED: Mapping[SensorState, tuple[str, frozenset[str]]] = {
    SensorState.BOOTING: ("10", ALWAYS),
    SensorState.TIMING: ("10", frozenset(("TM", "QT", "RS", "RT", "RB", "%ST"))),
    SensorState.SLEEP: ("10", ALWAYS | {"RS", "RT"}),
    SensorState.WAKING: ("10", ALWAYS | {"RS", "RT"}),
    SensorState.FAULT: ("0L", ALWAYS | {"BM", "DB"}),
}


class CommandReply(NamedTuple):
    """Status and lines of a reply. quick: True if it does not wait for the reply tick."""

    status: str
    lines: bytes = b""
    quick: bool = False


class CommandRow(NamedTuple):
    """One command.

    run: run(machine, request) returns the answer, or None
    absent: absent(profile) returns the refusal of a model without the command, "" with it
    """

    run: Callable[[Machine, scip.Request], CommandReply | None]
    absent: Callable[[Profile], str] = lambda profile: ""


def answer(machine: Machine, asked: scip.Request) -> CommandReply | None:
    """Reply of the sensor; None for no reply, or not yet."""
    if len(asked.echo) > REQUEST_LIMIT:
        return CommandReply("0B")
    if machine.refusal:
        return CommandReply(machine.refusal)
    row, refusal = COMMANDS.get(asked.code), scip.refusal(asked)
    if row is None:
        return CommandReply(asked.status if asked.status != "00" else "0E")
    status = row.absent(machine.profile)
    if status or refusal != "00":
        return CommandReply(status if status == "0E" or refusal == "00" else refusal)
    if refused := _closed(machine, asked.code):
        return CommandReply(refused)
    return row.run(machine, asked)


def _closed(machine: Machine, code: str) -> str:
    refusal, exceptions = CLOSED.get(machine.state, ("", ALWAYS))
    if machine.state is SensorState.TIMING:
        exceptions |= machine.profile.quirks.timing_answers
    return "" if code in exceptions else refusal


# -- what it is and how it does --------------------------------------------------------------------------------


def _text(profile: Profile, pairs: tuple[tuple[str, str], ...]) -> bytes:
    quirks, lines = profile.quirks, b""
    for key, value in pairs:
        text = f"{key}:{' ' if quirks.leading_blanks else ''}{value}".encode()
        summed = text + b";" if quirks.sum_with_semicolon else text
        if quirks.sum_stops_at_arrow:
            summed = summed.partition(b"<-")[0]
        lines += text + b";" + scip.checksum(summed) + b"\n"
    return lines


def _version(machine: Machine, asked: scip.Request) -> CommandReply:
    return CommandReply("00", _text(machine.profile, machine.profile.texts.version))


def _parameters(machine: Machine, asked: scip.Request) -> CommandReply:
    return CommandReply("00", _text(machine.profile, machine.profile.texts.parameters))


def _information(machine: Machine, asked: scip.Request) -> CommandReply:
    texts, time_ms = machine.profile.texts, machine.counter.ms(machine.now_ns)
    coded = machine.profile.quirks.time_in_characters
    time = scip.encode_value(time_ms, 4).decode() if coded else f"{time_ms:06X}"
    state = machine.mode_before if machine.now_ns < machine.mode_ns else machine.state
    return CommandReply(
        "00",
        _text(
            machine.profile,
            (
                ("MODL", texts.parameters[0][1]),
                ("LASR", "ON" if machine.laser_on else "OFF"),
                ("SCSP", texts.speed),
                ("MESM", texts.mode(state.value)),
                ("SBPS", texts.link),
                ("TIME", time),
                ("STAT", texts.trouble if machine.state is SensorState.FAULT else texts.well),
            ),
        ),
    )


def _state(machine: Machine, asked: scip.Request) -> CommandReply:
    return CommandReply("00", scip.state_line(machine.report))


# -- states ----------------------------------------------------------------------------------------------------


def _light(machine: Machine, asked: scip.Request) -> CommandReply:
    if machine.state is SensorState.FAULT or machine.unstable:
        return CommandReply("01")
    if machine.laser_on:
        return CommandReply("02")
    machine.light(SensorState.SINGLE)
    return CommandReply("00")


def _quiet(machine: Machine, asked: scip.Request) -> CommandReply | None:
    machine.quits += 1
    if machine.profile.quirks.deaf_quit and machine.stream is not None and machine.quits == 1:
        return None
    machine.mode_ns, machine.mode_before = machine.now_ns + machine.profile.quirks.late_idle_ns, machine.state
    machine.stop()
    if machine.state is SensorState.SLEEP:
        machine.wake()
    return CommandReply("00")


def _reset(machine: Machine, asked: scip.Request) -> CommandReply:
    machine.stop()
    if machine.state is SensorState.SLEEP:
        machine.wake()
    machine.counter.reset(machine.now_ns)
    machine.sensitive = False
    if asked.code == "RS":
        machine.to_default_speed()
    return CommandReply("00")


def _reboot(machine: Machine, asked: scip.Request) -> CommandReply:
    first_ns, machine.reboot_asked_ns = machine.reboot_asked_ns, machine.now_ns
    if machine.now_ns - first_ns > RB_WITHIN_NS:
        return CommandReply("01")
    machine.power_on_soon()
    return CommandReply("00")


def _sleep(machine: Machine, asked: scip.Request) -> CommandReply:
    machine.stop()
    machine.state = SensorState.SLEEP
    return CommandReply("00")


def _time(machine: Machine, asked: scip.Request) -> CommandReply:
    quirks, timing = machine.profile.quirks, machine.state is SensorState.TIMING
    match asked.parameters:
        case "0":
            machine.stop()
            machine.state = SensorState.TIMING
            return CommandReply("02" if timing and not quirks.time_twice else "00")
        case "1":
            if not timing and not quirks.time_anywhere:
                return CommandReply("04", quick=True)
            middle_ns = machine.now_ns + machine.profile.time_reply_ns / 2
            return CommandReply("00", scip.stamp_line(machine.counter.ms(middle_ns)), quick=True)
        case "2":
            machine.state = SensorState.STANDBY if timing else machine.state
            return CommandReply("00" if timing else "03")
    return CommandReply("01")


# -- settings --------------------------------------------------------------------------------------------------


def _baud(machine: Machine, asked: scip.Request) -> CommandReply:
    if not asked.parameters.isdecimal():
        return CommandReply("01")
    if asked.parameters not in BAUDS:
        return CommandReply("02")
    was, machine.baud = machine.baud, asked.parameters
    return CommandReply("03" if was == asked.parameters else "00")


def _speed(machine: Machine, asked: scip.Request) -> CommandReply:
    if not asked.parameters.isdecimal():
        return CommandReply("01")
    step = int(asked.parameters)
    if step > 10 and step != 99:
        return CommandReply("02")
    was, machine.speed_step = machine.speed_step, step % 99
    if was == machine.speed_step and step != 99:
        return CommandReply("03")
    machine.turns.slow_down(machine.speed_step, machine.now_ns)
    return CommandReply("00")


def _sensitivity(machine: Machine, asked: scip.Request) -> CommandReply:
    if asked.parameters not in ("0", "1"):
        return CommandReply("01")
    was, machine.sensitive = machine.sensitive, asked.parameters == "1"
    return CommandReply("02" if was == machine.sensitive else "00")


def _drill(machine: Machine, asked: scip.Request) -> CommandReply:
    code = asked.parameters
    if not code.isdecimal():
        return CommandReply("01")
    if code == "10":
        machine.recover()
        return CommandReply("00")
    if code not in DRILLS:
        return CommandReply("02")
    if machine.drill:
        return CommandReply("03")
    if machine.state is not SensorState.STANDBY:
        return CommandReply("05")
    machine.start_drill(code)
    if code == "02":
        machine.state = SensorState.FAULT
    return CommandReply("00")


# -- scans -----------------------------------------------------------------------------------------------------


def _measure(machine: Machine, asked: scip.Request) -> CommandReply | None:
    made = scip.parse_scan_request(asked, BEAMS - 1)
    if isinstance(made, str):
        return CommandReply(made)
    if machine.unstable:
        return CommandReply("0M")
    if not made.streams:
        if not machine.laser_on:
            return CommandReply("10")
        if len(machine.shots) >= SHOTS_LIMIT:
            return CommandReply("0B")
        machine.shots.append(Task(made, asked.echo, machine.laser_ns, 0, 0))
        return None
    machine.light(SensorState.MULTI)
    machine.quits = 0
    machine.stream = Task(made, asked.echo, machine.now_ns, made.scans, made.skip)
    return CommandReply("00")


def _one_echo(profile: Profile) -> str:
    return "" if profile.echoes > 1 else "0E"


COMMANDS: Mapping[str, CommandRow] = {
    "VV": CommandRow(_version),
    "PP": CommandRow(_parameters),
    "II": CommandRow(_information),
    "%ST": CommandRow(_state, lambda profile: "" if profile.quirks.state_command else "0E"),
    "BM": CommandRow(_light),
    "QT": CommandRow(_quiet),
    "RS": CommandRow(_reset),
    "RT": CommandRow(_reset),
    "RB": CommandRow(_reboot),
    "%SL": CommandRow(_sleep),
    "TM": CommandRow(_time),
    "SS": CommandRow(_baud, lambda profile: {"network": "0F", "fixed": "04"}.get(profile.baud, "")),
    "CR": CommandRow(_speed, lambda profile: "" if profile.speeds else "04"),
    "HS": CommandRow(_sensitivity, lambda profile: "" if profile.sensitivities else "03"),
    "DB": CommandRow(_drill, lambda profile: "" if profile.drills else "04"),
    **{code: CommandRow(_measure) for code in ("MD", "MS", "ME", "GD", "GS", "GE")},
    **{code: CommandRow(_measure, _one_echo) for code in ("ND", "NE", "HD", "HE")},
}
