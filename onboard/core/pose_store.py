"""Pose store: saves the pose as the rover moves, and reports errors of the disk that stores all saved state.

After a restart in mid-drive the rover must know where it stands. The pose is saved when it has moved by STEP_M or
STEP_RAD from the last saved one, one save at a time, so a slow disk gets fewer. The next start begins at the saved
pose, with its uncertainty increased by the distance that the rover may have moved since. If `localisation.start_*`
changed since the pose was saved, the configured start wins: somebody moved the rover.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

from onboard.config import Config
from onboard.native.elementary import dist
from onboard.perception.pose.localisation import Localisation
from onboard.records import Event, Pose
from onboard.records.status import Save, SaveResult
from protocol.conventions import wrap_rad

KEPT = "pose"
STEP_M, STEP_RAD = 0.05, 0.05
_MOST_M = 1e5  # from the origin of the map


class Keeping:
    """Owner of the saved pose. Without `state.folder` nothing is saved.

    saves: data for the shell to store.
    events: to report; the caller takes them.
    """

    def __init__(self, config: Config, kept: bytes, localisation: Localisation) -> None:
        start = config.localisation
        self._keeps = bool(config.state.folder)
        self._start = [start.start_x_m, start.start_y_m, start.start_yaw_rad]
        self._last = localisation.pose
        self._saving = False
        self._ill: dict[str, str] = {}  # name -> error of its last save
        self.saves: list[Save] = []
        self.events: list[Event] = []
        if kept and self._keeps:
            self._recall(kept, localisation)

    def receive(self, saved: Sequence[SaveResult], now_ns: int) -> None:
        """Process the shell's results of saves; report when saving of a name fails and when it works again."""
        for name, error in saved:
            if name == KEPT:
                self._saving = False
            if error != self._ill.get(name, ""):
                self._ill[name] = error
                self.events.append(
                    Event(
                        now_ns,
                        *(
                            ("warning", "STATE", f"{name}: {error}")
                            if error
                            else ("info", "STATE", f"{name}: kept again")
                        ),
                    )
                )

    def note(self, localisation: Localisation) -> None:
        """Save the pose if it has moved enough."""
        pose, last = localisation.pose, self._last
        if not self._keeps or self._saving:
            return
        moved_m = dist((pose.x_m, pose.y_m, pose.z_m), (last.x_m, last.y_m, last.z_m))
        if moved_m < STEP_M and abs(wrap_rad(pose.yaw_rad - last.yaw_rad)) < STEP_RAD:
            return
        place = [pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad]
        tree = {"place": place, "sigma": list(localisation.sigmas), "start": self._start}
        self.saves.append(Save(KEPT, json.dumps(tree).encode()))
        self._last, self._saving = pose, True

    def digest_items(self) -> tuple[float, ...]:
        """Values of this state that go into the state digest."""
        return (self._saving, self._last.x_m, self._last.y_m)

    def _recall(self, kept: bytes, localisation: Localisation) -> None:
        try:
            tree = json.loads(kept)
            place, sigma = _four(tree["place"], -_MOST_M), _four(tree["sigma"], 0.0)
            start = tree["start"]
        except (ValueError, KeyError, TypeError) as error:
            self._say("error", f"the kept pose cannot be read, the rover is where the configuration says: {error!r}")
            return
        if start != self._start:
            self._say("warning", "the configuration has another start than before: the kept pose is not taken")
            return
        localisation.resume(Pose(place[0], place[1], place[2], 0.0, 0.0, place[3]), sigma)
        self._last = localisation.pose
        self._say("info", f"the rover is where it was: {place[0]:.2f} {place[1]:.2f}, heading {place[3]:.2f} rad")

    def _say(self, severity: str, text: str) -> None:
        self.events.append(Event(0, severity, "STATE", text))


def _four(numbers: Sequence[float], least: float) -> tuple[float, float, float, float]:
    """Return four numbers in range. Raises ValueError or TypeError otherwise."""
    x, y, z, yaw = (float(number) for number in numbers)
    if not all(least <= number <= _MOST_M for number in (x, y, z, yaw)):  # no NaN passes
        raise ValueError(f"out of range: {numbers}")
    return x, y, z, yaw
