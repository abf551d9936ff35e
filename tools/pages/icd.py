"""Page docs/icd.md: frames and duties of a bus node, generated from rover.dbc and the code's own figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from hil.devices.can import nodes as emulated
from hil.devices.can.node import HEARTBEAT_NS, STOP_NS
from onboard.bringup.can.bits import worst_bits
from onboard.bringup.can.load import Case, FrameLoad, analyse, total
from onboard.config import Can
from onboard.devices import emergency, tilt
from protocol.can.guard import LATE_CYCLES
from protocol.generated.can_codec import DBC_VERSION, TABLE
from protocol.generated.can_frames import BITS_PER_S, FRAMES, NODES, Layout, Signal
from tools.pages.icd_picture import family_title, ids_of

Table = Callable[[Sequence[str], Iterable[Sequence[str]]], str]

CRC_C = """\
uint8_t frame_crc(uint16_t id, const uint8_t data[8])   /* of bytes 0 to 6; compare with or store to data[7] */
{
    uint8_t crc = 0xFF;
    for (int i = -2; i < 7; i++) {
        crc ^= i == -2 ? (uint8_t)(id >> 8) : i == -1 ? (uint8_t)id : data[i];
        for (int bit = 0; bit < 8; bit++)
            crc = (uint8_t)(crc & 0x80 ? crc << 1 ^ 0x1D : crc << 1);
    }
    return crc ^ 0xFF;
}"""
HANDSHAKE = """\
```mermaid
sequenceDiagram
    participant N as a node
    participant B as bus
    participant C as computer
    N->>B: EMERGENCY_STOP_n (10 Hz)
    Note over N,C: every node latches: drives ramp to zero, orders are ignored
    C->>B: RESET_REQUEST nonce, step 1 (10 Hz until all have answered)
    B->>N: each stopped node is armed
    N->>B: NODE_HEARTBEAT out of turn, state RESET_ARMED
    C->>B: RESET_REQUEST the same nonce, step 2 (10 Hz until all have answered)
    B->>N: each armed node is released, the asserting one asserts no more
    N->>B: NODE_HEARTBEAT out of turn, state RUNNING or COMMAND_TIMEOUT
```"""


def sections(table: Table) -> list[str]:
    """Sections of the page below its title; `table(heads, rows)` formats the tables."""
    families: dict[str, list[Layout]] = {}
    for layout in FRAMES.values():
        families.setdefault(layout.family, []).append(layout)
    return [
        _prose(f"""
            Version {DBC_VERSION} of [rover.dbc](../protocol/rover.dbc): {len(FRAMES)} frames on CAN 2.0A,
            {BITS_PER_S // 1000} kbit/s, standard 11-bit ids, always 8 bytes, signals little-endian (Intel). The file
            loads in cantools, SavvyCAN, Wireshark and CANdb++; this page is its text and what the file cannot say. How
            to look at a bus is in [can.md](can.md)."""),
        "![Every bit of every frame](pictures/can-frames.svg)",
        "## Nodes",
        table(("node", "what it is", "sends"), map(_node, NODES)),
        "## Frames",
        table(("id", "frame", "from", "to", "rate", "meaning"), map(_frame, FRAMES.values())),
        "A lower id wins the bus: stop before time before orders before feedback.",
        "## Signals",
        _prose("""
            Value = raw x scale; a range narrower than the bits is checked on both ends: a frame with one value out of
            it is dropped whole. Bits without a signal are sent as 0 and not looked at."""),
        *(_family(members, table) for members in families.values()),
        *_protection(),
        *_duties(table),
        *_reset(),
        *_time(),
        *_load(table),
    ]


def _node(name: str) -> tuple[str, str, str]:
    sent = [layout for layout in FRAMES.values() if layout.sender == name]
    return f"`{name}`", NODES[name], ", ".join(f"0x{layout.can_id:03X}" for layout in sent)


def _frame(layout: Layout) -> tuple[str, ...]:
    others = [name for name in NODES if name != layout.sender]
    to = (
        "all"
        if list(layout.receivers) == others
        else ", ".join(layout.receivers).replace("WHEEL_1, WHEEL_2, WHEEL_3, WHEEL_4", "all wheels")
    )
    return f"0x{layout.can_id:03X}", f"`{layout.name}`", layout.sender, to, _rate(layout), layout.comment


def _rate(layout: Layout) -> str:
    slow, fast = (f"{1000 / ms:g} Hz" if ms else "" for ms in (layout.cycle_ms, layout.fast_ms))
    if layout.event:
        return f"on the event, then {slow}" if slow else f"on command, at most {1000 / layout.delay_ms:g} Hz"
    return f"{slow} to {fast}" if fast else slow


def _family(members: list[Layout], table: Table) -> str:
    first = members[0]
    heads = ("signal", "bits", "type", "scale", "range", "unit", "meaning")
    rows = [_signal(s) for s in first.signals if s.name not in ("counter", "crc")]
    return f"### `{family_title(members)}` ({ids_of(members)})\n\n{first.comment}\n\n{table(heads, rows)}"


def _signal(signal: Signal) -> tuple[str, ...]:
    last = signal.start + signal.length - 1
    bits = f"{signal.start}" if signal.length == 1 else f"{signal.start} to {last}"
    kind = f"{'int' if signal.signed else 'uint'}{signal.length}"
    unit = "" if signal.unit == "1" else signal.unit
    values = "; ".join(f"{number} {name}" for number, name in enumerate(signal.choices))
    meaning = f"{signal.comment}: {values}" if values else signal.comment
    limits = f"{_number(signal.low)} to {_number(signal.high)}"
    return f"`{signal.name}`", bits, kind, _number(signal.scale), limits, unit, meaning


def _number(value: float) -> str:
    return str(int(value)) if value == int(value) else f"{value:.6g}"


def _protection() -> Iterable[str]:
    example = TABLE[0x101].encode(2, 0.25, -1.5, 7)
    yield "## Protection"
    yield _prose("""
        Bits 52 to 55 (byte 6, upper half) are the alive counter: one more with each frame of an id, 15 is followed by
        0, a frame that is sent again has a new one. Byte 7 is CRC-8 SAE J1850 (polynomial 0x1D, start 0xFF, final
        exclusive-or 0xFF, most significant bit first) over the id as two bytes, high byte first, and bytes 0 to 6.""")
    yield f"```c\n{CRC_C}\n```"
    yield _prose(f"""
        For example `WHEEL_1_COMMAND` with mode 2 (RUN), steer_rad 0.25, rate_radps -1.5 and counter 7 is
        `101#{example.hex().upper()}`.""")
    yield _prose(f"""
        A receiver drops and counts a frame with a wrong CRC, with the counter of the frame before it (repeated), with
        a value out of its range or not 8 bytes long. It counts, but takes, one after a gap in the counter (lost) or
        after more than {LATE_CYCLES:g} intervals (late). Every single and double bit error and every burst of up to 8
        bits is found; the tests try them all, in every frame (`tests/protocol/can/test_can_damage.py`).""")


def _duties(table: Table) -> Iterable[str]:
    config = Can()
    yield "## Duties"
    yield table(
        ("who", "does"),
        [
            (who, _prose(duty))
            for who, duty in (
                (
                    "each node",
                    f"""beats at {_hz(HEARTBEAT_NS)} with state, error counters, firmware and the version of this file
            that it was built with; a computer does not drive a node of another version""",
                ),
                (
                    "each node",
                    """latches at the first good EMERGENCY_STOP of any sender, ramps its drive to zero, ignores
            orders, and stays so until the handshake below; losing power releases it too""",
                ),
                (
                    "each node",
                    f"with a reason of its own to stop asserts its EMERGENCY_STOP at once, then at {_hz(STOP_NS)}",
                ),
                (
                    "a wheel",
                    f"""without a good WHEEL_n_COMMAND for {_ms(emulated.COMMAND_TIMEOUT_NS)} ramps its drive to zero,
            holds its steering and says COMMAND_TIMEOUT: a dead computer or cable stops the rover""",
                ),
                (
                    "a wheel",
                    f"""turns only with DRIVE_ENABLE: without enable, or without the frame for
            {_ms(emulated.ENABLE_TIMEOUT_NS)}, its drive ramps to zero""",
                ),
                (
                    "a wheel",
                    f"""changes its rate by at most {emulated.SLEW_RADPS2:g} rad/s², to stop in an emergency by
            {emulated.STOP_RADPS2:g} rad/s²; the ramp is the node's, the order is the target""",
                ),
                (
                    "a wheel",
                    """in OFF powers no motor, in HOLD steers to its angle with the drive at zero, in RUN steers and
            turns""",
                ),
                ("a wheel", "measures steering, encoder and rate of one feedback frame at one instant"),
                (
                    "the tilt axis",
                    f"""stamps each feedback with its own free-running clock at the instant of the encoder sample;
            holds the running segment and the next two, which come at least {_ms(tilt.LEAST_AHEAD_NS)} ahead, takes
            segments with one start time for one order, and says GAP where one is missed""",
                ),
                (
                    "the computer",
                    f"""takes a wheel's feedback older than {_ms(config.stale_ns)} for stale and stops the rover
            within the next cycle; after {_ms(config.silent_ns)} it goes to SAFE""",
                ),
                ("the computer", "is alone: there is one sender of 0x080 to 0x120 and 0x300 on the bus"),
            )
        ],
    )


def _reset() -> Iterable[str]:
    yield "## Emergency stop and reset"
    yield HANDSHAKE
    yield _prose(f"""
        Both steps bear one nonce; step 2 with another one, or to a node that is not armed, does nothing. A new
        EMERGENCY_STOP disarms. The computer gives the reset up when a node that beats (within the last
        {emergency.LOST_NS / 1e9:g} s) has not answered within {emergency.RESET_LIMIT_NS / 1e9:g} s; all stay stopped
        then.""")


def _time() -> Iterable[str]:
    yield "## Time"
    yield _prose("""
        Nobody sets a node's clock. TIME_SYNC tells bus time in µs for the *start times* of tilt segments only: the low
        16 bits of its milliseconds are what TILT_COMMAND names, and the value nearest to now is meant (half a window is
        32.8 s). The computer maps the axis's own stamps to its time by the lower envelope of their arrival.""")


def _load(table: Table) -> Iterable[str]:
    cases = {case: analyse(case) for case in Case}
    rows = [
        (
            f"0x{row.can_id:03X}",
            f"`{row.name}`",
            f"{row.period_s * 1e3:g}",
            *(_response(row.name, cases[case]) for case in Case),
            f"{row.load_ratio:.2%}",
        )
        for row in cases[Case.EVERYTHING]
    ]
    yield "## Load and worst response times"
    yield _prose(f"""
        Each frame at its shortest interval with every stuff bit ({worst_bits(8)} bits,
        {1e6 * worst_bits(8) / BITS_PER_S:.0f} µs); response is from release to the last bit, in ms, by the sufficient
        test of Davis and others (2007). *Operation*: all regular frames, the axis sweeps. *Emergency*: every node
        asserts its stop too, the axis stands. *Everything*: both at once, which lasts less than one interval
        (TILT_FEEDBACK may be late by one then). `onboard can load` prints the same.""")
    loads = ", ".join(f"{case.value} {total(found):.1%}" for case, found in cases.items())
    yield f"Load of the bus: {loads}; a test keeps it below 40 %."
    yield table(("id", "frame", "interval ms", *(case.value for case in Case), "load"), rows)


def _prose(text: str) -> str:
    """Join a paragraph to one line."""
    return " ".join(text.split())


def _response(name: str, rows: Iterable[FrameLoad]) -> str:
    return next((f"{row.response_s * 1e3:.2f}" for row in rows if row.name == name), "")


def _ms(ns: int) -> str:
    return f"{ns / 1e6:g} ms"


def _hz(ns: int) -> str:
    return f"{1e9 / ns:g} Hz"
