"""Generated ground without injected faults: the rover arrives, touches nothing, and raises no fault.

Fields are the demo's (20 m x 20 m, slopes and rocks, goal 15 m away), one for each seed, with keep-outs along their
edges: the bench has no ground beyond them, and a look over an edge sees nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hil.campaign.mission import LIMIT_S, bench_to_goal
from hil.scenarios.model import Scenario
from hil.world.contacts import line

SEEDS = tuple(range(1, 11))
SHORT = (1, 2, 3)
GOAL_M = 0.3


@dataclass(frozen=True, slots=True)
class Row:
    """One mission. outcome: 'arrived' or the reason why not; to_goal_m: true distance at the end."""

    seed: int
    outcome: str
    to_goal_m: float
    way_m: float
    scans: int
    contacts: tuple[str, ...]
    faults: tuple[str, ...]
    mission_s: float


def fly(seed: int) -> Row:
    """Fly the mission on the seed's field."""
    flight = bench_to_goal(Scenario(name="nominal", terrain="fbm", seed=seed, limit_s=LIMIT_S)).run()
    told = flight.requests[-1].report if flight.requests else None
    return Row(
        seed=seed,
        outcome="arrived" if flight.arrived else flight.error or (told.text if told else "no outcome"),
        to_goal_m=round(flight.distance_to_goal_m, 3),
        way_m=round(flight.way_m, 2),
        scans=flight.sweeps,
        contacts=tuple(line(contact) for contact in flight.contacts),
        faults=tuple(event.text for event in flight.events if event.name == "FAULT"),
        mission_s=flight.bench_s,
    )


def judge(rows: Sequence[Row]) -> list[str]:
    """Check each flight: arrived within GOAL_M, no contact, no fault."""
    short = []
    for row in rows:
        if row.outcome != "arrived" or row.to_goal_m > GOAL_M:
            short.append(f"seed {row.seed}: {row.outcome}, {row.to_goal_m} m from the goal")
        if row.contacts:
            short.append(f"seed {row.seed} touched {len(row.contacts)} times, first {row.contacts[0]}")
        if row.faults:
            short.append(f"seed {row.seed} raised {', '.join(row.faults)}")
    return short
