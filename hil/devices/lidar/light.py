"""Beams that return nothing or a false range: random, clumps, grazing, dark, sunlit, dirty window; outliers, specks.

    true ranges --mixed--> --lost: CAUSES--> --outliers, specks--> lidar_optics: noise and codes

The random numbers come from a separate stream of the sensor, not that of its noise: a sensor without these effects
sends the same bytes as before. Nothing here was measured on a real sensor; the ratios are those of a scenario's
[lidar].

Grazing: the returned light is proportional to the sine of the angle between beam and surface. Below the sine of
`grazing_rad` the share of lost beams rises linearly as the sine falls, to all beams at half of that sine. Level ground
under a scanner 0.7 m high is met at 5 degrees at 8 m and at 2.5 degrees at 16 m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil.devices.lidar.profile import Profile
from hil.devices.lidar.turns import BEAMS, FRONT_STEP, STEPS_A_TURN
from onboard.native import elementary

F64 = NDArray[np.float64]
Bool = NDArray[np.bool_]
LIGHT_STREAM = 3  # stream of the sensor's seed
EDGE_M = 0.2  # neighbours that differ by more have an edge between them; the beam behind it meets both sides
CAUSES = ("dark", "grazing", "sun", "window", "random")
BEAM_RAD = (np.arange(BEAMS) - FRONT_STEP) * (math.tau / STEPS_A_TURN)  # azimuth in the scanner's plane, left positive


class Surface(NamedTuple):
    """Surfaces met by the beams of a turn.

    sine: (n,), of the angle between beam and surface; 1 perpendicular, 0 or less parallel
    reach_m: (n,), range up to which the surface returns light
    azimuth_rad: (n,), of the beam in the map; None if not needed
    """

    sine: F64
    reach_m: F64
    azimuth_rad: F64 | None = None


@dataclass(slots=True)
class LightCount:
    """Number of beams in the counted sector so far.

    turns: number of turns
    due: beams whose surface is within the sensor's range, near_m to far_m
    lost: of the due beams those without return, by cause; a beam counts for the first cause in the order of CAUSES
    mixed, outliers, specks: beams with this false range
    """

    turns: int = 0
    due: int = 0
    lost: dict[str, int] = field(default_factory=lambda: dict.fromkeys(CAUSES, 0))
    mixed: int = 0
    outliers: int = 0
    specks: int = 0

    @property
    def lost_ratio(self) -> float:
        """Share of the due beams that returned nothing."""
        return sum(self.lost.values()) / self.due if self.due else 0.0

    @property
    def returns(self) -> int:
        """Due beams that returned something."""
        return self.due - sum(self.lost.values())

    def ratio(self, count: int) -> float:
        """Share of the returns."""
        return count / self.returns if self.returns else 0.0


class Light:
    """Light effects of one sensor; they act on the true ranges (1081,) of a turn, inf where nothing is.

    counted: beams that `count` counts
    dropout_ratio: of the profile until a fault changes it
    """

    def __init__(self, profile: Profile, rng: np.random.Generator) -> None:
        self._profile, self._rng = profile, rng
        self.dropout_ratio = profile.dropout_ratio
        self.counted = slice(0, BEAMS)
        self.count = LightCount()

    def mixed(self, ranges_m: F64) -> F64:
        """Ranges in which some beams behind an edge report a range between its two sides."""
        if not self._profile.mixed_ratio:
            return ranges_m
        with np.errstate(invalid="ignore"):
            steps = ranges_m[1:] - ranges_m[:-1]
            behind = np.flatnonzero(np.abs(steps) > EDGE_M)
        behind = behind[np.isfinite(steps[behind])]
        behind = behind[self._rng.random(len(behind)) < self._profile.mixed_ratio]
        if not len(behind):
            return ranges_m
        near, far = (of(ranges_m[behind], ranges_m[behind + 1]) for of in (np.minimum, np.maximum))
        beams = behind + (steps[behind] > 0)
        made = ranges_m.copy()
        made[beams] = near + self._rng.random(len(behind)) * (far - near)
        self.count.mixed += self._counted(beams)
        return made

    def lost(self, ranges_m: F64, surface: Surface | None) -> Bool | None:
        """True for each beam that returns nothing, by one of CAUSES; None if no effect is on."""
        profile = self._profile
        there = (ranges_m >= profile.near_m) & (ranges_m <= profile.far_m)
        causes = {
            "dark": surface is not None and ranges_m > surface.reach_m,
            "grazing": self._grazed(ranges_m, surface) if profile.grazing_rad else False,
            "sun": self._sunlit(surface) if profile.sun_ratio else False,
            "window": self._soiled() if profile.window_ratio else False,
            "random": self._dropped() if self.dropout_ratio else False,
        }
        count, part = self.count, self.counted
        count.turns += 1
        count.due += int(np.count_nonzero(there[part]))
        lost: Bool | None = None
        for name, found in causes.items():
            if found is False:
                continue
            new = found if lost is None else found & ~lost
            count.lost[name] += int(np.count_nonzero((new & there)[part]))
            lost = found if lost is None else lost | found
        return lost

    def _grazed(self, ranges_m: F64, surface: Surface | None) -> Bool:
        least_rad = self._profile.grazing_rad
        if surface is None:
            return grazing(ranges_m, least_rad)
        share = 2.0 * (1.0 - surface.sine / elementary.sin(least_rad))
        return np.asarray(self._rng.random(len(ranges_m)) < share)

    def _sunlit(self, surface: Surface | None) -> Bool:
        profile = self._profile
        azimuth_rad = BEAM_RAD if surface is None or surface.azimuth_rad is None else surface.azimuth_rad
        inside = in_sector(azimuth_rad, profile.sun_from_rad, profile.sun_to_rad)
        return np.asarray(inside & (self._rng.random(len(azimuth_rad)) < profile.sun_ratio))

    def _soiled(self) -> Bool:
        profile = self._profile
        inside = in_sector(BEAM_RAD, profile.window_from_rad, profile.window_to_rad)
        return np.asarray(inside & (self._rng.random(BEAMS) < profile.window_ratio))

    def _dropped(self) -> Bool:
        """Lost single beams and clumps; together dropout_ratio, of which clump_ratio in clumps."""
        profile, rng, ratio = self._profile, self._rng, self.dropout_ratio
        in_clumps = min(ratio * profile.clump_ratio, 0.999)
        alone = (ratio - in_clumps) / (1.0 - in_clumps)
        lost = rng.random(BEAMS) < alone
        if in_clumps:
            mean_beams = (profile.clump_least + profile.clump_most) / 2
            for _ in range(rng.poisson(-elementary.log(1.0 - in_clumps) * BEAMS / mean_beams)):  # clumps may overlap
                first = int(rng.integers(BEAMS))
                length = int(rng.integers(profile.clump_least, profile.clump_most + 1))
                lost[first : first + length] = True
                lost[: max(0, first + length - BEAMS)] = True  # wrap: all beams equally likely
        return np.asarray(lost)

    def outliers(self, ranges_m: F64) -> F64:
        """Ranges in which some returns are wrong."""
        profile, rng = self._profile, self._rng
        if not profile.outlier_ratio:
            return ranges_m
        count = rng.binomial(BEAMS, profile.outlier_ratio)
        if not count:
            return ranges_m
        at = rng.integers(0, BEAMS, count)
        off_m = rng.uniform(-profile.outlier_m, profile.outlier_m, len(at))
        seen = ranges_m[at] <= profile.far_m
        at, off_m = at[seen], off_m[seen]
        if not len(at):
            return ranges_m
        made = ranges_m.copy()
        made[at] = np.maximum(made[at] + off_m, profile.near_m)
        self.count.outliers += self._counted(at)
        return made

    def specks(self) -> tuple[NDArray[np.int64], F64]:
        """Beams that meet a speck of dust, and their ranges, m."""
        profile, rng = self._profile, self._rng
        count = rng.binomial(BEAMS, profile.speck_ratio) if profile.speck_ratio else 0
        if not count:
            return np.empty(0, np.int64), np.empty(0)
        at = rng.integers(0, BEAMS, count)
        self.count.specks += self._counted(at)
        return at, rng.uniform(profile.near_m, profile.speck_m, len(at))

    def _counted(self, beams: NDArray[np.int64]) -> int:
        return int(np.count_nonzero((beams >= self.counted.start) & (beams < self.counted.stop)))


def in_sector(angle_rad: F64, begin_rad: float, end_rad: float) -> Bool:
    """True for angles from begin to end, going left; for all of them if the end is a full turn or more ahead."""
    if end_rad - begin_rad >= math.tau:
        return np.ones(angle_rad.shape, np.bool_)
    inside: Bool = (angle_rad - begin_rad) % math.tau <= (end_rad - begin_rad) % math.tau
    return inside


def sector(half_rad: float) -> slice:
    """Beams within half_rad of straight ahead."""
    inside = np.flatnonzero(np.abs(BEAM_RAD) <= half_rad + 1e-9)
    return slice(int(inside[0]), int(inside[-1]) + 1)


def grazing(ranges_m: F64, least_rad: float) -> Bool:
    """Beams that meet their surface at less than `least_rad`, judged from both neighbours in the line.

    For a scanner of which only the ranges of a line are known: the slope across the line is unknown.
    """
    with np.errstate(invalid="ignore"):
        steps = np.abs(np.diff(ranges_m)) / (np.minimum(ranges_m[1:], ranges_m[:-1]) * 2 * np.pi / STEPS_A_TURN)
    flat = np.nan_to_num(steps, nan=0.0) > 1.0 / elementary.tan(least_rad)
    both: Bool = np.concatenate((flat[:1], flat)) & np.concatenate((flat, flat[-1:]))
    return both
