"""Run folder as a story that grows during the run: the bench's truth and the flight program's own record.

    field.npz      true ground: required      truth.mcap     true states: required
    onboard.mcap   events, plans, and the pose estimate of the flight program; optional

Live and finished runs use the same source: a running run is a folder whose records are not finished yet. No data go
from here to the run, and no truth to the flight program.
"""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np

from hil.view.story import Moment, Story, StoryEvent, TrueGround, changed
from hil.view.tail import NoRunError, Said, Tail
from hil.world.truth import read_patch, read_turn
from onboard.maps.npz_arrays import check_size
from onboard.planning import archive
from onboard.records import Grid

EVERY = 10  # one of this many estimated poses is used: ten a second
MOST_BYTES = 1 << 29  # of the ground, and of a plan, unpacked
_DAMAGE = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RuntimeError, struct.error)


class Folder:
    """Files of a run. Raises NoRunError if there is no run."""

    def __init__(self, path: Path) -> None:
        for name in ("field.npz", "truth.mcap"):
            if not (path / name).is_file():
                raise NoRunError(f"no {path / name}: `hil run` and `hil demo` write it; --out FOLDER says where")
        self.path, self.ground, self.story = path, read_ground(path / "field.npz"), Story()
        self._contacts = 0
        self._truth, self._record = Tail(path / "truth.mcap"), Tail(path / "onboard.mcap")

    @property
    def finished(self) -> bool:
        """True if the run has ended: no more data will come."""
        return self._truth.finished

    def read(self) -> None:
        """Add the data written since the last call. Raises NoRunError."""
        for tail, add in ((self._truth, self._add_truth), (self._record, self._add_record)):
            for said in tail.read():
                try:
                    add(said)
                except _DAMAGE as error:
                    raise NoRunError(f"{tail.path} is damaged or of another version: {said.topic}, {error}") from error

    def _add_truth(self, said: Said) -> None:
        if said.topic == "/turn":
            self.story.turns.append((said.time_s, read_turn(said.data)))
            return
        if said.topic == "/ground":
            patch = read_patch(said.data)
            changed(self.ground, [patch])  # raises if it does not lie on this ground
            self.story.patches.append((said.time_s, patch))
            return
        row = json.loads(said.data)
        if said.topic == "/truth":
            names = ("position_m", "quaternion_xyzw", "rockers_rad", "steer_rad", "wheel_rad")
            self.story.add_moment(Moment(said.time_s, *(tuple(row[name]) for name in names), row["contact"]))
        elif said.topic == "/fault":
            name = f"{row['fault']} {row['target']}" if row["target"] else row["fault"]
            self.story.faults.append((said.time_s, name, row["what"] == "begin"))
            self.story.tell(StoryEvent(said.time_s, "fault", row["what"], name))
        elif said.topic == "/contact" and row["number"] == self._contacts:  # its begin; a second message has its end
            self._contacts += 1
            place = f"({row['x_m']:.2f}, {row['y_m']:.2f})"
            self.story.tell(StoryEvent(said.time_s, "fault", "contact", f"{row['what']} at {place}"))

    def _add_record(self, said: Said) -> None:
        if said.topic == "/plan":
            check_size(said.data, MOST_BYTES)
            self.story.plans.append((said.time_s, archive.from_npz(said.data)))
        elif said.topic == "/out/pose" and said.sequence % EVERY == 0:
            self.story.believed_way.add(said.time_s, np.frombuffer(said.data, "<f8")[:3])
        elif said.topic == "/out/event":
            for row in json.loads(said.data):
                self.story.tell(StoryEvent(row["now_ns"] / 1e9, row["severity"], row["name"], row["text"]))


def read_ground(path: Path) -> TrueGround:
    """Read the true ground of a run. Raises NoRunError."""
    try:
        data = path.read_bytes()
        check_size(data, MOST_BYTES)
        with np.load(io.BytesIO(data)) as file:
            heights_m = file["truth_heights_m"]
            grid = Grid(float(file["x0_m"]), float(file["y0_m"]), float(file["cell_m"]), *heights_m.shape)
            goal_x_m, goal_y_m = file["goal"].tolist()
            return TrueGround(grid, heights_m, file["rocks"], (goal_x_m, goal_y_m))
    except (*_DAMAGE, OSError, EOFError, MemoryError, zipfile.BadZipFile, zlib.error) as error:
        raise NoRunError(f"{path} is damaged: {error}") from error
