"""Common style of all pictures: colours distinguishable by colour-blind people (Okabe and Ito), type legible on a page.

Figures are drawn without pyplot and without a window; `png` encodes a figure, with the same bytes for the same figure.
"""

from __future__ import annotations

import functools
import io
from collections.abc import Callable, Iterator
from typing import Any, ParamSpec, TypeVar

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

P = ParamSpec("P")
T = TypeVar("T")

BLACK, BLUE, SKY, GREEN, ORANGE, RED, PURPLE, YELLOW = (
    "#000000",
    "#0072B2",
    "#56B4E9",
    "#009E73",
    "#E69F00",
    "#D55E00",
    "#CC79A7",
    "#F0E442",
)
GREY, PALE = "#6b6b6b", "#e4e4e4"
DOTS_PER_INCH = 150
PAGE_IN = 9.0  # width of a picture on the page

PHASE_COLOURS = {
    "SCANNING": SKY,
    "MAPPING": PALE,
    "PLANNING": PALE,
    "DRIVING": GREEN,
    "TURNING": ORANGE,
    "BACKING_OFF": RED,
}

_STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.titleweight": "bold",
    "axes.labelsize": 10.0,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "legend.fontsize": 9.0,
    "legend.frameon": True,
    "legend.framealpha": 0.92,
    "legend.edgecolor": "#bbbbbb",
    "legend.fancybox": False,
    "axes.edgecolor": "#555555",
    "axes.linewidth": 0.8,
    "axes.axisbelow": True,
    "axes.grid": False,
    "grid.color": "#cccccc",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.6,
    "lines.solid_capstyle": "round",
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "path.simplify": True,
}


def drawn(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Decorator of a drawing function: its figure has this style, and nothing outside it changes."""

    @functools.wraps(draw)
    def styled(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with rc_context(_STYLE):
            return draw(*args, **kwargs)

    return styled


def drawn_frames(draw: Callable[P, Iterator[T]]) -> Callable[P, Iterator[T]]:
    """Decorator of a generator of pictures: each picture has this style, and nothing between them changes."""

    @functools.wraps(draw)
    def styled(*args: P.args, **kwargs: P.kwargs) -> Iterator[T]:
        frames = draw(*args, **kwargs)
        while True:
            with rc_context(_STYLE):
                try:
                    frame = next(frames)
                except StopIteration:
                    return
            yield frame

    return styled


def figure(width_in: float, height_in: float) -> Figure:
    """An empty figure with its own canvas and automatic layout."""
    made = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(made)
    return made


def png(made: Figure, dots_per_inch: int = DOTS_PER_INCH) -> bytes:
    """The picture as the bytes of a PNG file."""
    buffer = io.BytesIO()
    with rc_context(_STYLE):
        made.savefig(buffer, format="png", dpi=dots_per_inch, metadata={"Software": None})
    return buffer.getvalue()


def quiet(axes: Axes) -> None:
    """Axes of a time series: a light grid, no box."""
    axes.grid(True)
    axes.spines[["top", "right"]].set_visible(False)


def literal(words: str) -> str:
    """Escape a text from outside: matplotlib would parse text between two `$` as mathematics, and raise on errors."""
    return words.replace("$", r"\$")
