"""Terminal and pipe of `ground shell`: runs link, clock and archive in turns, and reads the lines."""

from __future__ import annotations

import asyncio
import os
import select
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from ground.archive.store import Archive
from ground.cli.operations import show
from ground.cli.operations.open_requests import left
from ground.cli.operations.operate import CONNECT_S, SHORT_WAIT_S, ByHandError, Teller, closed_words
from ground.cli.shell.shell import OperatorShell, completions
from ground.cli.verbs.screen import line_out, text_out
from ground.link.contact import Contact
from ground.station.clock import Clock, WallClock
from ground.station.settings import StationSettings
from ground.station.station import Station, StationError
from ground.station.user import by_hand

Save = Callable[[Any, str, Path], None]
_PAUSE_S = 0.01


class _ClearedError(Exception):
    """Ctrl-C at the prompt. A KeyboardInterrupt in a task would end the loop of all tasks."""


class Live:
    """One session, turn by turn. contact_s: time limit for the first datagram of the rover, s; 0: none."""

    def __init__(
        self, station: Any, clock: Clock, teller: Teller, shell: OperatorShell, save: Save, contact_s: float
    ) -> None:
        self._station, self._clock, self._teller = station, clock, teller
        self.shell, self._save, self._contact_s = shell, save, contact_s
        self._contact, self.now_ns = Contact(), 0

    @property
    def session(self) -> Any:
        """The station's session."""
        return self._station.session

    def turn(self) -> None:
        """Receive, print, send. Raises StationError if link or rover are absent."""
        turn = self._clock.turn(self._station.sent, None)
        assert turn is not None, "the wall clock does not end"
        self.now_ns = turn.now_ns
        self._teller.news(self._station.turn(turn))
        for name, path in self.shell.arrived(self.session):
            self._save(self.session, name, path)
        self._teller.news(self._station.flush(self.now_ns))
        self._teller.trouble(self._station.trouble, self.now_ns)
        silent_s = self._contact.silent_s(self.session.heard_ns, self.now_ns)
        if silent_s is not None:
            self._teller.silence(silent_s, self.now_ns)
        if self._contact.closed(self._station.linked, self.now_ns):
            raise StationError(closed_words(self.session))
        if self._contact_s and self.session.heard_ns is None and self.now_ns > self._contact_s * 1e9:
            raise StationError(f"nothing heard of the rover within {self._contact_s:g} s")

    def line(self, text: str) -> list[str]:
        """Process a typed line."""
        return self.shell.line(text, self.session, self.now_ns)


def run(
    settings: StationSettings,
    station: Path | None,
    contact_s: float,
    teller: Teller,
    verbs: Callable[[list[str]], int],
    save: Save,
) -> int:
    """Open the link and process lines until `quit`, the end of the pipe, or Ctrl-D. Returns the exit code."""
    began_s = time.monotonic()

    def offline(words: list[str]) -> int:
        named = ["--station", str(station)] if station is not None and "--station" not in words else []
        if words == ["link"]:
            words = ["link", "--since", f"{time.monotonic() - began_s + 1:.0f}s"]
        if words[0] == "preview":
            words = [*words, "--no-fetch"]  # this session is the one that could ask: `param list`
        return verbs([*words, *named])

    with ExitStack() as stack:
        stack.callback(teller.close)
        archive = stack.enter_context(opened(settings, time.time_ns()))
        link = stack.enter_context(Station(settings, archive))
        link.session.asked_by = by_hand("shell")
        link.wait_open(*CONNECT_S)
        live = Live(link, WallClock(), teller, OperatorShell(offline), save, contact_s)
        try:
            if not sys.stdin.isatty():
                return from_pipe(live, piped(sys.stdin.fileno()))
            history = Path(settings.state) / "shell-history" if settings.state else None
            return asyncio.run(in_terminal(live, history))
        except KeyboardInterrupt:
            raise ByHandError("; ".join(["interrupted", *left(link.session)])) from None


def opened(settings: StationSettings, utc_ns: int) -> Archive:
    """Open the station's archive without waiting for a lock: rows are written when the file is free."""
    return Archive(settings.archive or ":memory:", utc_ns, "shell", wait_s=SHORT_WAIT_S, later=True)


def from_pipe(live: Live, lines: Iterator[str | None]) -> int:
    """Process each line after all lines before it have their outcome. lines: None while no line is available."""
    for line in lines:
        live.turn()
        if line is not None:
            line_out(f"> {line}")
            _print(live.line(line))
            while not (live.shell.settled(live.session) or live.shell.ended):
                live.turn()
        if live.shell.ended:
            break
    return live.shell.code(live.session)


def piped(descriptor: int) -> Iterator[str | None]:
    """Yield lines of a file or pipe as they arrive, None while there is none; ends with the file."""
    waiting = b""
    while True:
        if not select.select([descriptor], [], [], 0)[0]:
            yield None
            continue
        data = os.read(descriptor, 65_536)
        *lines, waiting = (waiting + data).split(b"\n")
        for line in lines:
            yield line.decode(errors="replace")
        if not data:
            if waiting:
                yield waiting.decode(errors="replace")
            return


async def in_terminal(live: Live, history: Path | None, **terminal: Any) -> int:
    """Run the prompt and the link's turns in parallel. terminal: input and output for tests without a terminal."""
    from prompt_toolkit import PromptSession
    from prompt_toolkit.auto_suggest import AutoSuggestFromHistory
    from prompt_toolkit.completion import NestedCompleter
    from prompt_toolkit.history import FileHistory, InMemoryHistory
    from prompt_toolkit.patch_stdout import patch_stdout

    if history is not None:
        history.parent.mkdir(parents=True, exist_ok=True)
        history.touch(mode=0o600)
    prompt: PromptSession[str] = PromptSession(
        "ground> ",
        history=InMemoryHistory() if history is None else FileHistory(str(history)),
        completer=NestedCompleter.from_nested_dict(completions()),
        auto_suggest=AutoSuggestFromHistory(),
        bottom_toolbar=lambda: show.status_line(live.session, live.now_ns),
        refresh_interval=1.0,
        interrupt_exception=_ClearedError,
        **terminal,
    )
    with patch_stdout(raw=True):
        turning = asyncio.create_task(_turning(live))
        try:
            while not live.shell.ended:
                asked = asyncio.create_task(prompt.prompt_async())
                done, _ = await asyncio.wait({asked, turning}, return_when=asyncio.FIRST_COMPLETED)
                if turning in done:
                    asked.cancel()
                    await turning  # raises the error that ended it
                try:
                    _print(live.line(asked.result()))
                except EOFError:
                    _print(live.line("quit"))
                except _ClearedError:
                    _print(["Ctrl-D or `quit` ends; `stop` stops the rover"])
        finally:
            turning.cancel()
    return 0


async def _turning(live: Live) -> None:
    while True:
        live.turn()
        await asyncio.sleep(_PAUSE_S)


def _print(lines: list[str]) -> None:
    for line in lines:
        text_out(line)
