"""Playback time of a run: played at a speed, paused, set by the user, or always the newest."""

from __future__ import annotations

from dataclasses import dataclass

SPEEDS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0)


@dataclass(slots=True)
class Player:
    """Playback state.

    time_s: time that is shown
    speed: bench seconds per second
    playing: False while paused
    following: True to show the newest time of the run; seek or pause ends it
    """

    time_s: float = 0.0
    speed: float = 5.0
    playing: bool = True
    following: bool = False

    def advance(self, wall_s: float, end_s: float) -> None:
        """Advance by `wall_s` of wall time; the run is known up to `end_s`."""
        if self.following:
            self.time_s = end_s
        elif self.playing:
            self.time_s = min(self.time_s + self.speed * wall_s, max(end_s, self.time_s))

    def seek(self, time_s: float) -> None:
        """Show this time."""
        self.following, self.time_s = False, max(0.0, time_s)

    def toggle(self, end_s: float) -> None:
        """Pause, or continue; from the start if the end was reached."""
        if self.following:
            self.following = self.playing = False
            return
        self.playing = not self.playing
        if self.playing and self.time_s >= end_s:
            self.time_s = 0.0

    def follow(self, following: bool) -> None:
        """Show the newest time from now on, or continue from here."""
        self.following, self.playing = following, True
