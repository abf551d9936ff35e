"""Progress bars of transfers in a terminal; other lines are printed above them.

Without a terminal a Teller writes lines.
"""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from ground.cli.operations.operate import Teller
from ground.link.news import News, ProductHeard
from ground.link.news import Progress as Moved
from protocol.visible import visible_lines


class Bars(Teller):
    """A Teller for people at a terminal."""

    def __init__(self, out: Callable[[str], None], report_s: float, console: Console | None = None) -> None:
        self._console = console or Console()
        self._bars: Progress | None = None
        self._of: dict[str, TaskID] = {}
        self._plain = out
        super().__init__(self._above, False, report_s)

    def _above(self, line: str) -> None:
        """Print a line, above the bars if there are any."""
        if self._bars is None:
            self._plain(line)
        else:
            self._console.print(visible_lines(line), markup=False, highlight=False, soft_wrap=True)

    def news(self, news: list[News]) -> None:
        """Move a bar at progress, remove it when its product arrives, print all other news."""
        for one in news:
            if isinstance(one, Moved):
                self._move(one)
            elif isinstance(one, ProductHeard):
                self._end(one.product.name)
        super().news([one for one in news if not isinstance(one, Moved)])

    def close(self) -> None:
        """Remove the bars and restore the terminal."""
        if self._bars is not None:
            self._bars.stop()
            self._bars = None
            self._of.clear()

    def _move(self, moved: Moved) -> None:
        if self._bars is None:
            chunks = TextColumn("{task.completed} of {task.total} chunks", markup=False)
            columns = (TextColumn("{task.description}", markup=False), BarColumn(), chunks, TimeRemainingColumn())
            self._bars = Progress(*columns, console=self._console, transient=True)
            self._bars.start()
        if moved.name not in self._of:
            self._of[moved.name] = self._bars.add_task(moved.name, total=moved.total)
        self._bars.update(self._of[moved.name], completed=moved.have, total=moved.total)

    def _end(self, name: str) -> None:
        if self._bars is not None and name in self._of:
            self._bars.remove_task(self._of.pop(name))
            if not self._of:
                self.close()
