"""Extended Kalman filter of `localisation` (filterpy): pose, gyro errors, slip, and the error of the map itself.

    state   x, y, z, yaw; gyro's bias (rad/s) and scale error; slip = 1 - (body's way) / (wheels' way); excess: share by
            which this soil slides more than its law predicts; reach: share of the way from the anchor by which
            registrations on this ground are too long;
            anchor: true pose minus the pose at which the points of the newest trusted stop entered the map
    motion  d(x, y, z) = (1 - slip) * way + (1 + excess) * slide,   d yaw = (1 - scale) * (rate - bias) * dt,
            the other states are random walks or constants
    slips   while the monitors report slip, the way is unknown: the rim displacement L of each spell adds (0.4 L)^2
    stop    a registration measures the pose less the anchor's error, moved rigidly from the anchor's place to here,
            and the reach: the errors of scanner and rock shadows are the same again at the next stop

A registration is relative to points that carry the errors of the stops before. If it were treated as absolute, the
sigmas of n stops would fall like 1 / sqrt(n) while the true error grows like sqrt(n). With the anchor in the state (a
clone of the pose, made when points enter) the covariance is that of the way from the map's origin.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from onboard.native.elementary import dist, square
from onboard.native.linear import chain, decorrelated, inner, matrix, product, solve
from onboard.records import F64
from protocol.conventions import wrap_rad

if TYPE_CHECKING:
    from onboard.perception.pose.ekf import ExtendedKalmanFilter

X, Y, Z, YAW, BIAS, SLIP, SCALE, EXCESS, REACH = range(9)
POSE, ANCHOR, STATES = slice(0, 4), slice(9, 13), 13
WIDEN = 2.0
START_SIGMA = (0.001, 0.001, 0.001, 0.001)  # the map begins here, so these only set the scale of the numbers
RESET_SIGMA = (0.05, 0.05, 0.05, 0.02)
RESUME_SIGMA = (0.1, 0.1, 0.05, 0.06)  # motion after the last stored pose: up to one storing step, and until standstill
BIAS_WALK = 2e-5  # rad/s per sqrt(s)
SCALE_SIGMA = 0.001
EXCESS_SIGMA = 0.04
REACH_SIGMA = 0.001
TILT_SIGMA = 0.002  # of the map's level: error of a registration's height with the distance from its anchor
WAY_WALK = 0.010  # m per sqrt(m), of x and y
HEIGHT_WALK = 0.005  # m per sqrt(m)
TURN_WALK = 0.001  # rad per sqrt(rad)
SLIP_WALK = 0.002  # per sqrt(m)
EXCESS_WALK = 0.003  # per sqrt(m)
SLIDE_WALK = 0.2  # of the slide, per sqrt(m): a wheel on a stone, scrubbing of steering wheels
SLIPPING_SIGMA = 0.4  # of the rims' way while the monitors report slip: 0.4 to all of it is lost
UNNOTICED_M = 0.1  # of rims' way before they report slip
SLIP_LIMITS = (-0.3, 0.9)
SURPRISE_LIMIT = 18.5  # chi-square, 4 degrees of freedom, 99.9 %

Vector = tuple[float, float, float]


class PoseFilter:
    """State and covariance; the state moves at once, `predict` updates the covariance over the motion since then."""

    def __init__(self, start: Vector, bias_sigma: float, slip: tuple[float, float]) -> None:
        """Set the start values.

        start: x, y, yaw.
        bias_sigma: 1 sigma of the gyro's bias, rad/s.
        slip: expected slip, and its sigma.
        """
        x_m, y_m, yaw_rad = start
        self.state = [x_m, y_m, 0.0, yaw_rad, *[0.0] * (STATES - 4)]
        self.state[SLIP], slip_sigma = slip
        self.covariance: F64 = np.zeros((STATES, STATES))
        sigmas = [*START_SIGMA, bias_sigma, slip_sigma, SCALE_SIGMA, EXCESS_SIGMA, REACH_SIGMA]
        self.covariance[: len(sigmas), : len(sigmas)] = np.diag(np.square(sigmas))
        self._filter: ExtendedKalmanFilter | None = None
        self._slipped_m = 0.0  # in this spell of slip
        self._rest()
        self._anchor_m = (x_m, y_m)

    def turn(self, rate_radps: float, seconds: float) -> float:
        """Turn by a rate of the gyro (or of its substitute); return the angle."""
        angle_rad = rate_radps * seconds
        self.state[YAW] = wrap_rad(self.state[YAW] + angle_rad)
        self._turn_rad += angle_rad
        self._turned_rad += abs(angle_rad)
        self._seconds += seconds
        return angle_rad

    def move(self, way_m: Vector, slide_m: Vector, rolled_m: float, slips: bool = False) -> None:
        """Move by wheel displacement and predicted slide.

        way_m, slide_m: in map axes.
        rolled_m: displacement of the rims.
        slips: the monitors report that the wheels slip. The errors of one spell all point the same way, so the
            displacement of the spell is summed before it is squared.
        """
        keep, let = 1.0 - self.state[SLIP], 1.0 + self.state[EXCESS]
        for k in range(3):
            self.state[k] += keep * way_m[k] + let * slide_m[k]
            self._way_m[k] += way_m[k]
            self._slide_m[k] += slide_m[k]
        self._rolled_m += rolled_m
        if slips:
            before_m = self._slipped_m
            self._slipped_m = max(before_m, UNNOTICED_M) + rolled_m
            self._slip_variance_m2 += square(SLIPPING_SIGMA) * (square(self._slipped_m) - square(before_m))
        else:
            self._slipped_m = 0.0

    def predict(self, gyro_noise_radps: float, turn_walk: float = TURN_WALK) -> None:
        """Update the covariance over the motion since the last call.

        gyro_noise_radps: 1 sigma of a sample, at 100 samples a second.
        """
        if self._rolled_m == 0.0 and self._turned_rad == 0.0:
            return
        way, slide, rolled_m = np.array(self._way_m), np.array(self._slide_m), self._rolled_m
        gone = (1.0 - self.state[SLIP]) * way + (1.0 + self.state[EXCESS]) * slide
        F = np.eye(STATES)
        F[X, YAW], F[Y, YAW] = -gone[Y], gone[X]
        F[:3, SLIP], F[:3, EXCESS] = -way, slide
        F[YAW, BIAS], F[YAW, SCALE] = -self._seconds, -self._turn_rad
        walks = np.zeros(STATES)
        walks[X] = walks[Y] = square(WAY_WALK) * rolled_m
        walks[Z] = square(HEIGHT_WALK) * rolled_m
        walks[YAW] = square(gyro_noise_radps) * 0.01 * self._seconds + square(turn_walk) * self._turned_rad
        walks[BIAS] = square(BIAS_WALK) * self._seconds
        walks[SLIP], walks[EXCESS] = square(SLIP_WALK) * rolled_m, square(EXCESS_WALK) * rolled_m
        walks[:3] += self._slip_variance_m2
        noise = np.diag(walks)
        if rolled_m > 0.0:
            noise[:3, :3] += square(SLIDE_WALK) / rolled_m * np.outer(slide, slide)
        kalman = self._kalman()
        kalman.F, kalman.Q = F, noise
        kalman.predict()
        self.covariance = np.asarray(kalman.P)
        self._rest()

    def see_bias(self, rate_radps: float, variance: float, seconds: float) -> None:
        """Correct the gyro's bias by its mean rate over `seconds` of standing (zero-velocity update)."""
        self.covariance[BIAS, BIAS] += square(BIAS_WALK) * seconds
        measures = np.zeros((1, STATES))
        measures[0, BIAS] = 1.0
        self._correct(np.array([rate_radps]), measures, np.array([[variance]]))

    def doubt_bias(self, sigma_radps: float) -> None:
        """Increase the variance of the gyro's bias by the square of sigma_radps."""
        self.covariance[BIAS, BIAS] += square(sigma_radps)

    def innovation(self, measured: F64) -> F64:
        """(4,): a registration's x, y, z, yaw minus their predicted values."""
        return _residual(measured, self._expected(np.array(self.state)))

    def credible(self, measured: F64, covariance: F64) -> bool:
        """True if a registration (4,) of covariance (4, 4) is consistent with the filter."""
        measures = self._measures()
        spread = chain(measures, self.covariance, measures.T) + self._tilted(covariance)
        return credible(self.innovation(measured), spread)

    def see_pose(self, measured: F64, covariance: F64) -> None:
        """Correct by a registration: x, y, z, yaw (4,) and its own covariance (4, 4)."""
        self._correct(measured, self._measures(), self._tilted(covariance))

    def anchor(self, share: float = 1.0) -> None:
        """Set the anchor: points enter the map at the current pose, and its error becomes the error of these points.

        share: weight of these points in the map here. The rest are points of earlier stops, with the anchor's earlier
            error.
        """
        clone, state = np.eye(STATES), np.array(self.state)
        clone[ANCHOR] = -(1.0 - share) * self._measures()
        clone[ANCHOR, POSE] = share * np.eye(4)
        self.covariance = chain(clone, self.covariance, clone.T)
        self.state[ANCHOR] = ((1.0 - share) * (state[POSE] - self._expected(state))).tolist()
        self._anchor_m = (self.state[X], self.state[Y])

    def off_anchor_m(self) -> float:
        """Distance from the place where the anchor's points entered."""
        return dist(self._anchor_m, self.state[:2])

    def widen(self) -> None:
        """Double the covariance of the pose; the pose stays."""
        scale = np.ones(STATES)
        scale[POSE] = math.sqrt(WIDEN)
        self.covariance = self.covariance * np.outer(scale, scale)

    def doubt(self, innovation: F64) -> None:
        """Increase the pose variance by the square of an innovation (4,): for motion that no sensor measured."""
        self.covariance = self.covariance.copy()
        self.covariance[POSE, POSE] += np.diag(np.square(innovation))

    def reset(self, x_m: float, y_m: float, z_m: float, yaw_rad: float) -> None:
        """Set the rover to an externally known pose; the other estimates and the map stay."""
        self.state[POSE] = [x_m, y_m, z_m, yaw_rad]
        self.covariance[POSE], self.covariance[:, POSE] = 0.0, 0.0
        self.covariance[POSE, POSE] = np.diag(np.square(RESET_SIGMA))

    def resume(self, place: tuple[float, float, float, float], sigma: tuple[float, float, float, float]) -> None:
        """Continue from x, y, z, yaw and their sigmas that an earlier run stored.

        The sigmas are also the error of the stored map, so the anchor has the same error: the first registration
        corrects only the motion of the rover since then.
        """
        self.reset(*place)
        kept = np.diag(np.square(sigma))
        self.covariance[POSE, POSE] = kept + np.diag(np.square(RESUME_SIGMA))
        self.covariance[ANCHOR, ANCHOR] = self.covariance[POSE, ANCHOR] = self.covariance[ANCHOR, POSE] = kept
        self._anchor_m = place[:2]

    def _rest(self) -> None:
        """Reset the motion since the last prediction to zero."""
        self._way_m, self._slide_m = [0.0] * 3, [0.0] * 3
        self._turn_rad = self._rolled_m = self._turned_rad = self._seconds = self._slip_variance_m2 = 0.0

    def _tilted(self, covariance: F64) -> F64:
        """A registration's covariance plus that of the map's tilt, whose height error grows from the anchor on."""
        tilted = covariance.copy()
        tilted[Z, Z] += square(TILT_SIGMA * self.off_anchor_m())
        return tilted

    def _expected(self, state: F64) -> F64:
        lever_x, lever_y = state[X] - self._anchor_m[0], state[Y] - self._anchor_m[1]
        off_x, off_y, off_z, off_yaw = state[ANCHOR]
        off_x -= off_yaw * lever_y + state[REACH] * lever_x
        off_y += off_yaw * lever_x - state[REACH] * lever_y
        expected: F64 = state[POSE] - (off_x, off_y, off_z, off_yaw)
        return expected

    def _measures(self) -> F64:
        lever_x, lever_y = self.state[X] - self._anchor_m[0], self.state[Y] - self._anchor_m[1]
        measures = np.zeros((4, STATES))
        measures[:, POSE], measures[:, ANCHOR] = np.eye(4), -np.eye(4)
        measures[X, ANCHOR.stop - 1], measures[Y, ANCHOR.stop - 1] = lever_y, -lever_x
        measures[X, REACH], measures[Y, REACH] = lever_x, lever_y
        return measures

    def _correct(self, measured: F64, measures: F64, noise: F64) -> None:
        """Correct by the measured values one after the other, after their noise is decorrelated.

        So filterpy inverts one number at a time; a matrix inverse comes from LAPACK and differs between processors.
        """
        kalman, before = self._kalman(), np.array(self.state)
        off = self.innovation(measured) if len(measured) == 4 else measured - product(measures, before)
        variances, (rows, offs) = decorrelated(noise, measures, off)
        for row, rest, variance in zip(rows, offs.tolist(), variances):
            kalman.update(
                np.array([rest]),
                lambda x, row=row: row[None],
                lambda x, row=row: product(row[None], x - before),
                R=np.array([[variance]]),
            )
        self.state, self.covariance = kalman.x.tolist(), np.asarray(kalman.P)
        self.state[YAW] = wrap_rad(self.state[YAW])
        self.state[SLIP] = max(SLIP_LIMITS[0], min(SLIP_LIMITS[1], self.state[SLIP]))

    def _kalman(self) -> ExtendedKalmanFilter:
        """The filterpy filter with the current state and covariance, created at first use.

        filterpy needs scipy.linalg, which loads longer than all else before a first tick, and nothing is predicted or
        corrected before the rover has moved or stood for half a second.
        """
        if self._filter is None:
            from onboard.perception.pose.ekf import ExtendedKalmanFilter

            self._filter = ExtendedKalmanFilter(dim_x=STATES, dim_z=4)
            self._filter.predict_x = lambda u: None  # the state has moved already
        self._filter.x, self._filter.P = np.array(self.state), matrix(self.covariance)
        return self._filter


def _residual(measured: F64, expected: F64) -> F64:
    """Difference of x, y, z, yaw with the yaw wrapped."""
    rest: F64 = measured - expected
    rest[3] = wrap_rad(float(rest[3]))
    return rest


def credible(innovation: F64, covariance: F64) -> bool:
    """True if an innovation (4,) over x, y, z, yaw is within its covariance (4, 4): Mahalanobis distance, 99.9 %.

    Units m, rad. Raises numpy.linalg.LinAlgError for a singular covariance.
    """
    return inner(innovation, solve(covariance, innovation)) <= SURPRISE_LIMIT
