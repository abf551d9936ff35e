"""Log of a drive: readings of every tick as the nodes sent them, and a cloud for each scan. Plain arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from onboard.bringup.calibrate.plan import DriveStep
from onboard.config import Config
from onboard.core.mission.sweep import Sweep
from onboard.devices.nodes import WheelStatus
from onboard.extrinsics import imu_rotation, steer_offsets_rad
from onboard.perception.scan.scan3d import gather, points
from onboard.perception.scan.tilt_lag import Lag, lag
from onboard.records import F64, ImuSample, WheelState

FIELDS = 4 + 4 + 3 + 3 + 4  # of a row after step, time, standing
MOST_SIGMA_S = 0.001  # largest sigma of a lag that is used


@dataclass(frozen=True, slots=True)
class Log:
    """Readings of one drive, its ticks (n,) in order.

    steps: the steps of the drive.
    step: (n,) index into `steps`.
    time_s: (n,) time.
    standing: (n,) neither driving nor steering.
    position_rad: (n, 4) unwrapped encoder angles.
    steer_rad: (n, 4) steering angles as the units report them.
    gyro_radps, accel_mps2: (n, 3) in the sensor's own axes.
    current_a: (n, 4) newest current of the drives.
    clouds: (k, 3) points for each step that scans, in the tilt unit's axes from the scanner's centre; None for other
        steps. The scanner's lag is removed from them if it is known.
    lag: a Lag, or the reason why there is none.
    """

    steps: tuple[DriveStep, ...]
    step: NDArray[np.int64]
    time_s: F64
    standing: NDArray[np.bool_]
    position_rad: F64
    steer_rad: F64
    gyro_radps: F64
    accel_mps2: F64
    current_a: F64
    clouds: tuple[F64 | None, ...]
    lag: Lag | str


class Logger:
    """Collector of the readings of a drive."""

    def __init__(self, steps: Sequence[DriveStep], config: Config) -> None:
        self._steps, self._config = tuple(steps), config
        self._rows: list[tuple[float, ...]] = []
        self._sweeps: dict[int, Sweep] = {}

    def tick(
        self,
        step: int,
        now_ns: int,
        standing: bool,
        wheels: Sequence[WheelState | None],
        imu: ImuSample,
        status: Sequence[WheelStatus | None],
    ) -> None:
        """Add the row of one tick; a tick with an unknown wheel is left out."""
        if all(wheel is not None for wheel in wheels):
            currents_a = (told.drive_current_a if told else 0.0 for told in status)
            positions = (wheel.position_rad for wheel in wheels if wheel)
            steers = (wheel.steer_rad for wheel in wheels if wheel)
            self._rows.append(
                (step, now_ns * 1e-9, standing, *positions, *steers, *imu.gyro_radps, *imu.accel_mps2, *currents_a)
            )

    def scan(self, step: int, sweep: Sweep) -> None:
        """Store the sweep of a step; its points are computed after the drive, when no tick waits."""
        self._sweeps[step] = sweep

    def _lag(self) -> Lag | str:
        nods = [sweep for step, sweep in self._sweeps.items() if self._steps[step].nod is not None]
        if not nods:
            return "the drive has no sweeps down and up"
        try:
            found = lag([gather(sweep.scans, sweep.tilt) for sweep in nods], self._config.rover)
        except ValueError as error:
            return str(error)
        if found.sigma_s > MOST_SIGMA_S:
            return f"{found.late_s * 1e3:+.1f} ms with a sigma of {found.sigma_s * 1e3:.1f} ms says too little"
        return found

    def _cloud(self, step: int, late_ns: int) -> F64 | None:
        if step not in self._sweeps or not self._steps[step].scans:
            return None
        sweep = self._sweeps[step]
        scans = [replace(scan, start_ns=scan.start_ns - late_ns) for scan in sweep.scans]
        bare = replace(
            self._config.rover,
            lidar_x_m=0.0,
            lidar_y_m=0.0,
            lidar_z_m=0.0,
            lidar_roll_rad=0.0,
            lidar_pitch_rad=0.0,
            lidar_yaw_rad=0.0,
        )
        seen = points(gather(scans, sweep.tilt), bare).xyz_m
        near: F64 = seen[np.linalg.norm(seen, axis=1) <= self._config.scanning.range_m]
        return near

    def log(self) -> Log:
        """The log of all readings; the corrections of the configuration in use are removed again."""
        found = self._lag()
        late_ns = round(found.late_s * 1e9) if isinstance(found, Lag) else 0
        clouds = tuple(self._cloud(step, late_ns) for step in range(len(self._steps)))
        table = np.array(self._rows, np.float64).reshape(-1, 3 + FIELDS)
        turn = imu_rotation(self._config.rover)
        back = np.eye(3) if turn is None else np.array(turn)  # v_unit = R^T v_base, and rows are v^T
        return Log(
            self._steps,
            table[:, 0].astype(np.int64),
            table[:, 1],
            table[:, 2] > 0,
            table[:, 3:7],
            table[:, 7:11] - np.array(steer_offsets_rad(self._config.rover)),
            table[:, 11:14] @ back,
            table[:, 14:17] @ back,
            table[:, 17:21],
            clouds,
            found,
        )
