"""Terminal view of `ground watch`, by textual: map, state, events, link, command line, stop key.

link  | one line: last reception, round trip, contact          The station's turns run in one task of the
map   | state                                                  event loop; drawing is a timer beside it. A key
events                                                         makes its request at once, before any drawing.
stop line, command line, keys
"""

from __future__ import annotations

import asyncio
from typing import ClassVar

from rich.color import Color
from rich.style import Style
from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Input, Static

from ground.cli.operations.open_requests import left
from ground.cli.shell.terminal import Live
from ground.cli.watch.model import Stop, View, stop_words
from ground.cli.watch.picture import FREE, HIDDEN, OBSTACLE, draw, window
from ground.cli.watch.state import GOOD, LABEL, WRONG, duration, headline, state
from ground.link.contact import NOT_HEARD_THERE, Uplink
from protocol.visible import visible

_PAUSE_S, _DRAW_S = 0.01, 0.25
_MOST_ZOOM = 5
_KEYS = "^X STOP  ^G map  ^O/^P zoom  PgUp/PgDn events  Enter command  ^Q quit"
_COLOURS = {"station": LABEL, "debug": LABEL, "info": GOOD, "warning": "#e6b422", "error": WRONG, "critical": WRONG}


class WatchApp(App[int]):
    """The view. Its result is 0, or 130 after Ctrl-C; `failure` is the error that ended the link, or None.

    live: the session's turns.
    view: what is shown beside the session.
    """

    ENABLE_COMMAND_PALETTE = False
    CSS = """
    Screen { layout: vertical; }
    #link { height: 1; background: $panel; }
    #middle { height: 3fr; min-height: 8; }
    #map { width: 1fr; height: 100%; }
    #state { width: 42%; min-width: 37; max-width: 60; height: 100%; padding: 0 1; }
    #events { height: 1fr; min-height: 4; border-top: solid $panel; }
    #stop { height: 1; }
    #command { height: 1; border: none; padding: 0 1; }
    #keys { height: 1; background: $panel; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+x,f12", "stop", "STOP", priority=True),
        Binding("ctrl+g", "fetch", "fetch the map", priority=True),
        Binding("ctrl+o", "zoom(-1)", "zoom out", priority=True),
        Binding("ctrl+p", "zoom(1)", "zoom in", priority=True),
        Binding("pageup", "scroll(3)", "older lines", priority=True),
        Binding("pagedown", "scroll(-3)", "newer lines", priority=True),
        Binding("ctrl+q", "leave(0)", "quit", priority=True),
        Binding("ctrl+c", "leave(130)", "quit", priority=True),
    ]

    def __init__(self, live: Live, view: View) -> None:
        super().__init__()
        self.live, self.view = live, view
        self.failure: Exception | None = None
        self.zoom = 0
        self.back = 0  # rows of the event list below its pane
        self._turning: asyncio.Task[None] | None = None
        self._map_shown: tuple[object, ...] = ()
        self._uplink = Uplink()

    def compose(self) -> ComposeResult:
        """Make the panes."""
        yield Static(id="link")
        with Horizontal(id="middle"):
            yield Static(id="map")
            yield Static(id="state")
        yield Static(id="events")
        yield Static(id="stop")
        yield Input(placeholder="command, as `goto 12 3`; `help` lists them", id="command", compact=True)
        yield Static(Text(_KEYS, no_wrap=True), id="keys")

    def on_mount(self) -> None:
        """Start the turns and the drawing."""
        self.query_one("#command", Input).focus()
        self._turning = asyncio.create_task(self._turns())
        self.set_interval(_DRAW_S, self.show)
        self.call_after_refresh(self.show)

    async def _turns(self) -> None:
        try:
            while not self.live.shell.ended:
                self.live.turn()
                self._add_station_lines()
                await asyncio.sleep(_PAUSE_S)
            self.exit(0)
        except Exception as error:  # noqa: BLE001 - the caller raises it again when the terminal is restored
            self.failure = error
            self.exit(1)

    def _add_station_lines(self) -> None:
        texts = self.live.session.texts
        while texts:
            self.view.add_line(visible(texts.pop(0)))
        if self._uplink.refused(self.live.session, self.live.now_ns):
            self.view.add_line(NOT_HEARD_THERE, "warning")

    # -- keys ----------------------------------------------------------------------------------------------------

    def action_stop(self) -> None:
        """Request a stop, whatever else is on the screen or in the command line."""
        live = self.live
        before = len(live.shell.asked)
        answers = live.line("stop")
        if len(live.shell.asked) > before:
            self.view.stop = Stop(live.now_ns, live.shell.asked[-1])
        self._add_lines(answers)
        self.show()

    def action_fetch(self) -> None:
        """Fetch the map from the rover."""
        self._add_lines(self.live.line("get ldem"))

    def action_zoom(self, step: int) -> None:
        """Zoom the map."""
        self.zoom = min(max(self.zoom + step, 0), _MOST_ZOOM)
        self.show()

    def action_scroll(self, rows: int) -> None:
        """Scroll the event list; new lines move it while it is not at its end."""
        self.back = max(0, self.back + rows)
        self.show()

    def action_leave(self, code: int) -> None:
        """End the view; the rover continues."""
        self.exit(code)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Carry out a typed line."""
        event.input.clear()
        self.back = 0
        if event.value.strip():
            self.view.add_line(f"> {visible(event.value)}")
            self._add_lines(self.live.line(event.value))
            self.show()

    def _add_lines(self, answers: list[str]) -> None:
        for answer in answers:
            self.view.add_line(visible(answer))

    # -- drawing -------------------------------------------------------------------------------------------------

    def show(self) -> None:
        """Draw everything from the present state."""
        session, now_ns = self.live.session, self.live.now_ns
        self.query_one("#link", Static).update(_one_line(*headline(session, now_ns)))
        pane = self.query_one("#state", Static)
        freshness = self.view.freshness(session, now_ns)
        _update(pane, state(session.items, freshness, pane.content_size.width, pane.content_size.height))
        self._show_map()
        self._show_events()
        self.query_one("#stop", Static).update(self._stop_line())

    def _show_map(self) -> None:
        pane, scene = self.query_one("#map", Static), self.view.scene(self.live.session)
        columns, rows = pane.size.width, pane.size.height - 1
        if columns < 2 or rows < 1:
            return
        frame = window(scene, columns, rows, self.zoom)
        words = self._legend(2 * frame.element_m * rows)[:columns]
        content = (id(scene.terrain), scene[1:], frame, columns, rows, words)
        if content == self._map_shown:
            return
        self._map_shown = content
        text = draw(scene, frame, columns, rows)
        text.append(f"\n{words}", LABEL)
        width = len(words)
        for word, colour in (("free", FREE), ("obstacle", OBSTACLE), ("hidden", HIDDEN)):
            width += len(word) + 2
            if self.view.terrain is not None and width <= columns:
                text.append(" ■", Style(color=Color.from_rgb(*colour))).append(word, LABEL)
        _update(pane, text)

    def _legend(self, high_m: float) -> str:
        at_ns = self.view.terrain_ns
        if at_ns is None:
            return f"{high_m:.0f} m high, no map yet: ^G fetches it"
        age_s = (self.live.now_ns - at_ns) / 1e9
        return f"{high_m:.0f} m, map {f'{duration(age_s)} old' if age_s >= 0 else 'of unknown age'}"

    def _show_events(self) -> None:
        pane = self.query_one("#events", Static)
        width, height = pane.content_size
        if height < 1:
            return
        rows = self.view.rows(width, height + self.back)
        self.back = max(0, len(rows) - height)  # not further than the oldest line
        text = Text(no_wrap=True, overflow="ellipsis")
        for row in rows[:height]:
            text.append(f"{row.text}\n", _COLOURS.get(row.severity, WRONG))
        _update(pane, text)

    def _stop_line(self) -> Text:
        if self.view.stop is None:
            return _one_line("; ".join(left(self.live.session)).replace("`ground stop`", "^X"), GOOD)
        return _one_line(stop_words(self.view.stop, self.live.session, self.live.now_ns), "bold reverse")


def _update(pane: Static, text: Text) -> None:
    text.rstrip()
    pane.update(text)


def _one_line(words: str, style: str) -> Text:
    return Text(visible(words), style, no_wrap=True, overflow="ellipsis")
