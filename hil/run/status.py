"""Status of a run on standard error: one live line on a terminal, elsewhere a line every few seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.text import Text

EVERY_S = 9.0  # with half a second between two reports, a log has a line within 10 s
Tell = Callable[[Text, float], None]


@contextmanager
def status(console: Console, first: Text) -> Iterator[Tell]:
    """Yield tell(text, wall_s), which shows the status after that wall time; the last line is printed on every exit."""
    if console.is_terminal:
        with Live(first, console=console, refresh_per_second=4) as live:
            yield lambda text, _: live.update(text)
        return
    console.print(first, soft_wrap=True)
    log = _Log(console)
    try:
        yield log.tell
    finally:
        log.end()


class _Log:
    """Prints a text if EVERY_S have passed since the line before, and the last text."""

    def __init__(self, console: Console) -> None:
        self._console, self._printed_s, self._waiting = console, 0.0, Text()

    def tell(self, text: Text, wall_s: float) -> None:
        self._waiting = text
        if wall_s - self._printed_s >= EVERY_S:
            self._printed_s = wall_s
            self.end()

    def end(self) -> None:
        if self._waiting:
            self._console.print(self._waiting, soft_wrap=True)
            self._waiting = Text()
