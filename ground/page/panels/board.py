"""One browser's page: NiceGUI elements, the orders of an operator, and what the server pushes to it."""

from __future__ import annotations

import asyncio
import math
from concurrent.futures import Future
from typing import Any

from nicegui import run, ui

from ground.archive.schema import ArchiveError
from ground.page.live import orders
from ground.page.live.series import F64
from ground.page.map import drawn, layers
from ground.page.panels.components import Commands, Feed, Headline, Link, MapView, Values, View3d, Wheels
from ground.page.past.bar import PastBar, at_words
from ground.page.view.model import view
from ground.page.view.tree_feed import PAST, past_text
from ground.page.view.words import label
from ground.page.web.access import Role
from ground.page.web.site import Site
from ground.products.preview import NoMapError
from onboard.config import ConfigError
from protocol.tables import commands
from protocol.tables.telemetry import BY_NAME

QUICK = (
    ("Scan", "scan"),
    ("Fetch map", "get ldem"),
    ("Fetch cloud", "get scan"),
    ("Fetch deviations", "get height_std"),
    ("Fetch decision", "get nsp"),
    ("Fetch fences", "fence list"),
    ("Return", "return"),
    ("Safe", "safe"),
    ("Resume", "resume"),
)
PLOTS = (
    "goal_distance_m",
    "speed_mps",
    "x_m",
    "y_m",
    "yaw_rad",
    "sigma_position_m",
    "voltage_v",
    "current_a",
    "charge_ratio",
    "roll_rad",
    "pitch_rad",
    "cpu_ratio",
    "tick_worst_ms",
)
LIGHT = "light-blue-2"  # outlined buttons: 11 to 1 on the dark ground
_TAKEN_S = 5.0
_SEVERE = {"warning", "error", "critical"}


def _scale(name: str) -> float:
    """Return the factor from an item's unit to that of people."""
    return math.degrees(1.0) if BY_NAME[name].unit.startswith("rad") else 1.0


def _plotted(name: str, points: F64) -> list[list[float | None]]:
    """Return time in ms and value of each point, as the plot takes them; None for a value that is no number."""
    scale = _scale(name)
    return [[round(utc_s * 1000), None if value != value else value * scale] for utc_s, value in points.tolist()]


async def handed_over(taken: Future[int], name: str, limit_s: float) -> str:
    """Wait until the link's thread has taken an order. Returns words for the operator.

    After `limit_s` an order that halts the rover stays and is sent first; any other is withdrawn.

    Raises ValueError for a withdrawn order, and the thread's error for a refused one.
    """
    waiting = asyncio.wrap_future(taken)
    try:
        await asyncio.wait_for(asyncio.shield(waiting), limit_s)
    except TimeoutError:
        if name in commands.HALTING:
            return "waits for the link, and is sent first when it is open"
        if taken.cancel():
            raise ValueError(f"not sent: the link's thread has not taken it within {limit_s:g} s") from None
        await waiting
    return "asked for; its chain is under Commands"


class Board:
    """One page. `push` sends what has changed since the last push. who: origin of its orders."""

    def __init__(self, site: Site, role: Role, who: str) -> None:
        self._site, self._operator, self._who = site, role is Role.OPERATOR, who
        self._sent_maps: tuple[Any, ...] = ()
        self._sent_trail = (-1, 0)
        self._sent_events: tuple[Any, ...] = ()
        self._sent_points = ("", 0)
        self._sent_tree = site.feed.number
        self._previewed: tuple[float, float] | None = None
        self._draw()

    # -- from the server ------------------------------------------------------------------------------------

    def push(self, maps: dict[str, Any], slow: bool) -> None:
        """Send what has changed. maps: the tree of the maps. slow: the plot too."""
        if self._past.chosen is not None:
            return
        feed = self._site.feed
        self._feed.run_method("show", feed.text(self._sent_tree))
        self._sent_tree = feed.number
        self._push_maps(maps)
        self._push_trail()
        self._push_events(feed.events)
        if slow:
            self._push_plot()

    def _lost(self) -> None:
        """Send a whole tree at the next push: the browser has missed one."""
        self._sent_tree = PAST

    def again(self) -> None:
        """Send all of the map at the next push: the browser has built it now."""
        self._sent_maps, self._sent_trail = (), (-1, 0)

    async def _show_past(self) -> None:
        """Send what was known at the chosen time of a past run; or all of the present again."""
        chosen = self._past.chosen
        self._sent_events, self._sent_points = (), ("", 0)
        self._sent_tree = PAST
        self.again()
        if chosen is None:
            self.push(self._site.maps.tree(), True)
            return
        try:
            found = await run.io_bound(self._site.replay.at, *chosen)
            points = await run.io_bound(self._site.replay.series, chosen.row, self._item.value, chosen.at_ns)
        except ArchiveError as error:
            self._past.say(f"this run cannot be read: {error}")
            return
        if found is None or points is None or self._past.chosen != chosen:
            return  # the server ends, or another time was chosen meanwhile
        tree = view(found.shot, found.shot.mono_ns)
        tree |= {"past": at_words(chosen), "utc_s": tree["utc_s"] or tree["now_s"]}
        self._feed.run_method("show", past_text(tree))
        self._push_maps({**found.maps, "gdem": self._site.maps.tree()["gdem"]})
        self._map.run_method("show_trail", found.trail_m.tolist(), True)
        self._push_events(tree["events"])
        self._plot_whole(points)

    def _push_maps(self, tree: dict[str, Any]) -> None:
        mark = (
            tree["ldem"] and tree["ldem"]["revision"],
            tree["gdem"] is None,
            tree["scan"] and tree["scan"]["buffer"],
            *(tree[name] and tree[name]["utc_s"] for name in drawn.NAMES),
        )
        if mark != self._sent_maps:
            self._sent_maps = mark
            self._map.run_method("show_maps", tree)
            self._view_3d.run_method("show", {name: tree[name] for name in ("ldem", "scan")})

    def _push_trail(self) -> None:
        trail = self._site.live.trail
        begun, sent = self._sent_trail
        places = trail.places
        whole = begun != trail.begun
        if whole or len(places) > sent:
            self._sent_trail = (trail.begun, len(places))
            self._map.run_method("show_trail", [list(one) for one in (places if whole else places[sent:])], whole)

    def _push_events(self, events: list[dict[str, Any]]) -> None:
        known = self._site.acknowledged.keys
        mark = (len(events), events[-1]["key"] if events else "", known)
        if mark == self._sent_events:
            return
        self._sent_events = mark
        rows = [
            {**row, "seen": row["key"] in known, "at": row["utc_s"] or 0, "number": at} for at, row in enumerate(events)
        ]
        self._events.rows = rows[::-1]
        left = sum(not row["seen"] and row["severity"] in _SEVERE for row in rows)
        self._unseen.set_text(f"{left} not acknowledged" if left else "")

    async def _plot_another(self) -> None:
        if self._past.chosen is not None:
            await self._show_past()
        else:
            self._push_plot()

    def _push_plot(self) -> None:
        """Send the values that are new; all of them for another item."""
        series, (name, count) = self._site.live.series, self._sent_points
        wanted = self._item.value
        if name != wanted:
            self._plot_whole(series.of(wanted))
        elif series.count(wanted) > count:
            fresh = _plotted(wanted, series.since(wanted, count))
            self._feed.run_method("plot", self._plot.id, fresh, False)
        self._sent_points = (wanted, series.count(wanted))

    def _plot_whole(self, points: F64) -> None:
        name = self._item.value
        options, scale = self._plot.options, _scale(name)
        options["series"][0]["data"] = _plotted(name, points)
        limits = BY_NAME[name].limits or ()
        options["series"][0]["markLine"]["data"] = [{"yAxis": limit * scale} for limit in limits if abs(limit) < 1e9]
        options["yAxis"]["name"] = f"{label(name)}, {BY_NAME[name].unit.replace('rad', '°') or '–'}"
        self._plot.update()
        self._feed.run_method("plot", self._plot.id, options["series"][0]["data"], True)

    # -- elements -------------------------------------------------------------------------------------------

    def _draw(self) -> None:
        self._feed = Feed(self._site.feed.whole())
        self._feed.on("lost", self._lost)
        Headline()
        self._past = PastBar(self._site.replay, self._show_past)
        with ui.element("div").classes("grid"):
            with ui.element("section").classes("card map-card").props('aria-label="Map"'):
                self._draw_map()
            with ui.element("div").classes("side"):
                if self._operator:
                    with ui.element("section").classes("card").props('aria-label="Orders"'):
                        self._draw_orders()
                with ui.element("section").classes("card"):
                    ui.html("<h2>Commands</h2>", sanitize=False)
                    Commands()
                with ui.element("section").classes("card"):
                    ui.html("<h2>Link</h2>", sanitize=False)
                    Link()
                with ui.element("section").classes("card").props('aria-label="Wheels"'):
                    ui.html("<h2>Wheels</h2>", sanitize=False)
                    Wheels()
            with ui.element("section").classes("card view-3d-card").props('aria-label="3D view"'):
                ui.html("<h2>3D</h2>", sanitize=False)
                self._view_3d = View3d()
                self._view_3d.on("ready", lambda: self.again())
            with ui.element("section").classes("card events-card"):
                self._draw_events()
            with ui.element("section").classes("card plot-card"):
                self._draw_plot()
            with ui.element("section").classes("card values-card"):
                ui.html("<h2>Telemetry</h2>", sanitize=False)
                Values()

    def _draw_map(self) -> None:
        self._map = MapView(self._operator)
        self._map.on("ready", lambda: self.again())
        if self._operator:
            self._map.on("goal", lambda event: self._clicked(event.args))
        with ui.element("div").classes("map-legend"):
            choice = ui.toggle(
                list(layers.LAYERS), value=layers.LAYERS[0], on_change=lambda event: self._layer(event.value)
            )
            choice.props("dense no-caps unelevated").props('aria-label="Layer of the map"')
            self._legend = ui.element("div").classes("legend")
        self._layer(layers.LAYERS[0])

    def _layer(self, layer: str) -> None:
        self._map._props["layer"] = layer
        self._map.update()
        self._legend.clear()
        with self._legend:
            for colour, meaning in layers.legend(layer):
                with ui.element("span"):
                    ui.element("i").style(f"background:{colour}")
                    ui.label(meaning)

    def _draw_orders(self) -> None:
        ui.html("<h2>Drive to a place</h2>", sanitize=False)
        with ui.element("div").classes("goto"):
            self._x = ui.number("x, east, m", format="%.2f", on_change=self._changed).props("dense outlined")
            self._y = ui.number("y, north, m", format="%.2f", on_change=self._changed).props("dense outlined")
            ui.button("Preview", on_click=self._preview).props("no-caps unelevated")
            self._drive = ui.button("Drive there", on_click=self._goto).props("no-caps unelevated color=positive")
        self._drive.disable()
        self._told = ui.label("Click the map, or type x and y; then Preview.").classes("told")
        with ui.element("div").classes("quick"):
            for text, words in QUICK:
                ui.button(text, color=LIGHT, on_click=lambda words=words: self._order(words)).props(
                    "no-caps outline dense"
                )
            ui.switch(
                "map at each stop", value=self._site.map_each_stop, on_change=lambda event: self._each_stop(event.value)
            ).props("dense")
        with ui.element("div").classes("typed"):
            self._line = (
                ui.input("any command, as in a terminal", placeholder="turn 90")
                .props("dense outlined")
                .on("keydown.enter", self._typed)
            )
            ui.button("Send", on_click=self._typed).props("no-caps unelevated dense")

    def _draw_events(self) -> None:
        with ui.element("div").classes("events-head"):
            ui.html("<h2>Events</h2>", sanitize=False)
            self._unseen = ui.label("").classes("unseen-count")
            search = ui.input("search").props("dense outlined clearable")
            if self._operator:
                ui.button("Acknowledge all", color=LIGHT, on_click=self._acknowledge).props("no-caps outline dense")
        columns = [
            {
                "name": "time",
                "label": "time (UTC)",
                "field": "at",
                "align": "left",
                "sortable": True,
                ":format": "v => v > 1e8 ? new Date(v * 1000).toJSON().slice(11, 19) : v ? v.toFixed(1) + ' s' : '–'",
            },
            {"name": "severity", "label": "severity", "field": "severity", "align": "left", "sortable": True},
            {"name": "name", "label": "event", "field": "name", "align": "left", "sortable": True},
            {"name": "text", "label": "text", "field": "text", "align": "left"},
            {"name": "seen", "label": "", "field": "seen", "align": "left", ":format": "v => v ? 'seen' : ''"},
        ]
        self._events = (
            ui.table(columns=columns, rows=[], row_key="number", pagination={"rowsPerPage": 12})
            .props("dense flat wrap-cells :table-row-class-fn=\"row => row.severity + (row.seen ? ' seen' : '')\"")
            .classes("events")
        )
        search.bind_value_to(self._events, "filter")

    def _draw_plot(self) -> None:
        names = {name: label(name) for name in PLOTS}
        self._item = ui.select(names, value=PLOTS[0], label="plot, the last 15 minutes", on_change=self._plot_another)
        self._item.props("dense outlined options-dense").classes("plot-item")
        axis = {"axisLabel": {"color": "#c3cdd5"}, "splitLine": {"lineStyle": {"color": "#2b363e"}}}
        line = {"type": "line", "showSymbol": False, "lineStyle": {"color": "#62b6ff", "width": 2}, "data": []}
        line["markLine"] = {
            "symbol": "none",
            "silent": True,
            "lineStyle": {"color": "#ffb938", "type": "dashed"},
            "label": {"formatter": "limit", "color": "#ffb938"},
            "data": [],
        }
        self._plot = ui.echart(
            {
                "animation": False,
                "grid": {"left": 56, "right": 16, "top": 34, "bottom": 28},
                "textStyle": {"color": "#c3cdd5"},
                "xAxis": {"type": "time", "splitNumber": 4, **axis},
                "yAxis": {"type": "value", "scale": True, "nameTextStyle": {"align": "left"}, **axis},
                "tooltip": {"trigger": "axis"},
                "dataZoom": [{"type": "inside"}],
                "series": [line],
            }
        ).classes("plot")

    # -- orders ---------------------------------------------------------------------------------------------

    async def _clicked(self, place: dict[str, float]) -> None:
        self._x.value, self._y.value = round(float(place["x_m"]), 2), round(float(place["y_m"]), 2)
        await self._preview()

    def _changed(self) -> None:
        """Withdraw the confirmation: it is for the place that was previewed."""
        if self._previewed != (self._x.value, self._y.value):
            self._previewed = None
            self._drive.disable()

    def _refused_in_past(self) -> bool:
        if self._past.chosen is None:
            return False
        self._say("you look at a past run: go back to live to preview and to command; STOP works at any time")
        return True

    async def _preview(self) -> None:
        if self._refused_in_past():
            return
        try:
            orders.goto(self._x.value, self._y.value)
        except ValueError as error:
            self._say(str(error))
            return
        goal = (float(self._x.value), float(self._y.value))
        self._drive.disable()
        self._say("the rover's planner computes ...")
        self._map.run_method("show_goal", list(goal))
        try:
            plan = await run.io_bound(self._site.maps.preview, *goal)
        except (NoMapError, ConfigError, OSError, ValueError) as error:
            self._say(f"no preview: {error}. You can drive there without one.")
            plan = None
        if goal != (self._x.value, self._y.value):
            return  # another place was named meanwhile
        self._previewed = goal
        self._drive.set_text("Drive there" if plan is not None and plan["leads"] else "Drive there all the same")
        self._drive.enable()
        if plan is not None:
            self._map.run_method("show_plan", plan)
            self._say(". ".join([f"{plan['words']} ({plan['kind']}, {plan['rule']})", *plan["warnings"]]))

    async def _goto(self) -> None:
        if self._previewed is None or self._previewed != (self._x.value, self._y.value):
            self._say("preview this place first")
            return
        self._drive.disable()
        await self._ask(*orders.goto(*self._previewed))

    async def _typed(self) -> None:
        if await self._order(self._line.value or ""):
            self._line.value = ""

    async def _order(self, words: str) -> bool:
        try:
            return await self._ask(*orders.parsed(words))
        except ValueError as error:
            self._say(str(error))
            return False

    async def _ask(self, name: str, arguments: Any, lifetime_s: float) -> bool:
        """Hand an order over; the role is checked here once more, on the server."""
        if not self._operator or self._refused_in_past():
            return False
        try:
            taken = self._site.live.ask(name, arguments, self._who, lifetime_s)
            outcome = await handed_over(taken, name, _TAKEN_S)
        except (ValueError, OSError) as error:
            self._say(f"{name}: {error}")
            return False
        self._say(f"{name}: {outcome}")
        return True

    def _each_stop(self, value: bool) -> None:
        self._site.map_each_stop = bool(value) and self._operator

    async def _acknowledge(self) -> None:
        if not self._operator:
            return
        try:
            keys = [row["key"] for row in reversed(self._events.rows)]
            await run.io_bound(self._site.acknowledged.add, keys)  # a slow disk must not hold up STOP
        except OSError as error:
            self._say(f"acknowledged here, not stored: {error.strerror}")

    def _say(self, text: str) -> None:
        if self._operator:
            self._told.set_text(text)
