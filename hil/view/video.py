"""Film of a run's folder seen from above: .webp or .gif, or .mp4 if ffmpeg is installed."""

from __future__ import annotations

import math
import subprocess
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hil.plant.turns import rotate
from hil.view.film_kind import KindError, check_kind
from hil.view.folder import Folder
from hil.view.story import Instant, TrueGround, changed
from hil.view.tail import NoRunError
from onboard.config import Rover, load
from onboard.records import F64
from pictures.film import Shot, film
from pictures.terrain import Ground
from protocol.conventions import WHEEL_SIGNS

FRAMES_A_SECOND, SPEED = 10, 10.0  # of the film; bench seconds in a second of it
MOST_FRAMES = 600  # a longer run plays faster, in a minute; WebP's encoder holds 2 MB of each frame
TOLD, WIDTH_OF_WORDS = 4, 105
Frames = Iterator[NDArray[np.uint8]]


def write(folder: Path, path: Path) -> None:
    """Write the film of a run. Raises KindError, NoRunError."""
    check_kind(path)
    run = Folder(folder)
    run.read()
    if not run.story.moments:
        raise NoRunError(f"{folder / 'truth.mcap'} holds no moment of a run")
    rover = load().rover
    path.parent.mkdir(parents=True, exist_ok=True)
    body_m = (rover.body_length_m, 0.6 * rover.body_width_m)  # wheels extend beyond it
    save = _mp4 if path.suffix == ".mp4" else _animated
    save(film(drawn(run.ground), run.ground.goal_m, body_m, shots(run, rover)), path)


def drawn(ground: TrueGround) -> Ground:
    """True ground as films draw it."""
    return Ground(ground.grid, ground.heights_m, ground.rocks, "the true ground")


def shots(run: Folder, rover: Rover) -> Iterator[Shot]:
    """One shot every SPEED / FRAMES_A_SECOND seconds of bench time, or MOST_FRAMES over the run, the end included."""
    story, ground, changes = run.story, None, 0
    begin_s, end_s = story.moments[0].time_s, story.end_s
    step_s = max(SPEED / FRAMES_A_SECOND, (end_s - begin_s) / (MOST_FRAMES - 1))
    times_s = np.append(np.arange(begin_s, end_s, step_s), end_s)
    for time_s in times_s.tolist():
        instant = story.at(time_s)
        assert instant is not None, "a story with moments has one at any time"
        if len(instant.patches) != changes:
            ground, changes = drawn(changed(run.ground, instant.patches)), len(instant.patches)
        yield shot(instant, rover, ground)


def shot(instant: Instant, rover: Rover, ground: Ground | None = None) -> Shot:
    """Rover's body and wheels from above, and the texts."""
    moment = instant.moment
    x, y, _ = moment.position_m
    heading_rad = _heading(rotate(moment.quaternion_xyzw, (1.0, 0.0, 0.0)))
    hubs = [(a * rover.half_wheelbase_m, b * rover.half_track_m, rover.wheel_radius_m) for a, b in WHEEL_SIGNS]
    places = [rotate(moment.quaternion_xyzw, hub) for hub in hubs]
    wheels = [(x + hub[0], y + hub[1], heading_rad + steer) for hub, steer in zip(places, moment.steer_rad)]
    alarm = [f"fault: {name}" for name in instant.faults] + [f"touches: {moment.contact}"] * bool(moment.contact)
    lines = [f"{told.time_s:6.1f} s  {told.name}  {told.text}"[:WIDTH_OF_WORDS] for told in instant.told[-TOLD:]]
    return Shot(
        (x, y, heading_rad),
        f"{instant.time_s:6.1f} s",
        np.array(wheels),
        _points(instant),
        instant.way,
        instant.believed_way,
        instant.plan,
        tuple(lines),
        "   ".join(alarm),
        ground,
    )


def _points(instant: Instant) -> F64:
    return np.concatenate([np.empty((0, 3)), *(met.points_m for met in instant.turns)])


def _heading(ahead: tuple[float, ...]) -> float:
    return math.atan2(ahead[1], ahead[0])


def _animated(frames: Frames, path: Path) -> None:
    images = (Image.fromarray(frame) for frame in frames)
    first = next(images)
    options = {"quality": 70, "method": 2} if path.suffix == ".webp" else {}
    first.save(path, save_all=True, append_images=images, duration=1000 // FRAMES_A_SECOND, loop=0, **options)


def _mp4(frames: Frames, path: Path) -> None:
    first = next(frames)
    rows, columns, _ = first.shape
    command = [
        "ffmpeg",
        "-loglevel",
        "error",
        "-y",
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{columns}x{rows}",
        "-r",
        str(FRAMES_A_SECOND),
        "-i",
        "-",
        "-pix_fmt",
        "yuv420p",
        str(path),
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as child:
        assert child.stdin is not None, "a pipe was asked for"
        for frame in chain((first,), frames):
            child.stdin.write(frame.tobytes())
        child.stdin.close()
    if child.returncode:
        raise KindError(f"{path}: ffmpeg ended with {child.returncode}")
