"""Bar of past runs: choice of a run of the archive, a time slider, and the way back to live."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from datetime import UTC, datetime
from typing import NamedTuple

from nicegui import run, ui

from ground.archive.schema import ArchiveError
from ground.page.past.replay import Replay, RunRow

_LIVE = 0
_STEP_S = 10.0


class Chosen(NamedTuple):
    """A run and a time in it, ns of the station's clock."""

    row: RunRow
    at_ns: int


class PastBar:
    """The bar. changed: awaited after each change; `chosen` is then the new choice, None: live."""

    def __init__(self, replay: Replay, changed: Callable[[], Awaitable[None]]) -> None:
        self._replay, self._changed = replay, changed
        self._runs: dict[int, RunRow] = {}
        self._busy = self._again = False
        self.chosen: Chosen | None = None
        with ui.element("section").classes("past-bar").props('aria-label="Past runs"') as self._bar:
            self._select = ui.select({_LIVE: "live"}, value=_LIVE, label="shown", on_change=self._selected)
            self._select.props("dense outlined options-dense").classes("past-select")
            with ui.element("div").classes("past-time") as self._time:
                self._button("−10 s", lambda: self._step(-_STEP_S))
                self._slider = ui.slider(min=0.0, max=1.0, step=0.5, value=0.0, on_change=self._moved)
                self._slider.props('aria-label="time in the run, s"')
                self._button("+10 s", lambda: self._step(_STEP_S))
                self._button("Back to live", self._live)
            self._words = ui.label("").classes("past-words")
        self._time.set_visibility(False)
        ui.timer(0.05, self._load, once=True)

    @staticmethod
    def _button(text: str, on_click: Callable[[], None]) -> None:
        ui.button(text, color="light-blue-2", on_click=on_click).props("no-caps outline dense")

    async def _load(self) -> None:
        try:
            rows = await run.io_bound(self._replay.runs)
        except ArchiveError as error:
            self._words.set_text(f"past runs cannot be read: {error}")
            return
        self._runs = {row.run: row for row in rows or ()}
        options = {row.run: run_words(row) for row in self._runs.values()}
        self._select.set_options({_LIVE: "live", **options}, value=_LIVE)

    def _live(self) -> None:
        self._select.set_value(_LIVE)

    def _step(self, by_s: float) -> None:
        self._slider.set_value(min(max(self._slider.value + by_s, 0.0), float(self._slider.props["max"])))

    async def _selected(self) -> None:
        row = self._runs.get(self._select.value)
        self._time.set_visibility(row is not None)
        self._bar.classes(add="past" if row else "", remove="" if row else "past")
        if row is None:
            self.chosen = None
            self._words.set_text("")
            await self._changed()
            return
        length_s = (row.last_ns - row.first_ns) / 1e9
        self._slider.props(f"max={length_s:.3f}")
        self.chosen = None  # a slider that stands there already reports no change
        self._slider.set_value(length_s)
        await self._moved()

    async def _moved(self) -> None:
        """Show the slider's time. Moves that come while one is drawn are drawn as one, the last."""
        row = self._runs.get(self._select.value)
        if row is None:
            return
        self._again = True
        if self._busy:
            return
        self._busy = True
        try:
            while self._again and self._runs.get(self._select.value) is row:
                self._again = False
                fresh = Chosen(row, row.first_ns + round(float(self._slider.value or 0.0) * 1e9))
                if fresh == self.chosen:
                    continue
                self.chosen = fresh
                self._words.set_text(f"PAST, NOT LIVE: {at_words(fresh)}. STOP acts on the rover of now.")
                await self._changed()
        finally:
            self._busy = False

    def say(self, text: str) -> None:
        """Show a failure."""
        self._words.set_text(text)


def run_words(row: RunRow) -> str:
    """Return number, begin and length of a run."""
    begin = datetime.fromtimestamp(row.utc_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M UTC") if row.utc_ns else "lock-step"
    minutes, seconds = divmod(round((row.last_ns - row.first_ns) / 1e9), 60)
    return f"run {row.run}: {begin}, {minutes} min {seconds:02d} s{f', {row.note}' if row.note else ''}"


def at_words(chosen: Chosen) -> str:
    """Return the time as UTC, or as seconds of a run in lock-step."""
    row, at_ns = chosen
    since = f"{(at_ns - row.first_ns) / 1e9:.1f} s of run {row.run}"
    if not row.utc_ns:
        return since
    return f"{datetime.fromtimestamp((row.utc_ns + at_ns) / 1e9, UTC).strftime('%Y-%m-%d %H:%M:%S UTC')}, {since}"
