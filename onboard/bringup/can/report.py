"""Output of `onboard can info` and `onboard can load`."""

from __future__ import annotations

from onboard.bringup.can.load import Case, FrameLoad, total
from onboard.bringup.can.show import aligned
from onboard.bringup.can.survey import Report
from protocol.generated.can_codec import DBC_VERSION
from protocol.generated.can_frames import FRAMES
from protocol.tables.modes import Mode

_HEADS = ("node", "frames", "state", "firmware", "DBC", "uptime s", "tx err", "rx err")
_KEYS = ("state", "firmware", "dbc_version", "uptime_s", "tx_errors", "rx_errors")
_NOMINAL = {layout.name: layout for layout in FRAMES.values()}


def lines_of(report: Report) -> list[str]:
    """Nodes, rates, load, and each problem with what to do."""
    nodes = [
        (node.name, str(node.frames), *(str((node.beat or {}).get(key, "")) for key in _KEYS))
        for node in report.nodes
        if node.frames and node.name != "COMPUTER"
    ]
    rates = [
        (tally.name, "-" if tally.rate_hz is None else f"{tally.rate_hz:.1f}", _due(tally.name))
        for tally in report.tallies
    ]
    head = f"listened {report.span_s:.1f} s: load {report.load_ratio:.1%}, {report.error_frames} error frames; "
    return [
        head + f"this program has version {DBC_VERSION} of rover.dbc",
        *(["", *aligned([_HEADS, *nodes])] if nodes else []),
        *_computer(report),
        *(["", *aligned([("frame", "rate/s", "due"), *rates])] if rates else []),
        "",
        *([f"! {finding}" for finding in report.findings] or ["all is well"]),
    ]


def load_lines(case: Case, rows: list[FrameLoad]) -> list[str]:
    """One case as a table."""
    cells = [
        (
            row.name,
            f"{row.can_id:#05x}",
            f"{row.period_s * 1e3:.0f} ms",
            f"{row.wire_s * 1e6:.0f} us",
            f"{row.response_s * 1e3:.2f} ms",
            f"{row.load_ratio:.2%}",
        )
        for row in rows
    ]
    heads = (case.value, "id", "period", "wire", "response", "load")
    return aligned([heads, *cells, ("all", "", "", "", "", f"{total(rows):.1%}")])


def _computer(report: Report) -> list[str]:
    beat = next(node.beat for node in report.nodes if node.name == "COMPUTER")
    if beat is None:
        return ["", "no flight computer on this bus"]
    mode = Mode(beat["mode"]).name if beat["mode"] <= max(Mode) else str(beat["mode"])
    return ["", f"a flight computer commands this bus: mode {mode}, start {beat['boot_count']}"]


def _due(name: str) -> str:
    layout = _NOMINAL[name]
    if layout.event:
        return "on events"
    slow = f"{1000 / layout.cycle_ms:g}"
    return f"{slow} to {1000 / layout.fast_ms:g}" if layout.fast_ms else slow
