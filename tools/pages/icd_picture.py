"""Picture of docs/icd.md: every bit of every frame, one row for frames of one layout, as SVG text."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from protocol.generated.can_frames import FRAMES, Layout, Signal

BIT, ROW, LEFT, TOP, GAP = 15, 34, 232, 46, 7
PROTECTED = {"counter": "#f6d38b", "crc": "#eda493"}
FILLS = ("#bcd7ee", "#d6e8d0")
INK, FAINT = "#1d2733", "#6b7785"
FONT = "font-family='DejaVu Sans Mono, Menlo, Consolas, monospace'"


def svg() -> str:
    """The whole picture."""
    families: dict[str, list[Layout]] = {}
    for layout in FRAMES.values():
        families.setdefault(layout.family, []).append(layout)
    width, height = LEFT + 64 * BIT + 16, TOP + len(families) * (ROW + GAP) + 30
    parts = [
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' "
        f"viewBox='0 0 {width} {height}' {FONT}>",
        f"<rect width='{width}' height='{height}' fill='#ffffff'/>",
        *_ruler(len(families)),
    ]
    for number, members in enumerate(families.values()):
        parts += _row(members, TOP + number * (ROW + GAP))
    note = "bit 0 is the least significant of byte 0; grey is unused and sent as 0"
    parts.append(_text(LEFT, height - 10, note, 11, FAINT))
    return "\n".join([*parts, "</svg>"]) + "\n"


def family_title(members: list[Layout]) -> str:
    """Title of frames of one layout: WHEEL_n_COMMAND for four frames, the name itself for one alone."""
    first = members[0]
    if len(members) == 1:
        return first.name
    return f"{first.family}_*" if first.name.startswith(first.family) else first.name.replace("_1_", "_n_")


def ids_of(members: list[Layout]) -> str:
    """Ids of frames of one layout, consecutive ones joined."""
    runs: list[list[int]] = []
    for layout in members:
        if runs and layout.can_id == runs[-1][1] + 1:
            runs[-1][1] = layout.can_id
        else:
            runs.append([layout.can_id, layout.can_id])
    return ", ".join(f"0x{a:03X}" if a == b else f"0x{a:03X} to 0x{b:03X}" for a, b in runs)


def _ruler(rows: int) -> Iterator[str]:
    bottom = TOP + rows * (ROW + GAP) - GAP
    for byte in range(8):
        x = LEFT + byte * 8 * BIT
        yield _text(x + 4 * BIT, TOP - 26, f"byte {byte}", 12, INK, "middle")
        yield _text(x + BIT / 2, TOP - 9, str(8 * byte), 10, FAINT, "middle")
        yield _text(x + 7.5 * BIT, TOP - 9, str(8 * byte + 7), 10, FAINT, "middle")
    for byte in range(9):
        x = LEFT + byte * 8 * BIT
        yield f"<line x1='{x}' y1='{TOP - 20}' x2='{x}' y2='{bottom + 3}' stroke='#c4ccd4'/>"


def _row(members: list[Layout], y: float) -> Iterator[str]:
    yield _text(LEFT - 10, y + 15, family_title(members), 12, INK, "end")
    yield _text(LEFT - 10, y + 29, ids_of(members), 10, FAINT, "end")
    yield f"<rect x='{LEFT}' y='{y}' width='{64 * BIT}' height='{ROW}' fill='#eef0f2'/>"
    for number, signal in enumerate(members[0].signals):
        yield from _box(signal, PROTECTED.get(signal.name, FILLS[number % 2]), y)


def _box(signal: Signal, fill: str, y: float) -> Iterator[str]:
    x, width = LEFT + signal.start * BIT, signal.length * BIT
    middle_x, middle_y = x + width / 2, y + ROW / 2
    yield f"<rect x='{x}' y='{y}' width='{width}' height='{ROW}' fill='{fill}' stroke='{INK}' stroke-width='0.8'/>"
    if width < 7 * len(signal.name):
        size = min(10.0, 1.55 * ROW / len(signal.name))
        turned = f"rotate(-90 {middle_x:g} {middle_y:g})"
        yield _text(middle_x, middle_y + size / 3, signal.name, size, INK, "middle", turned)
    else:
        yield _text(middle_x, middle_y + 4, signal.name, 11, INK, "middle")


def _text(x: float, y: float, text: str, size: float, fill: str, anchor: str = "start", turned: str = "") -> str:
    transform = f" transform='{turned}'" if turned else ""
    return (
        f"<text x='{x:g}' y='{y:g}' font-size='{size:.3g}' fill='{fill}' text-anchor='{anchor}'{transform}>"
        f"{escape(text)}</text>"
    )
