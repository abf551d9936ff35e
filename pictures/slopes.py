"""Slip over slope, one line for each soil."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from pictures.style import BLUE, GREEN, GREY, ORANGE, PAGE_IN, drawn, figure, quiet

_COLOURS = (BLUE, GREEN, ORANGE)
_HIGHEST = 130.0  # %


@drawn
def slip(slopes_deg: Sequence[float], ratios: Mapping[str, Sequence[float]]) -> Figure:
    """Slip: `ratios` of the distance lost, by soil; values over 130 % are not drawn."""
    made = figure(PAGE_IN, 4.0)
    axes = made.subplots()
    axes.axhline(100, color=GREY, linewidth=0.8)
    axes.annotate("100 %: the wheels turn, the rover stands", (0.3, 102), color=GREY, fontsize=9)
    for (soil, ratio), colour in zip(ratios.items(), _COLOURS):
        axes.plot(slopes_deg, [100 * each for each in ratio], color=colour, marker="o", markersize=4, label=soil)
    axes.set(xlabel="slope, °", ylabel="slip, %", ylim=(0, _HIGHEST), xlim=(0, max(slopes_deg)))
    axes.set_title("Share of the wheels' way that is lost driving straight up")
    axes.legend(title="soil", loc="center left", bbox_to_anchor=(0.02, 0.6))
    quiet(axes)
    return made
