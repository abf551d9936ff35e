"""Sensor data of bench flights, stored on disk, and a run of the estimator over them.

    python -m tests.scenarios.pose.play_tapes record 101-104,121,131  flies each seed of the campaign `localisation`
    python -m tests.scenarios.pose.play_tapes run 101-104 --set slope_slip_ratio=0.3 --set registration_scale=0.6

A flight takes a minute and a half, its tape some seconds. The path is that of the flight, whatever the estimate is, so
noise figures are fitted on tapes and judged in flights. With the figures of the flight the estimate is bit for bit that
of the flight.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hil.run.in_process import InMemory
from onboard.config import Localisation as Figures
from onboard.config import Rover as Geometry
from onboard.motion.wheel_health import SOUND, WheelHealth, Wheels
from onboard.perception.pose.localisation import Localisation
from onboard.perception.pose.registration import RegistrationResult, merge_target, register
from onboard.records import F32, F64, Bool, ImuSample, Outputs, Pose, WheelState
from tests.scenarios.pose.localisation import Stop

UNKNOWN = (math.nan,) * 3


@dataclass(frozen=True, slots=True)
class Scanned:
    """Scan of the flight.

    asked, taken: rows of the tape at which it was registered and at which the filter received the result.
    again: True if the points of the scan before entered the map again with these.
    points_base: (n, 3), m.
    """

    asked: int
    taken: int
    again: bool
    points_base: F32


@dataclass(frozen=True, slots=True)
class Tape:
    """A flight, one row a tick.

    figures: of the filter, as in the flight.
    now_ns: (n,) int64.
    wheels: (n, 4, 3) steering angle (rad), encoder (rad), age (ns); NaN if not known.
    told: (n, 4), True if the wheel was trusted.
    slips: (n,), True while SLIP_HIGH was active.
    imu: (n, 7) stamp (ns), gyro (rad/s), accelerometer (m/s^2); NaN if there was none.
    true: (n, 6) x, y, z, yaw, roll, pitch in the map's frame; NaN before the order.
    said: the same by the flight's filter.
    scans: in order.
    """

    figures: Figures
    now_ns: Any
    wheels: F64
    told: Bool
    slips: Bool
    imu: F64
    true: F64
    said: F64
    scans: tuple[Scanned, ...]

    def save(self, path: Path) -> None:
        """Write one numpy file."""
        header = json.dumps({name: getattr(self.figures, name) for name in Figures.__slots__})
        marks = np.array([(s.asked, s.taken, s.again) for s in self.scans], np.int64).reshape(-1, 3)
        points = {f"points_{k}": scan.points_base for k, scan in enumerate(self.scans)}
        np.savez(
            path,
            figures=header,
            now_ns=self.now_ns,
            wheels=self.wheels,
            told=self.told,
            slips=self.slips,
            imu=self.imu,
            true=self.true,
            said=self.said,
            scans=marks,
            **points,
        )


def load(path: Path) -> Tape:
    """Read a file of `save`."""
    with np.load(path) as kept:
        scans = tuple(
            Scanned(int(asked), int(taken), bool(again), kept[f"points_{k}"])
            for k, (asked, taken, again) in enumerate(kept["scans"])
        )
        columns = (kept[name] for name in ("now_ns", "wheels", "told", "slips", "imu", "true", "said"))
        return Tape(Figures(**json.loads(str(kept["figures"]))), *columns, scans)


class Recording(Localisation):
    """The estimator of a flight, which stores all its inputs."""

    def __init__(self, rover: Geometry, config: Figures) -> None:
        super().__init__(rover, config)
        self.figures = config
        self.rows: list[tuple[Any, ...]] = []

    def update(
        self,
        wheels: Sequence[WheelState | None],
        imu: ImuSample | None,
        now_ns: int,
        health: Wheels = SOUND,
        slips: bool = False,
    ) -> None:
        """Update the estimate and store the arguments."""
        super().update(wheels, imu, now_ns, health, slips)
        told = tuple(wheel.tells_way for wheel in health)
        felt = (imu.stamp_ns, *imu.gyro_radps, *imu.accel_mps2) if imu else (math.nan,) * 7
        known = tuple((w.steer_rad, w.position_rad, w.age_ns) if w else UNKNOWN for w in wheels)
        self.rows.append((now_ns, known, told, slips, felt))


@dataclass(slots=True)
class Recorder:
    """Recorder of a flight: attached to a bench before its first step, called each tick; makes the tape."""

    estimate: Recording | None = None
    scans: list[Scanned] = field(default_factory=list)
    true: list[Sequence[float]] = field(default_factory=list)
    said: list[Sequence[float]] = field(default_factory=list)
    _asked: int = 0

    def attach(self, bench: InMemory) -> None:
        """Replace the rover's filter before its first update."""
        assert bench.rover
        config = bench.rover.config
        bench.rover.localisation = self.estimate = Recording(config.rover, config.localisation)

    def see(self, outputs: Outputs, true: Pose | None) -> None:
        """Record a tick. true: pose in the map's frame, None before there is a map."""
        assert self.estimate
        row = len(self.estimate.rows) - 1
        for request in outputs.jobs:
            if request.name == "look":
                self._asked = row
            elif request.name == "remember":
                entries = request.arguments[1]
                seen = entries[-1].cloud_base
                self.scans.append(Scanned(self._asked, row, len(entries) == 2, seen.ends_m[seen.hit]))
        self.true.append(_row(true) if true else [math.nan] * 6)
        self.said.append(_row(self.estimate.pose))

    def tape(self) -> Tape:
        """Return the tape."""
        assert self.estimate
        now_ns, wheels, told, slips, imu = zip(*self.estimate.rows)
        return Tape(
            self.estimate.figures,
            np.array(now_ns),
            np.array(wheels, float),
            np.array(told),
            np.array(slips),
            np.array(imu, float),
            np.array(self.true),
            np.array(self.said),
            tuple(self.scans),
        )


@dataclass(frozen=True, slots=True)
class Played:
    """Estimate along a tape.

    said: (n, 6), like `Tape.said`.
    sigma: (n, 4), of x, y, z, yaw.
    before, after: of each accepted registration.
    refused: row and reason of each refused one.
    """

    said: F64
    sigma: F64
    before: tuple[Stop, ...]
    after: tuple[Stop, ...]
    refused: tuple[tuple[int, str], ...]


@dataclass(slots=True)
class Player:
    """Runs the estimator over a tape, as tick and mission do in flight."""

    tape: Tape
    figures: Figures
    target: F64 = field(default_factory=lambda: np.empty((0, 3)))
    before: list[Stop] = field(default_factory=list)
    after: list[Stop] = field(default_factory=list)
    refused: list[tuple[int, str]] = field(default_factory=list)
    _kept: tuple[F64, F32, Pose, tuple[float, float]] | None = None

    def run(self) -> Played:
        """Run it over the whole tape."""
        tape, estimate = self.tape, Localisation(Geometry(), self.figures)
        asked, taken = ({getattr(scan, name): scan for scan in tape.scans} for name in ("asked", "taken"))
        said, sigma = np.empty((len(tape.now_ns), 6)), np.empty((len(tape.now_ns), 4))
        found: RegistrationResult | None = None
        for row in range(len(tape.now_ns)):
            estimate.update(*_fed(tape, row))
            if row in taken:
                self._take(estimate, found, taken[row], row)
            if row in asked:
                self.before.append(self._stop(estimate, row))
                points, guess = asked[row].points_base, estimate.pose.matrix()
                found = register(points, self.target, guess, self.figures) if len(self.target) else None
            said[row], sigma[row] = _row(estimate.pose), np.sqrt(estimate.estimate.covariance.diagonal())
        return Played(said, sigma, tuple(self.before[1:]), tuple(self.after), tuple(self.refused))

    def _take(self, estimate: Localisation, found: RegistrationResult | None, scan: Scanned, row: int) -> None:
        taken = found if found is not None and estimate.register(found) else None
        if taken:
            self.after.append(self._stop(estimate, row))
        elif found:
            self.before.pop()
            self.refused.append((row, found.reason or "incredible"))
        pose, points, entries = estimate.anchor(taken), scan.points_base, []
        kept, self._kept = self._kept, (self.target, points, pose, estimate.force_bias_mps2)
        if scan.again and kept:
            self.target, first, first_pose, bias = kept
            entries = [(first, estimate.known_now(first_pose, bias))]
        for cloud, at in [*entries, (points, pose)]:
            self.target = merge_target(self.target, _placed(cloud, at.matrix()), (at.x_m, at.y_m))

    def _stop(self, estimate: Localisation, row: int) -> Stop:
        error = (np.array(_row(estimate.pose)) - self.tape.true[row])[:4]
        error[3] = math.remainder(error[3], math.tau)
        return Stop(error, estimate.estimate.covariance)


def _row(pose: Pose) -> list[float]:
    return [pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad, pose.roll_rad, pose.pitch_rad]


def _fed(tape: Tape, row: int) -> tuple[list[WheelState | None], ImuSample | None, int, Wheels, bool]:
    wheels = [
        None if math.isnan(steer) else WheelState(steer, position, 0.0, 0, int(age))
        for steer, position, age in tape.wheels[row].tolist()
    ]
    stamp, *felt = tape.imu[row].tolist()
    imu = None if math.isnan(stamp) else ImuSample(int(stamp), tuple(felt[:3]), tuple(felt[3:]))
    health = tuple(WheelHealth(encoder=bool(told)) for told in tape.told[row])
    return wheels, imu, int(tape.now_ns[row]), health, bool(tape.slips[row])


def _placed(points: F32, T_map_base: F64) -> F32:
    """Place points as `stop_map.moved` does."""
    placed: F32 = (points.astype(np.float64) @ T_map_base[:3, :3].T + T_map_base[:3, 3]).astype(np.float32)
    return placed
