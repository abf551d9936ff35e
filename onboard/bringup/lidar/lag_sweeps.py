"""Sweeps that measure the scanner's lag, on a standing rover without the flight program: inputs in, outputs out.

    LISTENING --1.2 s, nothing against it--> READY --go--> MOVING: settle, sweep after sweep --> STOPPING --> DONE

Nothing is sent before `go`. The wheels get no motion command. The scanner streams from `go` to the last sweep, so one
estimate of its clock applies to all sweeps.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

from onboard.bringup.can.moving.jog import LISTEN_NS, OFF_NS, REST_RADPS, Phase
from onboard.bringup.can.moving.permit import Permit
from onboard.config import Config, Scanning
from onboard.core.mission.sweep import Sensing, Sweep
from onboard.devices.lidar.session import LidarSession
from onboard.devices.nodes import Nodes
from onboard.perception.scan.sweep import TiltSegment
from onboard.perception.scan.tilt_lag import nods
from onboard.records import Inputs, Outputs, Scan
from protocol.tables.modes import Mode

CLOCK_NS = 3_000_000_000  # until the estimate of the scanner's clock has settled
MOST_TRIES = 2  # tries of a sweep
LATE_RATIO, LATE_S = 2.0, 40.0  # a sweep may take this much longer than planned


def begun(config: Config, nod: TiltSegment) -> Sensing:
    """A new sweep for the lag, from the start of its segment."""
    scanning: Scanning = replace(config.scanning, start_rad=nod.start_rad)
    return Sensing(replace(config, scanning=scanning), (nod,))


class LagSweeps:
    """State machine of the sweeps, run by `tick`.

    problem: one line with the reason of a refusal or an early end.
    sweeps: the sweeps so far.

    Raises ValueError if the configured axis has too little travel.
    """

    def __init__(self, config: Config) -> None:
        self._config, self.nods = config, nods(config.scanning)
        self.nodes, self.lidar = Nodes(config.rover, config.can), LidarSession(config.lidar)
        self.nodes.enabled = False
        self.phase, self.problem, self.stopped, self.agreed = Phase.LISTENING, "", False, False
        self.sweeps: list[Sweep] = []
        self._permit = Permit(self.nodes, ("TILT",))
        self._since_ns: int | None = None  # start of the phase
        self._sweep_ns = 0
        self._doing = begun(config, self.nods[0])

    def go(self, now_ns: int) -> None:
        """Go from READY to MOVING; the operator has agreed."""
        if self.phase is Phase.READY:
            self.agreed = True
            self._enter(Phase.MOVING, now_ns)
            self._sweep_ns = now_ns
            self.nodes.enabled = True

    def stop(self) -> None:
        """End the sweeps with the next tick; without effect before `go`."""
        self.stopped = True

    @property
    def at(self) -> int:
        """Number of the current sweep, from 0."""
        return len(self.sweeps)

    @property
    def complete(self) -> bool:
        """True if every sweep was taken."""
        return len(self.sweeps) == len(self.nods)

    def tick(self, inputs: Inputs) -> Outputs:
        """Process the inputs of one tick of 10 ms and return its outputs."""
        now_ns = inputs.now_ns
        self._since_ns = now_ns if self._since_ns is None else self._since_ns
        self.nodes.receive(inputs.can_frames, now_ns, inputs.can)
        self._permit.hear(inputs.can_frames)
        scans = self.lidar.receive(inputs.lidar_chunks, inputs.lidar_state, now_ns)
        match self.phase:
            case Phase.LISTENING:
                self._listen(now_ns)
            case Phase.READY:
                self._end(next(self._permit.forbidden(), ""), now_ns)
            case Phase.MOVING:
                self._sweep(scans, now_ns)
            case Phase.STOPPING:
                self._rest(now_ns)
        if self.phase not in (Phase.MOVING, Phase.STOPPING):
            return Outputs(lidar_bytes=self._farewell(now_ns), state_digest=self._digest())
        return Outputs(
            can_frames=self.nodes.send(now_ns, Mode.STANDBY),
            lidar_bytes=self.lidar.send(now_ns),
            lidar_connect=self.lidar.wants_connect(now_ns),
            state_digest=self._digest(),
        )

    def _digest(self) -> bytes:
        items = (self.phase.value, self.at, self.nodes.digest_items(), self.lidar.digest_items())
        return hashlib.blake2b(repr(items).encode(), digest_size=8).digest()

    def _farewell(self, now_ns: int) -> bytes:
        return self.lidar.farewell(now_ns) if self.phase is Phase.DONE and not self.lidar.dark else b""

    def _enter(self, phase: Phase, now_ns: int) -> None:
        self.phase, self._since_ns = phase, now_ns

    def _end(self, problem: str, now_ns: int) -> None:
        if problem:
            self.problem = problem
            self._enter(Phase.STOPPING if self.phase is Phase.MOVING else Phase.DONE, now_ns)

    def _listen(self, now_ns: int) -> None:
        self._end(next(self._permit.forbidden(), ""), now_ns)
        if not self.problem and now_ns - (self._since_ns or 0) >= LISTEN_NS:
            self._end(next(chain(self._permit.missing(), self._blind()), ""), now_ns)
            if not self.problem:
                self._enter(Phase.READY, now_ns)

    def _sweep(self, scans: Sequence[Scan], now_ns: int) -> None:
        self._end(next(chain(self._permit.forbidden(), self._against(now_ns)), ""), now_ns)
        if self.problem:
            return
        self.lidar.stream(True)
        if self.stopped:
            self._enter(Phase.STOPPING, now_ns)
        elif now_ns - (self._since_ns or 0) >= CLOCK_NS:
            self._advance(scans, now_ns)

    def _advance(self, scans: Sequence[Scan], now_ns: int) -> None:
        sweep = self._doing.step(self.lidar, self.nodes, scans, now_ns)
        if sweep is None:
            return
        self.sweeps.append(sweep)
        self._sweep_ns = now_ns
        if self.complete:
            self._enter(Phase.STOPPING, now_ns)
        else:
            self.lidar.stream(True)
            self._doing = begun(self._config, self.nods[self.at])

    def _rest(self, now_ns: int) -> None:
        self.lidar.stream(False)
        self.nodes.enabled = False
        if now_ns - (self._since_ns or 0) >= OFF_NS:
            self._enter(Phase.DONE, now_ns)

    # -- reasons to stop ---------------------------------------------------------------------------------------

    def _blind(self) -> Iterator[str]:
        if self.nodes.tilt_angle_rad is None:
            yield "TILT sends no feedback: it will not be moved blindly"

    def _against(self, now_ns: int) -> Iterator[str]:
        if any(wheel and abs(wheel.rate_radps) > REST_RADPS for wheel in self.nodes.wheels):
            yield "the rover moves: a lag is seen from a standing one only"
        if self.lidar.complaint:
            yield f"scanner: {self.lidar.complaint}"
        if self._doing.tries > MOST_TRIES:
            yield "the scanner or its axis gives no whole scan: `onboard lidar check`, `onboard can jog --tilt 0.2`"
        planned_s = self.nods[min(self.at, len(self.nods) - 1)].duration_ns * 1e-9
        if now_ns - self._sweep_ns > (LATE_RATIO * planned_s + LATE_S) * 1e9:
            yield f"a sweep takes too long: {(now_ns - self._sweep_ns) * 1e-9:.0f} s"
