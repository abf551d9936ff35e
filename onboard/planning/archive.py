"""Plan of a stop as the bytes of an .npz, for the record and for people; the same plan gives the same bytes.

Keys, metres and radians in the map frame; grids are (rows, columns), row along +y; absent items have no rows:

    heights_m    float32, NaN unknown          x0_m y0_m cell_m   centre of cell (0, 0) and size
    node_sets    uint8 of NodeSet              score_map          float32, NaN where no candidate
    pose         (4,) x, y, z, yaw             goal_m             (2,)
    kind rule reason                           heading_rad        heading of the scan after the path
    path         (k, 3) x, y, yaw              target_m           (0 or 1, 2) target of the stop
    global_path optimistic_path  (k, 2)        scoring            reason of the strategy's choice, empty without one
    choice       (0 or 1, 4) x, y, heading, E  alternatives       (m, 4) the same for the next best
    stops        (k, 3) scanned from so far    marked             (k, 2) points that count as blocked
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from onboard.planning.plan_records import PlanResult
from onboard.records import F32, F64, U8, Grid

if TYPE_CHECKING:
    from onboard.planning.sensing.next_position import Choice


@dataclass(frozen=True, slots=True)
class PlanPicture:
    """Content of one stop's archive; the fields are its keys, except the grid. score_map is (0, 0) if absent."""

    grid: Grid
    heights_m: F32
    node_sets: U8
    score_map: F32
    pose: F64
    goal_m: F64
    kind: str
    rule: str
    reason: str
    heading_rad: float
    path: F64
    target_m: F64
    global_path: F64
    optimistic_path: F64
    scoring: str
    choice: F64
    alternatives: F64
    stops: F64
    marked: F64


def to_npz(result: PlanResult) -> bytes:
    """The plan of a stop as the bytes of an .npz."""
    decision, report, state = result.decision, result.report, result.state
    grid, found = report.grid, report.next_position
    best = () if found is None or found.best is None else (found.best,)
    target = decision.data.get("target_m")
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        heights_m=report.z_mean.astype(np.float32),
        node_sets=report.node_sets,
        score_map=np.empty((0, 0), np.float32) if found is None else found.score_map.astype(np.float32),
        x0_m=grid.x0_m,
        y0_m=grid.y0_m,
        cell_m=grid.cell_m,
        pose=np.array([result.pose.x_m, result.pose.y_m, result.pose.z_m, result.pose.yaw_rad]),
        goal_m=np.array(result.goal_m, dtype=np.float64),
        kind=decision.kind,
        rule=decision.rule,
        reason=decision.reason,
        heading_rad=decision.heading_rad,
        path=_rows(decision.path.stations, 3),
        target_m=_rows([] if target is None else [target], 2),
        global_path=_rows(report.global_path, 2),
        optimistic_path=_rows(report.optimistic_path, 2),
        scoring="" if found is None else found.reason,
        choice=_places(best),
        alternatives=_places(() if found is None else found.alternatives),
        stops=_rows(state.stops, 3),
        marked=_rows(state.marked, 2),
    )
    return buffer.getvalue()


def from_npz(data: bytes) -> PlanPicture:
    """The plan of an archive. Raises ValueError if the bytes are not such an archive."""
    try:
        with np.load(io.BytesIO(data)) as file:
            return _picture(file)
    except (KeyError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"not the archive of a plan: {error}") from error


def _picture(file: Mapping[str, NDArray[Any]]) -> PlanPicture:
    heights_m = file["heights_m"]
    rows, columns = heights_m.shape
    grid = Grid(float(file["x0_m"]), float(file["y0_m"]), float(file["cell_m"]), rows, columns)
    return PlanPicture(
        grid=grid,
        heights_m=heights_m,
        node_sets=file["node_sets"],
        score_map=file["score_map"],
        pose=file["pose"],
        goal_m=file["goal_m"],
        kind=str(file["kind"]),
        rule=str(file["rule"]),
        reason=str(file["reason"]),
        heading_rad=float(file["heading_rad"]),
        path=file["path"],
        target_m=file["target_m"],
        global_path=file["global_path"],
        optimistic_path=file["optimistic_path"],
        scoring=str(file["scoring"]),
        choice=file["choice"],
        alternatives=file["alternatives"],
        stops=file["stops"],
        marked=file["marked"],
    )


def _places(choices: Sequence[Choice]) -> F64:
    return _rows([(c.x_m, c.y_m, c.heading_rad, c.score) for c in choices], 4)


def _rows(values: Any, width: int) -> F64:
    return np.asarray(values, dtype=np.float64).reshape(-1, width)
