"""The table of doors to the kernels for tests/fuzz/kernels.py, each with a generator of good, odd and wrong arguments.

A new door is one row of ROWS: the modules whose `kernels` it uses, its arguments by name, and a call with them. One
table, so one file, though of over 300 lines.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st
from numpy.typing import DTypeLike

from hil.plant.soil import CLASSES, SoilContacts
from onboard.kernel_calls import (
    cell_classes,
    cells,
    distance,
    global_field,
    pose_field,
    poses,
    range_filter,
    raster,
    scip,
    sight,
    visibility,
)
from onboard.native import each, elementary, linear
from onboard.perception.map import ldem as maps
from onboard.perception.map.cell_classes import SPREAD
from onboard.planning.sensing.visibility import beams
from onboard.records import Cloud, Grid, Surface

# -- numbers and arrays, the plain ones first: hypothesis shrinks towards them -----------------------------------


def mostly(usual: st.SearchStrategy[Any], odd: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Return a strategy of which one in sixteen is odd: many calls of some ten arguments then pass the door."""
    return st.sampled_from([usual] * 15 + [odd]).flatmap(lambda one: one)


SIZES = st.one_of(st.integers(0, 3), st.integers(0, 40))
SIDES = mostly(st.one_of(st.integers(1, 3), st.integers(1, 40)), st.just(0))
USUAL = st.floats(-2, 2, width=32)
NUMBERS = mostly(USUAL, st.floats(width=32))
PRICES = mostly(st.floats(0.125, 8, width=32), st.floats(width=32))
BYTES = st.integers(0, 255)


def _odd_address(array: np.ndarray) -> np.ndarray:
    memory = np.zeros(array.nbytes + 1, np.uint8)
    odd = memory[1:].view(array.dtype).reshape(array.shape)
    odd[...] = array
    return odd


def _read_only(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


ODD: tuple[Callable[[np.ndarray], Any], ...] = (
    np.asfortranarray,
    lambda a: np.repeat(a, 2, axis=-1)[..., ::2],
    lambda a: a[::-1],
    _odd_address,
    _read_only,
    lambda a: a.astype(a.dtype.newbyteorder(">")),
    lambda a: a.astype(np.float64 if a.dtype == np.float32 else np.float32),
    lambda a: a[None],
    lambda a: a[:-1],
    lambda a: a.tolist(),
    lambda a: None,
)
LAYOUTS = mostly(st.just(np.ascontiguousarray), st.sampled_from(ODD))


@st.composite
def arrays(draw: st.DrawFn, shape: tuple[int, ...], dtype: DTypeLike, values: st.SearchStrategy[Any] = NUMBERS) -> Any:
    """Return an array of up to five values at random places of `shape`; some have an unexpected layout or type."""
    palette = np.array(draw(st.lists(values, min_size=1, max_size=5)))
    strewn = np.random.default_rng(draw(st.integers(0, 99))).choice(palette, shape)
    made = strewn.astype(np.uint8).view(np.bool_) if dtype is np.bool_ else strewn.astype(dtype)
    return draw(LAYOUTS)(made.reshape(shape))


GRIDS = st.builds(
    Grid,
    x0_m=mostly(USUAL, st.floats()),
    y0_m=mostly(USUAL, st.floats()),
    cell_m=mostly(st.just(0.1), st.floats()),
    rows=SIDES,
    columns=SIDES,
)


def together(**each: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    """Arguments by name."""
    return st.fixed_dictionaries(each)


# -- the doors ---------------------------------------------------------------------------------------------------


class Row(NamedTuple):
    """One door. call(**arguments): returns the arrays that every build must give alike, or raises ValueError."""

    doors: tuple[ModuleType, ...]
    arguments: st.SearchStrategy[dict[str, Any]]
    call: Callable[..., tuple[np.ndarray, ...]]


def _elementary(x: Any, y: float) -> tuple[np.ndarray, ...]:
    """Of one number and of each of an array."""
    one = elementary.kernels
    names = ("sin", "cos", "tan", "asin", "acos", "exp", "log")
    arrays = [each.Each(getattr(each.kernels, f"{name}_into"))(x) for name in names]
    return (
        *arrays,
        each.atan2(x, y),
        each.hypot(x, y),
        np.array([*(getattr(one, name)(y) for name in names), one.atan2(y, 2.0), one.hypot(y, 2.0)]),
    )


def _linear(a: Any, b: Any, square: Any) -> tuple[np.ndarray, ...]:
    return linear.product(a, b), linear.solve(square, b)


def _rasterise(grid: Grid, origin_m: Any, ends_m: Any, hit: Any, sigma_m: float) -> tuple[np.ndarray, ...]:
    return tuple(raster.rasterise(grid, Cloud(origin_m, ends_m, hit, sigma_m)))


def _points(grid: Grid, parts: list[Any]) -> tuple[np.ndarray, ...]:
    live = cells.LiveGrid(grid)
    for part in parts:
        live.add_points(part)
    return tuple(live.cells[name] for name in cells.CELL.names or ())


def _turn(grid: Grid, turn: tuple[Any, ...], mount: tuple[Any, ...]) -> tuple[np.ndarray, ...]:
    live = cells.LiveGrid(grid)
    live.add_turn(cells.BeamBlock(*turn), cells.Mount(*mount))
    return tuple(live.cells[name] for name in cells.CELL.names or ())


def _visibility(
    reach: tuple[float, int], ground: tuple[Any, Any], asked: tuple[Any, ...], node: tuple[int, int]
) -> tuple[np.ndarray, ...]:
    table, request = beams(reach[0], 0.1, reach[1]), visibility.Request(*asked)
    sums = [kernel(table, *ground, request) for kernel in (visibility.total, visibility.scalar)]
    layers = [[layer for layer in (s.seen, s.in_range, s.fresh, s.heading) if layer is not None] for s in sums]
    assert all(np.array_equal(a, b) for a, b in zip(*layers)), "total is not the scalar loop"
    seen, *both = visibility.view(table, ground, node, request.eye_m, (0, reach[1]))
    return *layers[0], seen, np.array(both)


def _distance(free: Any, goals: Any, cell_m: float, closeness: Any) -> tuple[np.ndarray, ...]:
    return (distance.cost_to_go(free, goals, cell_m, closeness),)


def _sight(free: Any, closeness: Any, grid: Grid, line: tuple[Any, Any, int], spacing_m: float) -> tuple[np.ndarray]:
    return (np.array([sight.price_m(free, closeness, grid, line, spacing_m)]),)


def _global(heights_m: Any, cell_m: float, raw: bool, prices: Any, seeds: Any) -> tuple[np.ndarray, ...]:
    shape = heights_m.shape if isinstance(heights_m, np.ndarray) and heights_m.ndim == 2 else (1, 1)
    work = global_field.workspace(*shape)
    layers = global_field.make_layers(heights_m, cell_m, raw, work)
    global_field.make_edges(heights_m, cell_m, prices, work)
    return *global_field.cost_to_go(seeds, work), layers


def _soil(rows: int, columns: int, heights_m: Any, states: list[Any], dt_s: float) -> tuple[np.ndarray, ...]:
    contacts = SoilContacts(Grid(-1.0, -1.0, 0.1, rows, columns), heights_m, 0.1, 0.1, tuple(CLASSES))
    wheels = tuple((s[:3], s[3:7], 0, 0, 0, 0, s[7:10], s[10:]) for s in states)
    return tuple(np.array([*c[0], *c[1], *c[2:]]) for c in contacts.step(wheels, dt_s))


def _classes(layers: dict[str, Any], rules: tuple[Any, ...]) -> tuple[np.ndarray, ...]:
    ldem = replace(maps.empty(Grid(0.0, 0.0, 0.1, 1, 1)), **layers)
    return tuple(cell_classes.classify(ldem, cell_classes.Rules(*rules), SPREAD))


def _freedom(cell_m: float, layers: dict[str, Any], footprint: tuple[Any, Any], limits: tuple[Any, ...]) -> tuple:
    surface = Surface(Grid(0.0, 0.0, cell_m, 1, 1), **layers)
    body = np.sort(footprint[1], axis=0) if isinstance(footprint[1], np.ndarray) else footprint[1]
    return (poses.pose_freedom(surface, poses.Footprint(footprint[0], body), poses.Limits(*limits)),)


def _scip(layout: tuple[int, int, int], frame: bytes) -> tuple[np.ndarray, ...]:
    blocks = scip.Blocks(*layout)
    return (blocks.values,) if blocks(frame) else ()


def _places(size: int) -> st.SearchStrategy[int]:
    return mostly(st.integers(0, max(0, size - 1)), st.integers(-1, size))


_beams = SIZES.flatmap(
    lambda n: together(
        grid=GRIDS,
        origin_m=arrays((3,), np.float64),
        ends_m=arrays((n, 3), np.float32),
        hit=arrays((n,), np.bool_, BYTES),
        sigma_m=st.floats(),
    )
)
_turns = st.tuples(SIZES, st.integers(0, 6)).flatmap(
    lambda n: together(
        grid=GRIDS,
        turn=st.tuples(
            arrays((n[0],), np.float32), arrays((2, n[0]), np.float64), arrays((2, n[0]), np.float64), st.floats()
        ),
        mount=st.tuples(
            arrays((3,), np.float64), arrays((n[1], 2, 3), np.float64), arrays((4, 4), np.float64)
        ),
    )
)  # fmt: skip
_poses = st.tuples(SIZES, SIZES, st.integers(0, 4)).flatmap(
    lambda n: together(
        freedom=arrays((8, n[0], n[1]), np.uint8, BYTES),
        least_freedom=st.integers(-1, 256),
        seeds=st.tuples(arrays((n[2],), np.int64, _places(8 * n[0] * n[1])), arrays((n[2],), np.float32, PRICES)),
        moves_m=arrays((8, 8), np.float32, PRICES),
        turn_m=PRICES,
        closeness=st.one_of(st.none(), arrays((8, n[0], n[1]), np.float32, PRICES)),
    )
)
_scenes = st.tuples(SIDES, SIDES, st.integers(1, 40)).flatmap(
    lambda n: together(
        reach=st.tuples(st.floats(0.1, 3), st.just(n[2])),
        ground=st.tuples(
            arrays((n[0], n[1]), np.float32),
            st.none() | arrays((n[0], n[1]), np.float32, st.sampled_from((0.0, -np.inf, np.inf))),
        ),
        asked=st.tuples(
            mostly(st.floats(0, 2), st.floats()),
            st.none() | arrays((n[0], n[1]), np.bool_, BYTES),
            st.none() | arrays((n[0], n[1]), np.int32, _places(n[2])),
            _places(n[2]).map(lambda width: width + 1),
            st.none() | arrays((n[0], n[1]), np.bool_, BYTES),
            _places(n[2]).map(lambda width: width + 1),
        ),
        node=st.tuples(_places(n[0]), _places(n[1])),
    )
)
_cells = st.tuples(SIZES, SIZES).flatmap(
    lambda n: together(
        free=arrays(n, np.bool_, BYTES),
        goals=arrays(n, np.bool_, BYTES),
        cell_m=mostly(st.just(0.1), st.floats()),
        closeness=st.none() | arrays(n, np.float32, PRICES),
    )
)
_ends = st.tuples(mostly(USUAL, st.floats()), mostly(USUAL, st.floats()))
_lines = st.tuples(st.integers(0, 8), SIDES, SIDES).flatmap(
    lambda n: together(
        free=arrays(n, np.bool_, BYTES),
        closeness=st.none() | arrays(n, np.float32),
        grid=GRIDS.map(lambda grid: replace(grid, rows=n[1], columns=n[2])),
        line=st.tuples(_ends, _ends, _places(n[0])),
        spacing_m=mostly(st.floats(0.02, 1), st.floats(1e-3)),
    )
)
_maps = st.tuples(SIDES, SIDES, st.integers(0, 4)).flatmap(
    lambda n: together(
        heights_m=arrays(n[:2], np.float32),
        cell_m=mostly(st.floats(0.1, 100), st.floats()),
        raw=st.booleans(),
        prices=mostly(st.tuples(*[st.floats(0.125, 8)] * 5), st.tuples(*[st.floats()] * 5)),
        seeds=st.tuples(arrays((n[2],), np.int64, _places(n[0] * n[1])), arrays((n[2],), np.float64, PRICES)),
    )
)
_statistics = st.tuples(SIZES, SIZES).flatmap(
    lambda n: together(
        layers=together(
            n=arrays(n, np.int32, mostly(st.integers(-1, 9), st.integers(-(2**31), 2**31 - 1))),
            sum_z=arrays(n, np.float64),
            **{name: arrays(n, np.float32) for name in ("z_hi", "z_lo", "sum_sigma", "z_ray", "assumed_z")},
        ),
        rules=st.tuples(mostly(st.integers(0, 5), st.integers(-1, 2**40)), *[PRICES] * 5),
    )
)
OFFSETS = mostly(st.integers(-6, 6), st.integers(-129, 129))
_surfaces = st.tuples(SIZES, SIZES, st.integers(0, 20)).flatmap(
    lambda n: together(
        cell_m=PRICES,
        layers=together(
            cell_class=arrays(n[:2], np.uint8, mostly(st.integers(0, 5), BYTES)),
            **{name: arrays(n[:2], np.float32) for name in ("z_mean", "z_top", "z_bot", "z_ray")},
        ),
        footprint=st.tuples(
            arrays((8, 4, 2), np.int32, OFFSETS), arrays((n[2], 6), np.int32, mostly(st.integers(0, 7), OFFSETS))
        ),
        limits=st.tuples(*[PRICES] * 4, mostly(st.integers(0, 6), st.integers(-1, 129)), st.integers(0, 30)),
    )
)
_fields = st.tuples(SIZES, SIZES).flatmap(
    lambda n: together(
        freedom=arrays((8, *n), np.uint8, st.integers(0, 2)),
        falloff=mostly(st.integers(3, 9), st.integers(0, 129)).flatmap(lambda k: arrays((k * k,), np.float32)),
        touching=NUMBERS,
    )
)
_floods = st.tuples(SIZES, SIZES).flatmap(
    lambda n: together(
        freedom=arrays((8, *n), np.uint8, st.integers(0, 2)),
        free=st.integers(-1, 256),
        pose=st.tuples(_places(n[0]), _places(n[1]), _places(8)),
    )
)
_blocks = together(
    layout=st.tuples(st.integers(-1, 40), st.integers(0, 200), st.integers(0, 11)),
    frame=st.binary(max_size=700),
)
_wheels = st.tuples(SIDES, SIDES).flatmap(
    lambda n: together(
        rows=st.just(n[0]),
        columns=st.just(n[1]),
        heights_m=arrays(n, np.float32),
        states=st.lists(st.lists(USUAL, min_size=13, max_size=13), min_size=len(CLASSES) - 1, max_size=len(CLASSES)),
        dt_s=st.sampled_from((0.002, 0.01)),
    )
)

_vectors = together(x=SIZES.flatmap(lambda n: arrays((n,), np.float64)), y=mostly(st.floats(), st.just(0.0)))
_matrices = st.tuples(SIDES, SIDES, SIDES).flatmap(
    lambda n: together(
        a=arrays(n[:2], np.float64), b=arrays(n[1:], np.float64), square=arrays((n[1], n[1]), np.float64)
    )
)

_images = st.tuples(SIDES, SIDES).flatmap(
    lambda n: together(
        ranges_m=arrays(n, np.float32), seen=arrays(n, np.bool_), tolerance_m=st.sampled_from((0.0, 0.085, math.nan))
    )
)

ROWS: dict[str, Row] = {
    "elementary": Row((elementary, each), _vectors, _elementary),
    "linear": Row((linear,), _matrices, _linear),
    "rasterise": Row((raster,), _beams, _rasterise),
    "live-points": Row(
        (cells,),
        together(
            grid=GRIDS, parts=st.lists(SIZES.flatmap(lambda n: arrays((n, 3), np.float32)), min_size=1, max_size=3)
        ),
        _points,
    ),
    "live-turn": Row((cells,), _turns, _turn),
    "pose-field": Row((pose_field,), _poses, lambda **given: (pose_field.cost_to_go(**given),)),
    "visibility": Row((visibility,), _scenes, _visibility),
    "distance": Row((distance,), _cells, _distance),
    "sight": Row((sight,), _lines, _sight),
    "global-field": Row((global_field,), _maps, _global),
    "cell-classes": Row((cell_classes,), _statistics, _classes),
    "range-filter": Row((range_filter,), _images, lambda **given: (range_filter.keep_witnessed(**given),)),
    "pose-freedom": Row((poses,), _surfaces, _freedom),
    "closeness": Row((poses,), _fields, lambda **given: (poses.closeness(**given),)),
    "reachable": Row((poses,), _floods, lambda **given: (poses.reachable(**given),)),
    "scip-blocks": Row((scip,), _blocks, _scip),
    "soil": Row((), _wheels, _soil),
}
