"""The 3D scans in a run's record, made anew from its bytes: all beams, each with its time and tilt."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from onboard.config import Config
from onboard.devices.nodes import Nodes
from onboard.lidar_tool.again import rows_of
from onboard.lidar_tool.listener import Listener
from onboard.perception.scan3d import Scan3d, gather
from onboard.records import Scan
from protocol.can_codec import TiltState

BEFORE_NS, AFTER_NS = 100_000_000, 150_000_000  # the axis at rest, and a turn and its transfer


def sweeps_of(path: Path, config: Config) -> Iterator[Scan3d]:
    """One Scan3d for each sweep of the axis that brought scans, in time order. Raises DamagedRecordError."""
    listener, nodes = Listener(config.lidar), Nodes(config.rover, config.can)
    scans: list[Scan] = []
    began_ns = ended_ns = 0
    for _, inputs, _ in rows_of(path):
        nodes.receive(inputs.can_frames, inputs.now_ns)
        for chunk in inputs.lidar_chunks:
            scans += listener.receive(chunk)
        if nodes.tilt.state in (TiltState.SWEEPING, TiltState.GAP):
            began_ns, ended_ns = began_ns or inputs.now_ns, inputs.now_ns
        elif began_ns and inputs.now_ns > ended_ns + AFTER_NS:
            taken = [scan for scan in scans if began_ns - BEFORE_NS <= scan.start_ns <= ended_ns]
            if taken:
                yield gather(taken, nodes.tilt_track(began_ns - 2 * BEFORE_NS))
            scans, began_ns = [], 0
        elif not began_ns:
            scans = [scan for scan in scans if scan.start_ns > inputs.now_ns - 2 * BEFORE_NS]
