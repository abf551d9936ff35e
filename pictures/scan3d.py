"""A 3D scan: its range image, its points from above, and the floor's error with one tilt for a whole turn."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from onboard.config import Rover
from onboard.perception.scan.scan3d import Points, Scan3d, points
from pictures.style import BLACK, PAGE_IN, RED, drawn, figure

_COLOURS = "viridis"
_FLOOR_M = 0.02


def held(scan: Scan3d) -> Scan3d:
    """The same scan with one tilt for all beams of a turn: the tilt at its start."""
    pixels = scan.pixels.copy()
    pixels["tilt_rad"] = pixels["tilt_rad"][:, :1]
    return Scan3d(pixels, scan.first_angle_rad, scan.step_rad)


@drawn
def scan_figure(scan: Scan3d, rover: Rover, title: str = "") -> Figure:
    """Range image; the points from above, coloured by height; heights of the floor's points, interpolated or not.

    Beams without a point stay white in the image.
    """
    made, wrong = points(scan, rover), points(held(scan), rover)
    page = figure(PAGE_IN, 7.4)
    upper, lower = page.subfigures(2, 1, height_ratios=[0.8, 1.0])
    _image(upper.subplots(), scan)
    above, cut = lower.subplots(1, 2, gridspec_kw={"wspace": 0.08})
    _above(above, made)
    _floor(cut, scan, made, wrong)
    page.suptitle(title, fontsize=12, fontweight="bold")
    return page


def _image(axes: Axes, scan: Scan3d) -> None:
    range_m = np.where(scan.valid, scan.pixels["range_m"], np.nan)
    azimuths = np.degrees(scan.azimuths_rad)
    seconds = (scan.pixels["time_ns"][:, 0] - scan.pixels["time_ns"][0, 0]) * 1e-9
    drawn_image = axes.imshow(
        range_m[:, ::-1],
        aspect="auto",
        cmap=_COLOURS,
        interpolation="nearest",
        extent=(azimuths[-1], azimuths[0], seconds[-1], seconds[0]),
    )
    axes.set(title="range image: one line a turn", xlabel="azimuth, degrees (left is left)", ylabel="time, s")
    axes.figure.colorbar(drawn_image, ax=axes, label="range, m", pad=0.01)


def _above(axes: Axes, made: Points) -> None:
    x, y, z = made.xyz_m.T
    order = np.argsort(z)
    cloud = axes.scatter(
        y[order], x[order], c=z[order], s=0.12, cmap=_COLOURS, norm=Normalize(0.0, 2.0), linewidths=0, rasterized=True
    )
    axes.plot(0, 0, "+", color=RED, markersize=10, markeredgewidth=2)
    axes.invert_xaxis()
    axes.set(title="points from above", xlabel="y, m", ylabel="x, m", aspect="equal")
    axes.figure.colorbar(cloud, ax=axes, label="height, m", pad=0.01)


def _floor(axes: Axes, scan: Scan3d, made: Points, wrong: Points) -> None:
    floor = np.abs(made.xyz_m[:, 2]) < _FLOOR_M
    azimuth = np.degrees(scan.azimuths_rad[made.beam[floor]])
    for each, colour, name in (
        (wrong, RED, "one tilt for a whole turn"),
        (made, BLACK, "the tilt at each beam's own time"),
    ):
        height_mm = 1e3 * each.xyz_m[floor, 2]
        axes.scatter(azimuth, height_mm, s=0.6, color=colour, linewidths=0, label=name, rasterized=True)
    axes.invert_xaxis()
    axes.set(title="heights of the floor's points", xlabel="azimuth, degrees", ylabel="height, mm")
    axes.legend(loc="upper left", markerscale=10)
