"""Generator of the pictures of as-printed.md, lidar-tool.md and motion.md, from the flight code: `make docs`."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from docs.as_printed import motion, next_position, terrain  # noqa: E402
from docs.as_printed import visibility as seen_as_printed  # noqa: E402
from onboard.config import Rover  # noqa: E402
from onboard.motion.kinematics import wheel_angles, wheel_places  # noqa: E402
from onboard.planning.sensing import visibility as seen  # noqa: E402
from onboard.planning.sensing.gain import Eyes  # noqa: E402
from onboard.planning.sensing.next_position import Criterion, Question, choose, straight_line_m  # noqa: E402
from onboard.records import F64, Grid, Twist  # noqa: E402
from pictures import printed  # noqa: E402
from pictures.scan3d import scan_figure  # noqa: E402
from pictures.style import png  # noqa: E402
from pictures.terrain import Ground  # noqa: E402
from tests.onboard import nodding  # noqa: E402
from tools.drawings.motion import DRIVEN  # noqa: E402

PICTURES = ROOT / "docs" / "pictures"
CELL_M, SIZE, STRIDE, HURST = 0.1, 80, 2, 0.8
RANGE_M, BEAMS, MAST_M = 4.0, 180, 0.7
SIGMA = 0.006
DOTS_PER_INCH = 100  # small files: pages show them no wider
NODES_SHAPE = (SIZE // STRIDE, SIZE // STRIDE)
NODES = Grid(CELL_M / 2, CELL_M / 2, CELL_M * STRIDE, *NODES_SHAPE)
GOAL_M = (7.3, 6.8)
MENDED = terrain.Mended(signed=True, per_area=True)


def ground() -> Ground:
    """8 m x 8 m of fractal ground with 12 half-buried balls."""
    rng = np.random.default_rng(6)
    z = terrain.eq_17(terrain.eq_20(SIZE, CELL_M, HURST, SIGMA, MENDED), CELL_M, rng).real
    y, x = (np.mgrid[0:SIZE, 0:SIZE] + 0.5) * CELL_M
    rocks = np.column_stack([rng.uniform(0.4, SIZE * CELL_M - 0.4, (12, 2)), rng.uniform(0.4, 1.2, 12)])
    for a, b, diameter in rocks:
        z = z + np.sqrt(np.maximum(diameter**2 / 4 - (x - a) ** 2 - (y - b) ** 2, 0))
    return Ground(Grid(CELL_M / 2, CELL_M / 2, CELL_M, SIZE, SIZE), z.astype(np.float32), rocks)


def vis_as_printed(on: Ground, mended: seen_as_printed.Mended) -> F64:
    """Vis of every second node by Algorithm 1 as printed, with or without its errors corrected."""
    fan = seen_as_printed.Fan(RANGE_M, CELL_M, BEAMS)
    places = np.arange(0, SIZE, STRIDE)
    return np.array(
        [[seen_as_printed.algorithm_1(on.heights_m, (j, i), fan, mended).vis for i in places] for j in places]
    )


def vis_as_flown(on: Ground) -> F64:
    """Vis of every node by the flight code."""
    return seen.total(seen.scene(on.heights_m), seen.beams(RANGE_M, CELL_M, BEAMS), MAST_M).index


def visibility() -> Figure:
    """Vis over a rocky field: as printed, with the ray moving on, and as flown."""
    on, advancing = ground(), seen_as_printed.Mended(ray_advances=True)
    maps = (
        ("as printed", vis_as_printed(on, seen_as_printed.AS_PRINTED)),
        ("as printed, but the ray moves on", vis_as_printed(on, advancing)),
        ("as it flies", vis_as_flown(on)[::STRIDE, ::STRIDE]),
    )
    return printed.visibility(on, NODES, maps)


def search() -> Figure:
    """E over the same field and the choice from it: Eq. 28 and Algorithm 2 as printed, and as flown."""
    on = ground()
    vis = vis_as_flown(on)  # the same on both sides: only the search differs here
    length = straight_line_m(on.grid, on.heights_m, GOAL_M)
    as_printed = next_position.eq_28(vis, length.astype(np.float64), 0 * vis, (1.0, 0.1))
    starts = np.array([[24, 28], [54, 68], [66, 16], [16, 60]])
    climbs = [next_position.algorithm_2(as_printed, vis > 0, start[None], step_limit=100).climbs[0] for start in starts]
    y, x = on.grid.y0_m + CELL_M * np.mgrid[0:SIZE, 0:SIZE]
    away = np.hypot(x[..., None] - on.rocks[:, 0], y[..., None] - on.rocks[:, 1]) - on.rocks[:, 2] / 2
    question = Question(on.grid, on.heights_m, away.min(axis=-1) > 0.3, length, GOAL_M)
    answer = choose(question, Eyes(MAST_M, RANGE_M, math.pi, BEAMS), Criterion())
    assert answer.best is not None
    answers = (
        printed.Scores("as printed: away from the goal,\nand four climbs, cut after 100 steps", as_printed, climbs),
        printed.Scores(
            "as it flies: every free node scored,\nthe best one taken", answer.score_map, best=answer.best.cell
        ),
    )
    return printed.search(on, on.grid, GOAL_M, answers)


def steering() -> Figure:
    """A turn to the left at 0.11 m/s and 0.1 rad/s, and the rim speed of a wheel for rates up to 0.4 rad/s."""
    vehicle, rover = motion.Vehicle(), Rover(half_track_m=0.25)
    going = motion.BodyMotion(0.11, 0.0, 0.1)
    places = np.array(wheel_places(rover))
    angles = np.array([motion.eq_34(wheel, going, vehicle) for wheel in range(4)])
    right = np.array(wheel_angles(Twist(0.11, 0.0, 0.1), rover), dtype=float)
    rates = np.linspace(0.0, 0.4, 81)
    rims, needed = [], []
    for rate in rates:
        steer = wheel_angles(Twist(0.11, 0.0, float(rate)), rover)[0]
        rims.append(
            motion.eq_37(0, motion.BodyMotion(0.11, 0.0, float(rate)), float(steer or 0.0), vehicle) * vehicle.r_m
        )
        needed.append(math.hypot(0.11 - rate * vehicle.d_m, rate * vehicle.l_m))
    turns = (
        printed.WheelSteering("Eq. 34 as printed", places, angles, 0.11, 0.1),
        printed.WheelSteering("as it flies", places, right, 0.11, 0.1),
    )
    lines = (("Eq. 37 as printed", np.array(rims)), ("its hub's speed", np.array(needed)))
    return printed.steering(turns, rates, lines)


def fractal() -> Figure:
    """Sigma measured in maps of 32 to 512 cells of 0.1 m, and ground of signed and unsigned frequencies."""
    sizes = (32, 64, 128, 256, 512)
    as_printed, mended = terrain.Mended(signed=True), MENDED
    shares = [
        (name, np.array([_sigma(size, how) for size in sizes]))
        for name, how in (("Eq. 20 as printed", as_printed), ("as it flies", mended))
    ]
    grounds = [
        Ground(Grid(0.05, 0.05, 0.1, 96, 96), _heights(96, how).astype(np.float32), name=name)
        for name, how in (("frequencies 0 to N - 1", terrain.Mended(per_area=True)), ("signed", mended))
    ]
    return printed.fractal(sizes, shares, grounds)


def _heights(size: int, mended: terrain.Mended) -> F64:
    amplitude = terrain.eq_20(size, CELL_M, HURST, SIGMA, mended)
    return terrain.eq_17(amplitude, CELL_M, np.random.default_rng(4)).real


def _sigma(size: int, mended: terrain.Mended) -> float:
    """Ratio of sigma measured in a map without its longest three waves."""
    u = np.fft.fftfreq(size, CELL_M)
    radius = np.hypot(u[:, None], u[None, :])
    band = (radius * size * CELL_M >= 4) & (radius * 2 * CELL_M < 1)
    density = terrain.eq_15(_heights(size, mended), CELL_M, MENDED)
    return math.sqrt((density[band] * radius[band] ** (2 * HURST + 2)).mean()) / SIGMA


def scan3d() -> Figure:
    """The room of the geometry tests, scanned by the emulated sensor and axis."""
    bench = nodding.Nodding(nodding.HARD)
    bench.settle(3)
    scan = bench.sweep(-25, 60, 30)
    return scan_figure(scan, nodding.ROVER, "A room of planes and boxes, swept at 30 degrees/s")


MADE: dict[str, Callable[[], Figure]] = {
    "as-printed-visibility.png": visibility,
    "as-printed-search.png": search,
    "as-printed-steering.png": steering,
    "as-printed-terrain.png": fractal,
}
SCANNED: dict[str, Callable[[], Figure]] = {"scan3d.png": scan3d}


def main() -> None:
    """Write every picture."""
    for name, made in (MADE | SCANNED | DRIVEN).items():
        (PICTURES / name).write_bytes(png(made(), DOTS_PER_INCH))


if __name__ == "__main__":
    main()
