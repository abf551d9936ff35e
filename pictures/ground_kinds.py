"""Properties of generated ground: fractal soil by roughness, a crater from the side and many from above, rock sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from onboard.records import F64
from pictures.style import BLACK, BLUE, GREY, ORANGE, PAGE_IN, RED, drawn, figure, literal, quiet
from pictures.terrain import Ground, draw_ground

_COLOURS = (BLUE, RED, BLACK, ORANGE)


@dataclass(frozen=True, slots=True)
class Profile:
    """Section through the middle of a crater. x_m, z_m: (n,), z relative to the ground around."""

    name: str
    x_m: F64
    z_m: F64


@dataclass(frozen=True, slots=True)
class Sizes:
    """Sizes of sampled rocks, and the size law.

    drawn_m: diameters of the sampled rocks.
    area_m2: area of the ground.
    law_m: diameters D of the law.
    law_share: share of the area covered by rocks >= D.
    law_number_per_m2: number of rocks >= D per square metre.
    """

    name: str
    drawn_m: F64
    area_m2: float
    law_m: F64
    law_share: F64
    law_number_per_m2: F64


@drawn
def fractals(grounds: Sequence[Ground]) -> Figure:
    """Grounds side by side under the same light, each with its relief."""
    made = figure(PAGE_IN, 3.6)
    for axes, ground in zip(made.subplots(1, len(grounds), sharey=True), grounds):
        draw_ground(axes, ground)
        axes.set_title(f"{literal(ground.name)}\nrelief {np.ptp(ground.heights_m):.2f} m")
        axes.label_outer()
    return made


@drawn
def craters(profiles: Sequence[Profile], ground: Ground) -> Figure:
    """Profiles above each other, heights magnified over lengths, and a field from above."""
    made = figure(PAGE_IN, 4.5)
    side, above = made.subplots(1, 2)
    side.axhline(0, color=GREY, linewidth=0.8)
    for profile, colour in zip(profiles, _COLOURS):
        side.plot(profile.x_m, profile.z_m, color=colour, label=profile.name)
    side.set(xlabel="from the middle, m", ylabel="over the ground around, m")
    side.set_title("a crater from the side, heights enlarged")
    quiet(side)
    draw_ground(above, ground)
    above.set_title(literal(ground.name))
    made.legend(*side.get_legend_handles_labels(), loc="outside upper center", ncols=len(profiles))
    return made


@drawn
def rock_sizes(laws: Sequence[Sizes]) -> Figure:
    """Share of the area and number of rocks of a diameter or larger: the law as a line, the samples as dots."""
    made = figure(PAGE_IN, 4.2)
    share, number = made.subplots(1, 2)
    for sizes, colour in zip(laws, _COLOURS):
        largest_first = np.sort(sizes.drawn_m)[::-1]
        area = np.cumsum(math.pi / 4 * largest_first**2) / sizes.area_m2
        count = np.arange(1, len(largest_first) + 1) / sizes.area_m2
        for axes, law, found in ((share, sizes.law_share, area), (number, sizes.law_number_per_m2, count)):
            axes.plot(sizes.law_m, law, color=colour, linewidth=1.2, label=f"{sizes.name}, law")
            axes.plot(largest_first, found, ".", color=colour, markersize=3.5, label=f"{len(count)} rocks drawn")
    _logarithmic(share, "share of the area under rocks of D or larger")
    _logarithmic(number, "rocks of D or larger per square metre")
    made.legend(*share.get_legend_handles_labels(), loc="outside upper center", ncols=len(laws), markerscale=3)
    return made


def _logarithmic(axes: Axes, label: str) -> None:
    """Set logarithmic axes; three decades below the highest point are enough to show the law."""
    highest = max(float(line.get_ydata().max()) for line in axes.lines)
    axes.set(ylim=(highest / 1000, 2 * highest), xscale="log", yscale="log", xlabel="diameter D, m", ylabel=label)
    axes.set_xticks([0.15, 0.3, 0.6, 1.2])
    axes.set_xticks([], minor=True)
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    quiet(axes)
