"""Lost beams of a sweep, by direction and distance: beams that should have met ground and returned nothing.

Over any ground the steeper of two beams in one vertical plane meets something no farther off than the flatter one: a
flatter neighbour that hit something is a witness. Class of a beam whose path meets the plane through the wheels:

    hit     it returned, from any object
    lost    it returned nothing, and a flatter neighbour is its witness; or, within SURE_M, no neighbour of its
            direction, steeper or flatter, hit anything: dirt or sunlight
    open    it returned nothing within SURE_M, nor did a flatter one, but steeper ones did: the ground ends there, falls
            away, or is too dark from there on; these cannot be separated

         scanner o-----------------____ flatter, hit something: witness
                   `--.__              `---x
          |<- SURE_M ->| `--. steeper: hit or lost

Other beams are not counted: those to the sky, and those beyond SURE_M without a witness. The sensor itself loses beams
that meet ground at less than about 5 degrees: on level ground beyond 8 m, on rough ground nearer (by simulation 7 to
19 % between 4 and 8 m, 0.2 % within 4 m). So only beams within SURE_M are judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.config import Rover, Scanning
from onboard.extrinsics import lidar_rotation
from onboard.native import each
from onboard.perception.scan.beam_tilt import tilt_at
from onboard.records import F64, BeamStatus, Bool, Scan, TiltTrack
from onboard.records.scan import of_one_geometry

SECTORS = 13  # 10 degrees each, with the default sector of 65 degrees to each side
BANDS_M = (0.0, 2.0, 4.0, 6.0, 8.0)  # of the range at which a beam meets the plane
SURE_M = 4.0
SURE_BANDS = sum(edge <= SURE_M for edge in BANDS_M) - 1
_BESIDE = 2  # beams to each side that are neighbours
_GROUND_RATIO = 0.5  # of the distance to the plane: a nearer return may be the rover's own deck
_LEAST = 30  # due beams needed for a share

I64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class LostBeams:
    """Counts of one sweep; sector 0 is the rightmost, band 0 the nearest.

    due: (SECTORS, bands) int64, beams that are hit or lost.
    lost: (SECTORS, bands) int64, lost beams.
    open: (SECTORS, bands) int64, open beams.
    sector_rad: half of the width that the sectors divide.
    """

    due: I64
    lost: I64
    open: I64
    sector_rad: float

    @property
    def ratio(self) -> float:
        """Lost share of the due beams within SURE_M, all sectors together; 0 with fewer than _LEAST due beams."""
        due = int(self.due[:, :SURE_BANDS].sum())
        return int(self.lost[:, :SURE_BANDS].sum()) / due if due >= _LEAST else 0.0

    @property
    def sectors(self) -> F64:
        """(SECTORS,) lost share within SURE_M by sector; NaN with too few due beams."""
        return _shares(self.lost[:, :SURE_BANDS].sum(axis=1), self.due[:, :SURE_BANDS].sum(axis=1))

    @property
    def cells(self) -> F64:
        """(SECTORS, bands) lost share of each sector and band; NaN with too few due beams."""
        return _shares(self.lost, self.due)

    @property
    def width_rad(self) -> float:
        """Width of one sector."""
        return 2.0 * self.sector_rad / SECTORS

    def azimuth_rad(self, sector: int) -> float:
        """Middle of a sector, 0 ahead, positive left."""
        return (sector + 0.5) * self.width_rad - self.sector_rad

    def sector(self, azimuth_rad: float) -> int | None:
        """The sector of an azimuth, None outside all sectors."""
        at = int(np.floor((azimuth_rad + self.sector_rad) / self.width_rad))
        return at if 0 <= at < SECTORS else None

    def towards(self, azimuth_rad: float, range_m: float) -> float:
        """Share of lost or open beams around an azimuth (its sector and the next) up to a distance; NaN if not judged.

        The result is the worst of the single bands within SURE_M and of all bands together: bands beyond SURE_M lose
        beams on normal ground too.
        """
        at = self.sector(azimuth_rad)
        if at is None:
            return float("nan")
        last = min(max(1, int(np.searchsorted(BANDS_M, range_m))), self.due.shape[1])
        part = np.s_[max(0, at - 1) : at + 2, :last]
        unseen = self.lost[part].sum(axis=0) + self.open[part].sum(axis=0)
        looked = self.due[part].sum(axis=0) + self.open[part].sum(axis=0)
        bands = _shares(unseen, looked)[:SURE_BANDS]
        shares = [*bands, *_shares(unseen.sum(keepdims=True), looked.sum(keepdims=True))]
        return float(max((share for share in shares if share == share), default=float("nan")))


def lost_beams(scans: Sequence[Scan], tilt: TiltTrack, rover: Rover, scanning: Scanning) -> LostBeams:
    """Lost beams of a sweep. If the scans have several geometries, only those of the most frequent one are counted."""
    shape = (SECTORS, len(BANDS_M) - 1)
    if not scans or len(tilt.times_ns) < 2:
        none_due = np.zeros(shape, np.int64)
        return LostBeams(none_due, none_due, none_due, scanning.sector_rad)
    alike = of_one_geometry(scans)
    count, first_rad, step_rad = alike[0].geometry
    phi: F64 = first_rad + np.arange(count, dtype=np.float64) * step_rad
    beams = np.flatnonzero(np.abs(phi) <= scanning.sector_rad)
    phi = phi[beams]
    status = np.stack([scan.status[beams] for scan in alike])
    ranges_m = np.stack([scan.ranges_m[beams] for scan in alike])
    angles, sampled = _angles(alike, beams, tilt)
    expected_m = plane_range_m(phi, angles, rover)
    hit = (status == BeamStatus.OK) & sampled
    none = (status == BeamStatus.NO_RETURN) & sampled
    lost, open_end = _judged(hit, none, ranges_m, expected_m, angles, scanning.range_m)
    due = hit & (expected_m <= BANDS_M[-1]) | lost
    sector = np.clip((phi + scanning.sector_rad) / (2 * scanning.sector_rad) * SECTORS, 0, SECTORS - 1).astype(np.int64)
    band = np.searchsorted(np.array(BANDS_M[1:-1]), expected_m)
    cell = sector[None, :] * shape[1] + band
    due_count, lost_count, open_count = (
        np.bincount(cell[which], minlength=shape[0] * shape[1]).reshape(shape).astype(np.int64)
        for which in (due, lost, open_end)
    )
    return LostBeams(due_count, lost_count, open_count, scanning.sector_rad)


def plane_range_m(azimuth_rad: F64, tilt_rad: F64 | float, rover: Rover) -> F64:
    """Range of beams to the plane through the wheels, inf at or above the horizon.

    azimuth_rad: (n,) in the scanner's plane.
    tilt_rad: one value, or (lines, n).

    The result has their common shape.
    """
    mount = lidar_rotation(rover)
    row = (0.0, 0.0, 1.0) if mount is None else mount[2].tolist()
    ahead, left = each.cos(azimuth_rad), each.sin(azimuth_rad)
    tilt = np.asarray(tilt_rad)
    up = row[0] * ahead * each.cos(tilt) + row[1] * left - row[2] * ahead * each.sin(tilt)
    with np.errstate(divide="ignore"):
        way: F64 = np.where(up < 0.0, rover.lidar_z_m / np.maximum(-up, 0.0), np.inf)
    return way


def _angles(scans: Sequence[Scan], beams: NDArray[np.intp], tilt: TiltTrack) -> tuple[F64, Bool]:
    """Tilt of each beam, (lines, beams) rad, and its sampled flag."""
    origin_ns = int(tilt.times_ns[0])
    starts_ns = np.array([[scan.start_ns - origin_ns] for scan in scans], np.float64)
    times_ns = starts_ns + beams * np.array([[scan.beam_ns] for scan in scans])
    angles, sampled, _ = tilt_at(tilt, times_ns, origin_ns)
    return angles, sampled


def _judged(
    hit: Bool, none: Bool, ranges_m: NDArray[np.float32], expected_m: F64, angles: F64, range_m: float
) -> tuple[Bool, Bool]:
    """Flags (lines, beams) of the lost beams and of the open beams."""
    order = np.argsort(angles[:, angles.shape[1] // 2], kind="stable")  # upward beams first, then flat to steep
    sure = none & (expected_m <= SURE_M)
    far = none & (expected_m > SURE_M) & (expected_m <= min(range_m, BANDS_M[-1]))
    ground = hit & (ranges_m >= _GROUND_RATIO * expected_m)  # hits on the rover itself do not count
    witness = _before(hit, order)
    steeper = _before(ground, order[::-1])
    lost = sure & (witness | ~steeper) | far & _before(hit & (ranges_m <= range_m), order)
    return lost, sure & ~lost


def _before(hit: Bool, order: NDArray[np.intp]) -> Bool:
    """Flags (lines, beams) of beams with a neighbour that hit on an earlier line in this order."""
    seen = np.logical_or.accumulate(hit[order], axis=0)
    wide = seen.copy()
    for shift in range(1, _BESIDE + 1):
        wide[:, shift:] |= seen[:, :-shift]
        wide[:, :-shift] |= seen[:, shift:]
    before = np.zeros_like(wide)
    before[order[1:]] = wide[:-1]
    return before


def _shares(lost: I64, due: I64) -> F64:
    shares: F64 = np.where(due >= _LEAST, lost / np.maximum(due, 1), np.nan)
    return shares
