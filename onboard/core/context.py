"""Context of one tick, passed by the core to executive, mission and drive guard."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from onboard.core.jobs import JobBook
from onboard.devices.lidar.session import LidarSession
from onboard.devices.nodes import Nodes
from onboard.motion.wheel_health import SOUND, Wheels
from onboard.perception.pose.localisation import Localisation
from onboard.planning.fences import Fence
from onboard.records import Scan


@dataclass(slots=True)
class Context:
    """State that a phase may read and act on in one tick."""

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
    found: Mapping[str, tuple[int, ...]] = field(default_factory=dict)  # fault -> wheels concerned, 1 to 4
    fences: tuple[Fence, ...] = ()
    item: Callable[[str], float] = lambda _name: math.nan  # newest value of a telemetry item
    utc_ns: int = 0  # 0: not known
    used_up: Collection[str] = ()  # rows whose retry limit is used up
    seen: Mapping[str, str] = field(default_factory=dict)  # fault -> finding of its monitor, in words
    judge_anew: list[str] = field(default_factory=list)  # rows whose findings are dropped after this tick
