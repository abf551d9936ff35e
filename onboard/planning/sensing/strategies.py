"""Strategies for the next stop, by the names of `mission.strategy`: score of a place and search for the best.

`optimistic` chooses by rule R5 alone and scores nothing: its row is None. R10 guards all others, so every mission ends.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from onboard.config import Mission
from onboard.planning.sensing.gain import Eyes
from onboard.planning.sensing.next_position import Criterion, NextPosition, Question, choose, choose_by_climb


@dataclass(frozen=True, slots=True)
class Strategy:
    """A row of STRATEGIES.

    gain: of Eq. 28.
    climbs: search by Algorithm 2 instead of scoring every candidate.
    """

    gain: str
    climbs: bool = False


STRATEGIES: Mapping[str, Strategy | None] = MappingProxyType(
    {
        "optimistic": None,
        "explore": Strategy("newly-seen"),
        "visibility": Strategy("visibility"),
        "hill-climb": Strategy("visibility", climbs=True),
    }
)


def next_position(question: Question, eyes: Eyes, mission: Mission, stop: int) -> NextPosition | None:
    """The result of the mission's strategy at its `stop`-th stop; None if the strategy scores nothing.

    The seeds of a climb depend on the stop's number and the free cells alone: the same stop gives the same result.
    """
    strategy = STRATEGIES[mission.strategy]
    if strategy is None:
        return None
    criterion = Criterion(strategy.gain, mission.weight_occlusion, mission.weight_distance)
    if not strategy.climbs:
        return choose(question, eyes, criterion)
    generator = np.random.default_rng([stop, zlib.crc32(question.free.tobytes())])
    return choose_by_climb(question, eyes, criterion, generator)
