"""Export of a run's folder for the viewer Rerun; needs the extra [rerun]. Times are bench times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr

from hil.view.folder import Folder
from hil.view.model import about, parts, turns_rad
from hil.view.story import Moment, Story, changed
from hil.view.surfaces import Surface, ground_surface, map_surface, on_ground
from onboard.config import Rover, load
from onboard.records import F64

TIMELINE = "bench"
LEVELS = {"debug": "DEBUG", "warning": "WARN", "error": "ERROR", "critical": "CRITICAL", "fault": "ERROR"}
ORANGE, BLACK, BLUE, PURPLE, PINK, RED = (
    (236, 120, 24),
    (20, 20, 20),
    (0, 114, 178),
    (122, 45, 143),
    (214, 39, 180),
    (213, 60, 30),
)


def write(folder: Path, path: Path) -> None:
    """Write everything that `hil watch` shows. Raises NoRunError."""
    run = Folder(folder)
    run.read()
    path.parent.mkdir(parents=True, exist_ok=True)
    with rr.RecordingStream("el-dorado") as stream:
        stream.save(path)
        stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for k, time_s in enumerate([0.0, *(time_s for time_s, _ in run.story.patches)]):
            stream.set_time(TIMELINE, duration=time_s)
            ground = changed(run.ground, [patch for _, patch in run.story.patches[:k]])
            stream.log("/ground", _mesh(ground_surface(ground)))
        goal = on_ground(run.ground, np.array([run.ground.goal_m]))
        stream.log("/goal", rr.Points3D(goal, radii=0.15, colors=RED, labels="goal"), static=True)
        rover = load().rover
        _rover(stream, rover)
        _story(stream, run, rover)


def _mesh(surface: Surface) -> rr.Mesh3D:
    return rr.Mesh3D(
        vertex_positions=surface.vertices_m, triangle_indices=surface.triangles, vertex_colors=surface.colours
    )


def _rover(stream: rr.RecordingStream, rover: Rover) -> None:
    for part in parts(rover):
        boxes = part.boxes
        if part.is_wheel:
            size = (2 * rover.wheel_radius_m, rover.wheel_width_m, 2 * rover.wheel_radius_m)
            stream.log(
                f"/rover/{part.path}", rr.Ellipsoids3D(half_sizes=[np.array(size) / 2], colors=BLACK), static=True
            )
        elif boxes:
            shape = rr.Boxes3D(
                centers=[b.centre_m for b in boxes], sizes=[b.size_m for b in boxes], colors=ORANGE, fill_mode="solid"
            )
            stream.log(f"/rover/{part.path}", shape, static=True)


def _story(stream: rr.RecordingStream, run: Folder, rover: Rover) -> None:
    story = run.story
    for moment in story.moments:
        stream.set_time(TIMELINE, duration=moment.time_s)
        _pose(stream, moment, rover)
    for time_s, met in story.turns:
        stream.set_time(TIMELINE, duration=time_s)
        stream.log("/scan/points", rr.Points3D(met.points_m, colors=PINK, radii=0.015))
    for time_s, plan in story.plans:
        stream.set_time(TIMELINE, duration=time_s)
        stream.log("/map", _mesh(map_surface(plan)))
        for name, way, colour in (("global", plan.global_path, BLUE), ("local", plan.path, PURPLE)):
            stream.log(f"/paths/{name}", _line(on_ground(run.ground, way), colour))
    for told in story.told:
        stream.set_time(TIMELINE, duration=told.time_s)
        level = LEVELS.get(told.severity, "INFO")
        stream.log("/events", rr.TextLog(f"{told.name} {told.text}", level=level))
    _ways(stream, run, story)


def _ways(stream: rr.RecordingStream, run: Folder, story: Story) -> None:
    """Log the driven path once a second."""
    for time_s in np.arange(0.0, story.end_s + 1.0, 1.0):
        stream.set_time(TIMELINE, duration=time_s)
        stream.log("/paths/driven", _line(on_ground(run.ground, story.way.until(time_s)), BLACK))


def _line(points_m: F64, colour: tuple[int, int, int]) -> rr.LineStrips3D:
    return rr.LineStrips3D([points_m] if len(points_m) > 1 else [], colors=colour, radii=0.02)


def _pose(stream: rr.RecordingStream, moment: Moment, rover: Rover) -> None:
    turned = rr.Quaternion(xyzw=moment.quaternion_xyzw)
    stream.log("/rover", rr.Transform3D(translation=moment.position_m, quaternion=turned))
    angles = turns_rad(moment)
    for part in parts(rover)[1:]:
        turned = rr.Quaternion(xyzw=np.roll(about(part.axis, angles[part.name]), -1))
        stream.log(f"/rover/{part.path}", rr.Transform3D(translation=part.origin_m, quaternion=turned))
