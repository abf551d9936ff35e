"""Screen of `onboard can watch`: a table redrawn in a terminal; elsewhere, each second, a line for each frame."""

from __future__ import annotations

import json
from collections.abc import Iterable
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.table import Table

from onboard.bringup.can.candump import ReceivedFrame
from onboard.bringup.can.decode import DecodedFrame, Decoder
from onboard.bringup.can.show import WIDTH, line_of, row_of, signals_text
from onboard.records import Frame

_REDRAW_NS, _LINE_NS, _OLD_NS = 200_000_000, 1_000_000_000, 1_500_000_000


class Screen:
    """Context manager that shows the newest frames. chosen: the ids to show."""

    def __init__(self, chosen: frozenset[int], as_json: bool) -> None:
        self._chosen, self._json = chosen, as_json
        self._console = Console()
        self._moving = self._console.is_terminal and not as_json
        self._live = Live(console=self._console, auto_refresh=False)
        self._decoder = Decoder()
        self._newest: dict[int, DecodedFrame] = {}
        self._counts: dict[int, int] = {}
        self._bad: dict[int, int] = {}
        self._rates: dict[int, float] = {}
        self._shown_ns = self._since_ns = 0

    def __enter__(self) -> Screen:
        if self._moving:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._moving:
            self._live.stop()

    def show(self, frames: Iterable[Frame], now_ns: int) -> None:
        """Decode the received frames and redraw if due."""
        for frame in frames:
            if frame.can_id in self._chosen:
                seen = self._decoder.receive(ReceivedFrame(frame.stamp_ns, frame.can_id, frame.data))
                self._counts[frame.can_id] = self._counts.get(frame.can_id, 0) + 1
                self._bad[frame.can_id] = self._bad.get(frame.can_id, 0) + bool({*seen.problems} - {"late"})
                if seen.values is not None:
                    self._newest[frame.can_id] = seen
        if now_ns - self._since_ns >= _LINE_NS:
            seconds, self._since_ns = (now_ns - self._since_ns) / 1e9, now_ns
            self._rates = {can_id: count / seconds for can_id, count in self._counts.items()}
            self._counts.clear()
        if now_ns - self._shown_ns >= (_REDRAW_NS if self._moving else _LINE_NS):
            self._shown_ns = now_ns
            self._draw(now_ns)

    def _draw(self, now_ns: int) -> None:
        if self._moving:
            self._live.update(self._table(now_ns), refresh=True)
            return
        fresh = [seen for _, seen in sorted(self._newest.items()) if now_ns - (seen.stamp_ns or 0) <= _OLD_NS]
        if self._json:
            frames = {seen.name: {**row_of(seen), "rate_hz": self._rates.get(seen.can_id)} for seen in fresh}
            print(json.dumps({"t_s": now_ns / 1e9, "frames": frames}), flush=True)
        elif fresh:
            print("\n".join(map(line_of, fresh)), flush=True)
        else:
            print(f"{now_ns / 1e9:12.3f}  nothing heard for a second", flush=True)

    def _table(self, now_ns: int) -> Table:
        table = Table(box=None, pad_edge=False)
        for head, width in (("frame", WIDTH), ("rate/s", 6), ("age ms", 6), ("bad", 4)):
            table.add_column(head, min_width=width, justify="left" if head == "frame" else "right", no_wrap=True)
        table.add_column("signals, units as in their names", no_wrap=True, overflow="ellipsis")
        for can_id, seen in sorted(self._newest.items()):
            age_ns = now_ns - (seen.stamp_ns or 0)
            rate, bad = self._rates.get(can_id, 0.0), self._bad.get(can_id, 0)
            told = signals_text(can_id, seen.values or {}, units=False)
            style = "dim" if age_ns > _OLD_NS else ""
            table.add_row(seen.name, f"{rate:.0f}", f"{age_ns / 1e6:.0f}", str(bad or ""), told, style=style)
        return table if self._newest else Table("nothing heard yet; `onboard can info` looks for the cause", box=None)
