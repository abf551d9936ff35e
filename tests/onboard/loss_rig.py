"""Sweeps of a scanner over level ground, and what of them is lost, for the tests of lost beams."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.config import Config
from onboard.perception.scan.lost_beams import lost_beams, plane_range_m
from onboard.perception.scan.sweep import LINE_S, segments
from onboard.records import BeamStatus, Pose, Scan, TiltTrack

CONFIG = Config()
STEP_RAD, BEAM_NS, LINE_NS = math.radians(0.25), 25e6 / 1440, round(LINE_S * 1e9)
FAR_M = 30.0
START = Pose(0.0, 0.0)


@dataclass(frozen=True)
class Beams:
    """All beams of a sweep: (lines, beams) tilt, azimuth in the scanner's frame, way to the plane, place on it."""

    tilt_rad: np.ndarray
    azimuth_rad: np.ndarray
    range_m: np.ndarray
    x_m: np.ndarray
    y_m: np.ndarray


def track(config=CONFIG):
    """The axis over a sweep."""
    pieces = segments(config.scanning, config.rover.lidar_z_m)
    ends_ns = np.cumsum([0] + [piece.duration_ns for piece in pieces])
    angles = np.array([pieces[0].start_rad] + [piece.end_rad for piece in pieces])
    times_ns = np.arange(0, ends_ns[-1] + 10_000_000, 10_000_000)
    return TiltTrack(times_ns, np.interp(times_ns, ends_ns, angles))


TRACK = track()


def beams_from(pose=START, config=CONFIG, tilt=TRACK):
    """The sweep's beams as they meet the plane through the wheels."""
    lines = int(tilt.times_ns[-1]) // LINE_NS
    count = 2 * round(config.scanning.sector_rad / STEP_RAD) + 1
    phi = (np.arange(count) - (count - 1) / 2) * STEP_RAD
    at_ns = np.arange(lines)[:, None] * LINE_NS + np.arange(count) * BEAM_NS
    down = np.interp(at_ns, tilt.times_ns, tilt.angles_rad)
    range_m = plane_range_m(phi, down, config.rover)
    way = np.where(np.isfinite(range_m), range_m, FAR_M)
    ahead, left = config.rover.lidar_x_m + way * np.cos(phi) * np.cos(down), way * np.sin(phi)
    c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    azimuth = np.broadcast_to(phi, down.shape)
    return Beams(down, azimuth, range_m, pose.x_m + c * ahead - s * left, pose.y_m + s * ahead + c * left)


def sweep(beams, lost):
    """The scans of a sweep in which the beams `lost` (lines, beams), and those past 30 m, return nothing."""
    hit = (beams.range_m <= FAR_M) & ~lost
    ranges_m = np.where(hit, beams.range_m, np.nan).astype(np.float32)
    status = np.where(hit, BeamStatus.OK, BeamStatus.NO_RETURN).astype(np.uint8)
    first_rad = float(beams.azimuth_rad[0, 0])
    return tuple(Scan(k * LINE_NS, BEAM_NS, first_rad, STEP_RAD, ranges_m[k], status[k]) for k in range(len(hit)))


def counted(lost, pose=START):
    """The counts of a sweep from a pose. lost: of its Beams, which return nothing, (lines, beams)."""
    beams = beams_from(pose)
    return lost_beams(sweep(beams, lost(beams)), TRACK, CONFIG.rover, CONFIG.scanning)


def nothing(beams):
    """No beam is lost."""
    return np.zeros(beams.range_m.shape, np.bool_)


def at_random(ratio, seed=1):
    """Beams lost one by one."""
    return lambda beams: np.random.default_rng(seed).random(beams.range_m.shape) < ratio


def clumps(ratio, seed=1):
    """Beams lost in clumps of 3 to 30 of a line."""

    def lost(beams):
        rng, flat = np.random.default_rng(seed), np.zeros(beams.range_m.size, np.bool_)
        for start in rng.integers(0, flat.size, round(ratio * flat.size / 16.5)):
            flat[start : start + rng.integers(3, 31)] = True
        return flat.reshape(beams.range_m.shape)

    return lost


def window(low_deg, high_deg):
    """A dirty part of the window: azimuths of the scanner's own frame."""
    return lambda beams: (beams.azimuth_rad > math.radians(low_deg)) & (beams.azimuth_rad < math.radians(high_deg))


def dark(x_m, y_m, radius_m):
    """A disc of the ground that returns nothing."""
    return lambda beams: np.hypot(beams.x_m - x_m, beams.y_m - y_m) < radius_m


def sun(pose, bearing_deg, half_deg=15.0):
    """A direction of the map, seen from a pose."""

    def lost(beams):
        off = beams.azimuth_rad + pose.yaw_rad - math.radians(bearing_deg)
        return np.abs((off + math.pi) % math.tau - math.pi) < math.radians(half_deg)

    return lost
