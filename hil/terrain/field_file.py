"""True ground of a run as the bytes of an .npz, for reports and for repeated runs; onboard never reads it.

truth_heights_m  (rows, columns) float32, top of soil and rocks    x0_m y0_m cell_m   centre of cell (0, 0), size
start            (3,) x, y, yaw      goal (2,) x, y                rocks              (n, 3) x, y, diameter
"""

from __future__ import annotations

import io

import numpy as np

from hil.terrain.field import Field, field_stats, truth_height
from hil.terrain.mesh import block_mean
from onboard.maps.npz_arrays import NUMBER, ArraySpec, read_arrays
from onboard.records import F64, Gdem, Grid, Pose

GDEM_CELL_M = 2.0
_KEYS = {
    "truth_heights_m": ArraySpec("iuf", 2, 20_000, 1 << 28), "start": ArraySpec("iuf", 1, 3, 64),
    "goal": ArraySpec("iuf", 1, 2, 64), **dict.fromkeys(("x0_m", "y0_m", "cell_m"), NUMBER),
}  # fmt: skip


def to_npz(field: Field) -> bytes:
    """Bytes of the file; the same ground gives the same bytes."""
    buffer, grid = io.BytesIO(), field.grid
    rocks = np.array([(rock.x_m, rock.y_m, rock.diameter_m) for rock in field.rocks], dtype=np.float64)
    np.savez_compressed(
        buffer,
        truth_heights_m=truth_height(field),
        x0_m=grid.x0_m,
        y0_m=grid.y0_m,
        cell_m=grid.cell_m,
        start=np.array([field.start.x_m, field.start.y_m, field.start.yaw_rad]),
        goal=np.array(field.goal_m),
        rocks=rocks.reshape(-1, 3),
    )
    return buffer.getvalue()


def from_npz(data: bytes, seed: int = 0) -> Field:
    """Field from the bytes of a file: rocks become soil, the orbital map is the mean over 2 m. Raises ValueError."""
    file = read_arrays(data, _KEYS)
    z, start, goal = (np.asarray(file[key], np.float64) for key in ("truth_heights_m", "start", "goal"))
    x0_m, y0_m, cell_m = (float(file[key]) for key in ("x0_m", "y0_m", "cell_m"))
    if z.ndim != 2 or not np.isfinite(z).all() or not cell_m > 0 or start.shape != (3,) or goal.shape != (2,):
        raise ValueError(f"expected heights (rows, columns) without gaps, start (3,), goal (2,), found {z.shape}")
    grid, soil = Grid(x0_m, y0_m, cell_m, *z.shape), z.astype(np.float32)
    stats = field_stats(grid, soil, (), float("nan"))
    pose = Pose(start[0], start[1], yaw_rad=start[2])
    return Field(grid, soil, (), pose, (goal[0], goal[1]), _gdem(grid, z), seed, stats)


def _gdem(grid: Grid, z: F64) -> Gdem:
    factor = max(1, round(GDEM_CELL_M / grid.cell_m))
    heights = block_mean(z[: grid.rows // factor * factor, : grid.columns // factor * factor], factor)
    shift_m, cell_m = (factor - 1) * grid.cell_m / 2, factor * grid.cell_m
    coarse = Grid(grid.x0_m + shift_m, grid.y0_m + shift_m, cell_m, *heights.shape)
    return Gdem(coarse, heights.astype(np.float32), f"means of the ground over {cell_m:g} m")
