"""What the core hands down through executive, mission and drive guard in one tick."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from onboard.core.jobs import JobBook
from onboard.devices.lidar import LidarSession
from onboard.devices.nodes import Nodes
from onboard.motion.wheel_health import SOUND, Wheels
from onboard.perception.localisation import Localisation
from onboard.planning.fences import Fence
from onboard.records import Scan


@dataclass(slots=True)
class Context:
    """What a phase may look at and order in one tick."""

    tick: int
    now_ns: int
    scans: Sequence[Scan]
    lidar: LidarSession
    nodes: Nodes
    localisation: Localisation
    jobs: JobBook
    taken: Mapping[str, Any]
    held: bool
    wheels: Wheels = SOUND
    found: Mapping[str, tuple[int, ...]] = field(default_factory=dict)  # fault -> the wheels it was found of
    fences: tuple[Fence, ...] = ()
    item: Callable[[str], float] = lambda _name: math.nan  # the newest value of a telemetry item
    utc_ns: int = 0  # 0: not known
    used_up: Collection[str] = ()  # rows whose recovery has had its chances
    seen: Mapping[str, str] = field(default_factory=dict)  # fault -> what its watch saw, in words
    judge_anew: list[str] = field(default_factory=list)  # rows whose findings are to be forgotten after this tick
