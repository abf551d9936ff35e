"""Picture of a flown mission."""

from __future__ import annotations

import numpy as np

from hil.campaign.truth import TrueWay
from onboard.config import Rover, Scanning
from onboard.planning import archive
from pictures.mission import Story, mission
from pictures.style import png
from pictures.terrain import Ground
from tests.missions.mission import Flight
from tests.missions.world.world import World

DOTS = 100  # per inch


def picture(world: World, perfect: TrueWay, flight: Flight) -> bytes:
    """Return the bytes of a PNG: true ground, path, contacts, decisions with their reasons, the map at each stop."""
    stops = np.array([(stop.pose.x_m, stop.pose.y_m) for stop in flight.stops])
    way = [part for at, stop in zip(stops, flight.stops) for part in (at[None], stop.driven[:, :2])]
    flown = f"{flight.way_m:.1f} m driven, {flight.scans} scans, {flight.hard} hard contacts"
    story = Story(
        ground=Ground(world.grid, world.heights_m, name=world.kind),
        goal_m=world.goal_m,
        way=np.concatenate(way),
        stops=stops,
        contacts=np.array(flight.contacts, dtype=np.float64).reshape(-1, 3),
        best=np.empty((0, 3)) if perfect.path is None else perfect.path.stations,
        plans=[archive.from_npz(archive.to_npz(stop.result)) for stop in flight.stops],
        outcome=f"{flight.kind}: {flight.reason}; {flown}",
    )
    rover = Rover()
    return png(mission(story, Scanning().sector_rad, (rover.body_length_m, rover.body_width_m)), DOTS)
