"""Generator of generated/can_frames.py, the texts of rover.dbc for tools that run without a DBC parser: `make codec`.

The codec (make_can_codec.py) contains what a tick needs; this file contains what people need: layout, units, ranges,
comments, receivers, cycle times. A test compares file and DBC.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import cantools

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tools.make_can_codec import family_name  # noqa: E402

HEAD = '''"""The frames of rover.dbc in words, made by tools/make_can_frames.py. Change the DBC and run `make codec`.

FRAMES: can id -> Layout, in the order of priority. The codec of the same frames is protocol/generated/can_codec.py.
"""

from typing import NamedTuple


class Signal(NamedTuple):
    """One signal: little-endian, `start` is its least significant bit. `choices`: names of the values 0, 1, 2, ..."""

    name: str
    start: int
    length: int
    signed: bool
    scale: float
    low: float
    high: float
    unit: str
    comment: str
    choices: tuple[str, ...] = ()


class Layout(NamedTuple):
    """One frame. `cycle_ms`: regular interval, `fast_ms`: while its sender is busy, `delay_ms`: shortest between two
    frames sent on events; 0 where there is none. `family`: shared by frames of one layout.
    """

    name: str
    can_id: int
    family: str
    sender: str
    receivers: tuple[str, ...]
    event: bool
    cycle_ms: int
    fast_ms: int
    delay_ms: int
    comment: str
    signals: tuple[Signal, ...]
'''


def generate(dbc_path: Path) -> str:
    """Return the text of the module for a DBC file."""
    database: Any = cantools.database.load_file(dbc_path)
    messages = sorted(database.messages, key=lambda m: m.frame_id)
    families = {family_name(m.name): m for m in reversed(messages)}
    nodes = "".join(f'    "{node.name}": "{node.comment}",\n' for node in database.nodes)
    parts = [
        HEAD,
        f"BITS_PER_S = {database.dbc.attributes['BusSpeed'].value}",
        f"NODES: dict[str, str] = {{\n{nodes}}}",
        *(f"_{name} = (\n{_signals(families[name])})" for name in sorted(families)),
        "FRAMES: dict[int, Layout] = {\n" + "".join(map(_row, messages)) + "}",
    ]
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def _signals(message: Any) -> str:
    rows = ""
    for s in sorted(message.signals, key=lambda s: s.start):
        choices = tuple(str(s.choices[value]) for value in range(len(s.choices))) if s.choices else ()
        row = (
            s.name,
            s.start,
            s.length,
            s.is_signed,
            s.conversion.scale,
            s.minimum,
            s.maximum,
            s.unit or "",
            s.comment or PROTECTION[s.name],
        )
        rows += f"    Signal{(*row, choices) if choices else row!r},\n"
    return rows


PROTECTION = {"counter": "alive counter, one more with each frame", "crc": "CRC-8 over id and bytes 0 to 6"}


def _row(message: Any) -> str:
    attributes = message.dbc.attributes
    times = [
        int(attributes[key].value) if key in attributes else 0
        for key in ("GenMsgCycleTime", "GenMsgCycleTimeFast", "GenMsgDelayTime")
    ]
    event = "GenMsgSendType" in attributes and attributes["GenMsgSendType"].value == 1
    receivers = tuple(message.signals[0].receivers)
    family = family_name(message.name)
    return (
        f'    {message.frame_id:#05x}: Layout(\n        "{message.name}", {message.frame_id:#05x}, "{family}", '
        f'"{message.senders[0]}",\n        {receivers!r},\n        {event}, {times[0]}, {times[1]}, {times[2]},\n'
        f"        {message.comment!r},\n        _{family},\n    ),\n"
    )


def main() -> None:
    """Read the DBC, write the module."""
    (ROOT / "protocol" / "generated" / "can_frames.py").write_text(generate(ROOT / "protocol" / "rover.dbc"))


if __name__ == "__main__":
    main()
