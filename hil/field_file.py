"""The true ground of a run as the bytes of an .npz, for reports; the flight program never sees it.

    truth_heights_m  (rows, columns) float32, top of soil and rocks    x0_m y0_m cell_m   centre of cell (0, 0), size
    start            (3,) x, y, yaw      goal (2,) x, y                rocks              (n, 3) x, y, diameter
"""

from __future__ import annotations

import io

import numpy as np

from hil.terrain import Field, truth_height


def to_npz(field: Field) -> bytes:
    """The ground as a file's bytes; the same ground gives the same bytes."""
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
