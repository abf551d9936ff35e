"""Components of the page that are drawn in the browser: each is one file of `static` and reads the newest tree."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nicegui
from nicegui.element import Element

from ground.page.map import layers
from ground.page.view.model import layout
from ground.page.web.site import STATIC
from onboard.config import load

_SIZES = ("half_wheelbase_m", "half_track_m", "wheel_radius_m", "wheel_width_m", "belly_m")
_THREE = Path(nicegui.__file__).parent / "elements/scene/dist"  # three.js as the page's library ships it


def _component(name: str) -> Path:
    return STATIC / f"{name}.js"


class Feed(Element, component=_component("feed")):
    """Receiver of the server's trees in the browser; all other parts read it."""

    def __init__(self, first: dict[str, Any]) -> None:
        super().__init__()
        self._props["first"] = first


class Headline(Element, component=_component("headline")):
    """Mode, phase and activity of the rover in one line."""


class Values(Element, component=_component("values")):
    """All telemetry in groups."""

    def __init__(self) -> None:
        super().__init__()
        self._props["groups"] = layout()


class Link(Element, component=_component("link")):
    """State of the link."""


class Wheels(Element, component=_component("wheels")):
    """Steering and rates of the wheels, reported and ordered."""


class Commands(Element, component=_component("commands")):
    """Commands with their chains."""


class MapView(Element, component=_component("map")):
    """The map."""

    def __init__(self, operator: bool) -> None:
        super().__init__()
        self._props["operator"] = operator
        self._props["layer"] = layers.LAYERS[0]


class View3d(Element, component=_component("view_3d"), esm={"nicegui-scene": str(_THREE)}):
    """Cloud of the last scan, terrain and rover, in 3D."""

    def __init__(self) -> None:
        super().__init__()
        rover = load().rover
        self._props["rover"] = {name: getattr(rover, name) for name in _SIZES}
