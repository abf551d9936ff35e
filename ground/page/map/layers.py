"""Pictures of the maps: the rover's map (LDEM) in several layers, and the orbiter's map (GDEM) under it. Pure.

A picture is a PNG with one pixel for each cell, north up, unknown cells transparent. The browser scales and places it.
"""

from __future__ import annotations

import io
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from onboard.records import Gdem, Grid, NodeSet
from pictures.ldem import SET_COLOURS, SET_NAMES, set_picture
from pictures.terrain import extent, hillshade
from pictures.way import Sets
from protocol.products.height_std import HeightStd
from protocol.products.ldem import LdemProduct, MapGrid
from protocol.products.pose_map import ORIENTATIONS, PoseMap

LAYERS = ("height", "node sets", "pose freedom", "deviation", "age")
LEAST_STD_M, MOST_STD_M = 0.002, 0.2  # ends of the colours of the layer of deviations, by the logarithm
_SAME_M = 0.002  # heights nearer than this are the same measurement, sent again
_RAMP = np.array([[0, 32, 77], [60, 77, 110], [124, 123, 120], [188, 175, 111], [255, 234, 70]], float)  # cividis
F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]


class Seen(NamedTuple):
    """The rover's newest map, with the UTC at which each cell's height was first received.

    utc_s: (rows, columns) float64, NaN where the height is unknown.
    at_utc_ns: UTC of the map's arrival.
    std: the newest product of height deviations; None: it was not fetched.
    """

    product: LdemProduct
    poses: PoseMap | None
    utc_s: F64
    at_utc_ns: int
    std: HeightStd | None = None

    @property
    def grid(self) -> Grid:
        """The map's grid."""
        return Grid(*self.product.grid)


def seen(product: LdemProduct, poses: PoseMap | None, at_utc_ns: int, before: Seen | None = None) -> Seen:
    """Return the map with the age of its cells: a cell whose height is that of the map before keeps its time."""
    heights = product.heights_m
    utc_s = np.where(np.isfinite(heights), at_utc_ns / 1e9, np.nan)
    grid = product.grid
    if before is None:
        return Seen(product, poses, utc_s, at_utc_ns)
    both = _common(grid, before.product.grid)
    if both is not None:
        here, there = both
        same = np.abs(heights[here] - before.product.heights_m[there]) < _SAME_M
        utc_s[here] = np.where(same, before.utc_s[there], utc_s[here])
    return Seen(product, poses, utc_s, at_utc_ns)


def std_on_map(found: Seen) -> F32:
    """Return the height deviations in the cells of the map, m; NaN: unknown, not fetched, or of another raster."""
    std_m = np.full(found.product.heights_m.shape, np.nan, np.float32)
    both = None if found.std is None else _common(found.product.grid, found.std.grid)
    if both is not None and found.std is not None:
        here, there = both
        std_m[here] = found.std.std_m[there]
    return std_m


def _common(new: MapGrid, old: MapGrid) -> tuple[Any, Any] | None:
    """Return the slices of the cells that both grids have; None: the cells do not lie on each other."""
    if new.cell_m != old.cell_m:
        return None
    shift = [(old.y0_m - new.y0_m) / new.cell_m, (old.x0_m - new.x0_m) / new.cell_m]
    rows, columns = (round(one) for one in shift)
    if max(abs(shift[0] - rows), abs(shift[1] - columns)) > 1e-3:
        return None
    return _overlap((new.rows, new.columns), (old.rows, old.columns), rows, columns)


def _overlap(new: tuple[int, ...], old: tuple[int, ...], rows: int, columns: int) -> tuple[Any, Any]:
    """Return the slices of the cells that both maps have; cell (0, 0) of the old is (rows, columns) of the new."""
    here, there = [], []
    for size, other, shift in zip(new, old, (rows, columns)):
        begin, end = max(0, shift), max(max(0, shift), min(size, other + shift))
        here.append(slice(begin, end))
        there.append(slice(begin - shift, end - shift))
    return tuple(here), tuple(there)


def ldem_picture(found: Seen, layer: str, now_utc_s: float) -> bytes:
    """Return one layer of the rover's map as PNG. Raises ValueError for an unknown layer."""
    heights, known = found.product.heights_m, np.isfinite(found.product.heights_m)
    if layer == "height":
        return _png(_relief(heights, found.grid.cell_m), known)
    if layer == "node sets":
        sets = found.product.node_sets
        return _png(set_picture(Sets(found.grid, heights, sets)), known | (sets != NodeSet.OUTSIDE))  # type: ignore[arg-type]
    if layer == "pose freedom":
        if found.poses is None:
            return _png(np.zeros((*heights.shape, 3)), np.zeros(heights.shape, bool))
        free = (found.poses.freedom == 2).sum(axis=0)
        blocked = (found.poses.freedom == 0).any(axis=0)
        return _png(_ramp(free / ORIENTATIONS), (free > 0) | blocked)
    if layer == "deviation":
        std_m = std_on_map(found)
        level = np.log(np.maximum(np.nan_to_num(std_m), LEAST_STD_M) / LEAST_STD_M) / np.log(MOST_STD_M / LEAST_STD_M)
        return _png(_ramp(level), np.isfinite(std_m))
    if layer == "age":
        age_s = np.where(known, np.maximum(0.0, now_utc_s - found.utc_s), 0.0)
        return _png(_ramp(1.0 - np.clip(np.log10(1.0 + age_s) / 4.0, 0, 1)), known)
    raise ValueError(f"no layer `{layer}`; known: {', '.join(LAYERS)}")


def gdem_picture(gdem: Gdem) -> bytes:
    """Return the orbiter's map as PNG: grey relief, so that it differs from the rover's own map."""
    shade = 0.35 + 0.5 * hillshade(gdem.heights_m, gdem.grid.cell_m)
    return _png(np.repeat(shade[..., None], 3, axis=2) * [0.92, 0.94, 1.0], np.isfinite(gdem.heights_m))


def bounds(grid: Grid) -> list[float]:
    """Return left, right, bottom, top edge in the map frame, m."""
    return [float(edge) for edge in extent(grid)]


def legend(layer: str) -> list[tuple[str, str]]:
    """Return colour and meaning of each colour of a layer."""
    if layer == "node sets":
        return [(colour, SET_NAMES[one]) for one, colour in SET_COLOURS.items()]
    ends = {
        "height": ("low", "high"),
        "pose freedom": ("no heading free", "all 8 headings free"),
        "deviation": ("2 mm and less, 1σ of the heights in a cell", "20 cm and more"),
        "age": ("3 h and older", "just received"),
    }[layer]
    middle = {"height": "", "pose freedom": "4 of 8", "deviation": "2 cm", "age": "100 s"}[layer]
    picks = [(0, ends[0]), (2, middle), (4, ends[1])]
    return [(_hex(_RAMP[at]), text) for at, text in picks if text]


def _relief(heights: F32, cell_m: float) -> F64:
    known = np.isfinite(heights)
    if not known.any():
        return np.zeros((*heights.shape, 3))
    low, high = np.percentile(heights[known], (2, 98))
    level = np.where(known, (heights - low) / max(float(high - low), 0.05), 0.0)
    shade = 0.45 + 0.75 * hillshade(heights, cell_m)
    return _ramp(np.clip(level, 0, 1)) * np.where(known, shade, 1.0)[..., None]


def _ramp(level: NDArray[Any]) -> F64:
    """Return (..., 3) colours of levels 0..1, from dark blue to yellow: told apart also by the colour-blind."""
    at = np.clip(np.asarray(level, float), 0, 1) * (len(_RAMP) - 1)
    return np.stack([np.interp(at, np.arange(len(_RAMP)), _RAMP[:, k]) for k in range(3)], axis=-1) / 255.0


def _hex(colour: NDArray[Any]) -> str:
    return "#" + "".join(f"{int(part):02x}" for part in colour)


def _png(colours: NDArray[Any], visible: NDArray[Any]) -> bytes:
    """Encode (rows, columns, 3) colours 0..1; row 0 is the southern edge."""
    made = np.zeros((*visible.shape, 4), np.uint8)
    made[..., :3] = np.clip(np.nan_to_num(colours) * 255.0, 0, 255)
    made[..., 3] = np.where(visible, 255, 0)
    buffer = io.BytesIO()
    Image.fromarray(made[::-1]).save(buffer, format="PNG", compress_level=4)
    return buffer.getvalue()
