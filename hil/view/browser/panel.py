"""Control panel of the scene: time, playback, layers, events. Its clicks are stored in a queue."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from viser import GuiApi

from hil.view.browser.player import SPEEDS, Player
from hil.view.browser.scene import LAYERS, Scene
from hil.view.story import Instant, Moment, StoryEvent
from protocol.visible import visible

STEP_S = 0.1
_MARKUP = re.compile(r"[!-/:-@\[-`{-~]")  # ASCII punctuation
MARKS = {"fault": "⚡ ", "warning": "▲ ", "error": "■ ", "critical": "■ "}
LEGEND = "\n".join(
    (
        "- 🟩 map: free",
        "- 🟧 map: obstacle",
        "- 🟨 map: beside unknown ground",
        "- ⬜ map: hidden, grey",
        "- 🩷 rays of the scanner",
        "- ⬛ path driven",
        "- 🟢 path driven, as the rover believes",
        "- 🔵 global path, dashed",
        "- 🟣 path that it drives now",
    )
)


class Panel:
    """Controls and texts. The server's threads put clicks into `clicks`; the loop takes them and owns the player."""

    def __init__(self, gui: GuiApi, scene: Scene, live: bool) -> None:
        self.clicks: SimpleQueue[Callable[[Player, float], None]] = SimpleQueue()
        self._scene, self._told, self._words = scene, "", ""
        gui.configure_theme(show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        gui.set_panel_label("El Dorado")
        self._status = gui.add_markdown("")
        self._time = gui.add_slider("time, s", 0.0, 1.0, STEP_S, 0.0)
        self._hold = gui.add_button("play / pause")
        self._speed = gui.add_dropdown("speed", [f"{speed:g}" for speed in SPEEDS], initial_value="5")
        self._live = gui.add_checkbox("newest", live, visible=live, hint="show the run as far as it has come")
        self._accompany = gui.add_checkbox("follow rover", False, hint="the camera moves as the rover does")
        self._layers = {name: gui.add_checkbox(name[1:], True) for name in LAYERS}
        self._events = gui.add_markdown("")
        gui.add_markdown(LEGEND)
        self._listen()

    def _listen(self) -> None:
        put = self.clicks.put

        def sought(event: Any) -> None:
            if event.client is not None:  # a user's change, not the loop's
                put(lambda player, _: player.seek(event.target.value))

        self._time.on_update(sought)
        self._hold.on_click(lambda _: put(lambda player, end_s: player.toggle(end_s)))
        self._speed.on_update(lambda event: put(lambda player, _: setattr(player, "speed", float(event.target.value))))
        self._live.on_update(
            lambda event: event.client is not None and put(lambda player, _: player.follow(event.target.value))
        )
        for name, box in self._layers.items():
            box.on_update(lambda event, name=name: setattr(self._scene.nodes[name], "visible", event.target.value))

    @property
    def accompanies(self) -> bool:
        """True if the camera moves with the rover."""
        return self._accompany.value

    def show(self, instant: Instant, player: Player, end_s: float, rtf: float) -> None:
        """Update texts and controls to this instant. rtf: real-time factor of the run, 0 unknown."""
        if self._time.max < end_s:
            self._time.max = end_s
        if abs(self._time.value - instant.time_s) >= STEP_S:
            self._time.value = round(min(instant.time_s, self._time.max), 1)
        if self._live.value != player.following:
            self._live.value = player.following
        words = status(instant, end_s, rtf)
        if words != self._words:
            self._words = self._status.content = words
        told = "\n".join(map(event_line, reversed(instant.told)))
        if told != self._told:
            self._told = self._events.content = told


def status(instant: Instant, end_s: float, rtf: float) -> str:
    """Time, speed of the run, mode and phase, true place, active faults, contacts."""
    speed = f"   ×{rtf:.1f} real time" if rtf else ""
    lines = [f"**{instant.time_s:.1f} s** of {end_s:.1f} s{speed}"]
    if instant.mode:
        lines.append(f"**{plain(instant.mode)}**")
    lines.append(place(instant.moment))
    lines += [f"⚡ **fault: {plain(name)}**" for name in instant.faults]
    if instant.moment.contact:
        lines.append(f"■ **touches: {plain(instant.moment.contact)}**")
    return "\n\n".join(lines)


def place(moment: Moment) -> str:
    """True place, heading and tilt of the rover."""
    x_m, y_m, _ = moment.position_m
    roll, pitch, yaw = (math.degrees(angle) for angle in _angles_rad(*moment.quaternion_xyzw))
    return f"x {x_m:.2f} m, y {y_m:.2f} m, heading {round(yaw)}°; roll {round(roll)}°, pitch {round(pitch)}°"


def _angles_rad(x: float, y: float, z: float, w: float) -> tuple[float, float, float]:
    """Roll, pitch, yaw of a unit quaternion, intrinsic z-y-x."""
    return (
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x)))),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def event_line(told: StoryEvent) -> str:
    """One row of the list of events."""
    mark = MARKS.get(told.severity, "")
    return f"- {mark}{told.time_s:.1f} s **{plain(told.name)}** {plain(told.text)}"


def plain(text: str) -> str:
    """Text of a run as literal Markdown: control characters visible, neither HTML, link nor emphasis in it."""
    return _MARKUP.sub(lambda found: f"&#{ord(found[0])};", visible(text))
