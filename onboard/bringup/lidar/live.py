"""Screen of `onboard lidar watch`: redrawn in a terminal, one line a second elsewhere."""

from __future__ import annotations

import json
import math
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.text import Text

from onboard.bringup.lidar.show import ScanView, numbers, polar, view
from onboard.devices.lidar.session import LidarSession
from onboard.records import Scan

_REDRAW_NS, _LINE_NS = 100_000_000, 1_000_000_000


class Screen:
    """Context manager that shows the newest scan. reach_m: radius of the polar plot."""

    def __init__(self, draw: bool, reach_m: float, as_json: bool) -> None:
        self._console = Console()
        self._draw, self._reach_m, self._json = draw, reach_m, as_json
        self._moving = self._console.is_terminal and not as_json
        self._live = Live(console=self._console, auto_refresh=False)
        self._newest: Scan | None = None
        self._shown_ns = self._since_ns = self._before = 0
        self._rate_hz = 0.0

    def __enter__(self) -> Screen:
        if self._moving:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._moving:
            self._live.stop()

    def show(self, session: LidarSession, scans: list[Scan], now_ns: int, trouble: str = "") -> None:
        """Redraw if due after this tick.

        trouble: the reason why no scans come; an old scan is not shown as live then.
        """
        newest = scans[-1] if scans else self._newest
        self._newest = None if trouble else newest
        if not self._shown_ns:
            self._shown_ns = self._since_ns = now_ns
        if now_ns - self._since_ns >= _LINE_NS:
            self._rate_hz = (session.counts["scans"] - self._before) * 1e9 / (now_ns - self._since_ns)
            self._before, self._since_ns = session.counts["scans"], now_ns
        if now_ns - self._shown_ns < (_REDRAW_NS if self._moving else _LINE_NS):
            return
        self._shown_ns = now_ns
        self._rate_hz = 0.0 if trouble else self._rate_hz
        line = numbers(self._newest, self._rate_hz, session.counts, session.clock.quality, trouble)
        if self._json:
            print(json.dumps(self._row(session, now_ns, trouble)), flush=True)
        elif self._moving:
            self._live.update(Text("\n".join((*self._plot(self._console.height - 2), line))), refresh=True)
        else:
            print("\n".join((*self._plot(24), line)), flush=True)

    def _plot(self, rows: int) -> list[str]:
        if not self._draw or self._newest is None:
            return []
        drawn = polar(self._newest, max(20, self._console.width - 1), max(8, rows - 1), self._reach_m)
        return [*drawn, f"ahead is up; + is the scanner, upper edge = {self._reach_m:g} m"]

    def _row(self, session: LidarSession, now_ns: int, trouble: str) -> dict[str, object]:
        clock = session.clock.quality
        sigma_ms = clock.sigma_ns / 1e6 if math.isfinite(clock.sigma_ns) else None
        counts = {name: count for name, count in session.counts.items() if count}
        seen = view(self._newest) if self._newest is not None else ScanView()
        return {
            "t_s": round(now_ns / 1e9, 3),
            "rate_hz": round(self._rate_hz, 2),
            "trouble": trouble,
            **seen._asdict(),
            "counts": counts,
            "clock": {"sigma_ms": sigma_ms, "ppm": clock.ppm, "samples": clock.samples},
        }
