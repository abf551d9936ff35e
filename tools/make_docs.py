"""Generator of the pages made from tables, the picture of the frames, the rover's URDF: `make docs`.

A test compares.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from hil.plant.ros_urdf import ros_urdf  # noqa: E402
from onboard.config import Rover  # noqa: E402
from protocol.ccsds import xtce  # noqa: E402
from protocol.tables import commands, modes  # noqa: E402
from protocol.tables.faults import FAULTS, ResponseStep  # noqa: E402
from tools.installation import licences  # noqa: E402
from tools.pages import icd as icd_page  # noqa: E402
from tools.pages import icd_picture  # noqa: E402
from tools.pages import messages as messages_page  # noqa: E402
from tools.pages import sensors as sensors_page  # noqa: E402
from tools.pages import wire as wire_page  # noqa: E402

DOCS = ROOT / "docs"


def faults() -> str:
    """Page of the fault table and the meaning of its steps."""
    rows = [
        (
            str(row.number),
            f"`{row.name}`",
            row.condition,
            f"{row.detect_s:g} s",
            _steps(row.response),
            "yes" if row.latched else "",
            "yes" if row.maskable else "",
            ", ".join(f"`{name}`" for name in row.suppressed_by),
        )
        for row in FAULTS
    ]
    heads = ("no.", "fault", "condition", "found within", "response", "latched", "may be masked", "suppressed by")
    steps = [(f"`{step.name}`", step.value) for step in ResponseStep]
    return _page(
        "Faults",
        "protocol/tables/faults.py",
        "What the rover watches at each tick, how soon a fault is found, and what the rover does about it. The time "
        "counts from the first missing or violating sample to the tick whose outputs hold the response.",
        _table(heads, rows),
        "## Steps of a response",
        _table(("step", "means"), steps),
    )


def mode_page() -> str:
    """Page of modes, phases, transitions as a drawing and as a table, events."""
    arrows = [f"    {row.state.name} --> {row.next.name}: {row.event}" for row in modes.TRANSITIONS]
    drawing = "\n".join(["```mermaid", "stateDiagram-v2", "    [*] --> BOOT", *arrows, "```"])
    table = [(f"`{row.mode.name}`", row.wheels, row.meaning) for row in modes.TABLE]
    ways = [(f"`{r.state.name}`", r.event, f"`{r.next.name}`", r.meaning) for r in modes.TRANSITIONS]
    phases = ", ".join(f"`{phase.name}`" for phase in modes.Phase)
    events = [(f"`{row.name}`", row.severity, row.meaning) for row in modes.EVENTS]
    return _page(
        "Modes and events",
        "protocol/tables/modes.py",
        "The rover's modes, their transitions, and the events that the rover reports.",
        _table(("mode", "wheels", "meaning"), table),
        drawing,
        _table(("in", "event", "leads to", "when"), ways),
        f"Phases within `AUTONOMOUS`: {phases}.",
        "## Events",
        _table(("event", "severity", "meaning"), events),
    )


def command_page() -> str:
    """Page of the commands with their arguments and the modes that allow them."""
    rows = []
    for row in commands.TABLE:
        names = " ".join(_argument(argument) for argument in row.arguments)
        where = "all" if len(row.modes) == len(modes.Mode) else ", ".join(mode.name for mode in row.modes)
        rows.append((str(row.id), f"`{row.typed}`", names, where, row.meaning))
    arguments = [
        (f"`{row.typed}`", f"`{a.name}`", _range(a), "" if a.required else "may be left out", a.meaning)
        for row in commands.TABLE
        for a in row.arguments
    ]
    return _page(
        "Commands",
        "protocol/tables/commands.py",
        "What the ground may ask of the rover. Each crosses the link with a request id, is carried out once however "
        "often it arrives, and is answered by reports until the ground has one. Not in an allowed mode, it is refused "
        "with what would be allowed.",
        _table(("id", "command", "arguments", "modes", "meaning"), rows),
        "## Arguments",
        _table(("command", "argument", "allowed", "", "meaning"), arguments),
        "`ground COMMAND --help` says how each is typed. Angles are typed and told in degrees; on the wire they are "
        "radians.",
    )


def icd() -> str:
    """Page of frames, signals, protection, duties, load."""
    return _page("The bus, for who builds a node", "protocol/rover.dbc", *icd_page.sections(_table))


def message_page() -> str:
    """Page of every message of the dialect."""
    return _page("Messages of the rover", "protocol/eldorado.xml", *messages_page.messages(_table))


def wire() -> str:
    """Page of the link's bytes."""
    return _page("The link on the wire", "protocol/", *wire_page.sections(_table))


def gateway_page() -> str:
    """Page of the gateway's mapping of commands, messages and parameters."""
    return _page("The gateway's tables", "ground/gateway", *messages_page.gateway(_table))


PAGES: dict[str, Callable[[], str]] = {
    "faults.md": faults, "modes.md": mode_page, "commands.md": command_page, "icd.md": icd,
    "sensors.md": sensors_page.page, "messages.md": message_page, "gateway-tables.md": gateway_page,
    "pictures/can-frames.svg": icd_picture.svg, "eldorado.xtce.xml": xtce.xtce,
    "link-wire.md": wire, "licences.md": licences.page, "rover.urdf": lambda: ros_urdf(Rover()),
}  # fmt: skip


def _steps(steps: Iterable[ResponseStep]) -> str:
    return ", ".join(f"`{step.name}`" for step in steps)


def _argument(argument: commands.Argument) -> str:
    return f"`{argument.name}`" if argument.required else f"[`{argument.name}`]"


def _range(argument: commands.Argument) -> str:
    if argument.choices:
        return ", ".join(f"`{choice}`" for choice in argument.choices)
    return argument.allowed


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def _page(title: str, source: str, *parts: str) -> str:
    note = f"<!-- Made from {source} by tools/make_docs.py: change the table there and run `make docs`. -->"
    return "\n\n".join([note, f"# {title}", *parts]) + "\n"


def main() -> None:
    """Write every page."""
    for name, made in PAGES.items():
        (DOCS / name).write_text(made(), encoding="utf-8")


if __name__ == "__main__":
    main()
