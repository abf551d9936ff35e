"""Map and paths of a stop's plan as ROS 2 messages."""

from __future__ import annotations

from typing import Any

import numpy as np

from onboard.bringup.ros2.types import MAP, header, new, pose, stamp
from onboard.planning.archive import PlanPicture
from onboard.records import F32, F64, Grid, NodeSet

# of nav_msgs/OccupancyGrid: 0 free, 100 occupied, -1 unknown
OCCUPANCY = {NodeSet.OUTSIDE: -1, NodeSet.OCCLUDED: -1, NodeSet.OBSTACLE: 100, NodeSet.FREE: 0}
_OCCUPANCY_OF = np.array([OCCUPANCY[NodeSet(number)] for number in sorted(NodeSet)], np.int8)


def occupancy(plan: PlanPicture, now_ns: int) -> Any:
    """Build nav_msgs/OccupancyGrid of the node sets: row along +y, as in the record; its origin is a cell's corner."""
    grid = plan.grid
    corner = (grid.x0_m - grid.cell_m / 2, grid.y0_m - grid.cell_m / 2, 0.0)
    info = new(
        "nav_msgs/MapMetaData",
        map_load_time=stamp(now_ns),
        resolution=grid.cell_m,
        width=grid.columns,
        height=grid.rows,
        origin=pose(corner),
    )
    return new(
        "nav_msgs/OccupancyGrid", header=header(now_ns, MAP), info=info, data=_OCCUPANCY_OF[plan.node_sets].ravel()
    )


def grid_map(plan: PlanPicture, now_ns: int) -> Any:
    """Build grid_map_msgs/GridMap with the layers `elevation` (m, NaN unknown) and `node_set`.

    Its convention: cell (0, 0) has the greatest x and y, rows run along -x, columns along -y, stored by column.
    """
    grid = plan.grid
    layers = {"elevation": plan.heights_m, "node_set": plan.node_sets.astype(np.float32)}
    middle = (grid.x0_m + (grid.columns - 1) * grid.cell_m / 2, grid.y0_m + (grid.rows - 1) * grid.cell_m / 2, 0.0)
    info = new(
        "grid_map_msgs/GridMapInfo",
        resolution=grid.cell_m,
        length_x=grid.columns * grid.cell_m,
        length_y=grid.rows * grid.cell_m,
        pose=pose(middle),
    )
    return new(
        "grid_map_msgs/GridMap",
        header=header(now_ns, MAP),
        info=info,
        layers=list(layers),
        basic_layers=["elevation"],
        data=[_layer(grid, values) for values in layers.values()],
        outer_start_index=0,
        inner_start_index=0,
    )


def path(points_m: F64, now_ns: int) -> Any:
    """Build nav_msgs/Path of (k, 2) x, y or (k, 3) x, y, yaw; on the ground plane, z is 0."""
    poses = [
        new("geometry_msgs/PoseStamped", header=header(now_ns, MAP),
            pose=pose((float(x), float(y), 0.0), float(rest[0]) if rest else 0.0))
        for x, y, *rest in points_m
    ]  # fmt: skip
    return new("nav_msgs/Path", header=header(now_ns, MAP), poses=poses)


def _layer(grid: Grid, values: F32) -> Any:
    rows, columns = grid.columns, grid.rows  # of the message: a row is one x
    sizes = (("column_index", columns, rows * columns), ("row_index", rows, rows))
    layout = new("std_msgs/MultiArrayLayout", data_offset=0, dim=[
        new("std_msgs/MultiArrayDimension", label=label, size=size, stride=stride) for label, size, stride in sizes
    ])  # fmt: skip
    flipped = np.ascontiguousarray(values[::-1, ::-1], np.float32)  # first index -y, second -x: by column
    return new("std_msgs/Float32MultiArray", layout=layout, data=flipped.ravel())
