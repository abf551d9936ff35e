"""The truth planner (hil/campaign/truth.py) on the true ground of a world without physics."""

from __future__ import annotations

from hil.campaign.truth import TrueWay, true_way
from onboard.config import Config
from tests.missions.world.world import World, true_surface


def truth(world: World, config: Config) -> TrueWay:
    """Return the perfect map of a world, and the path over it."""
    return true_way(true_surface(world, config.mapping.cell_m), world.start, world.goal_m, config)
