"""Prediction of a goto: path, length and time, on the map that the ground has. Pure; rover and ground run it.

    request -> `shown`: heights to 2 mm, freedom of the poses    (onboard; the product `ldem` carries exactly this)
            -> `predict`: the mission rule's decision over it, whole    (onboard and `ground preview`: the same bits)

The way is the decision's path, and beyond the known ground the optimistic path; if the goal lies outside the map, the
rest of the way on the orbiter's map. The rover does not drive this path: it scans first, and decides on the new map.
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from onboard.config import Config
from onboard.native import each
from onboard.native.elementary import dist, hypot
from onboard.perception.map import ldem
from onboard.perception.scan.sweep import segments
from onboard.planning import cycle, global_path
from onboard.planning.fenced import closed
from onboard.planning.local.poses import node_sets, pose_index, reachable
from onboard.planning.mission_rule import MissionState
from onboard.planning.plan_records import PlanningSettings, PlanRequest
from onboard.records import F64, CellClass, Gdem, Grid, Pose, Surface
from protocol.products import LdemProduct, MapGrid, encode_ldem, rounded
from protocol.products.pose_map import PoseMap, encode_poses

MOST_STATIONS = 60
_STRAIGHT_M = 0.02  # a station nearer than this to the line of its neighbours is left out
_STRAIGHT_RAD = math.radians(3.0)
_SPOT_M = 1e-6
_PARK_S = 3.0  # the axis moves to the start of the sweep, the stream starts
_LOOK_AGAIN_M = 2.0  # farther than this from the last look the rover looks again before it reports arrival
_STEER_S = 3.8  # the wheels steer before and after a turn on the spot, and the drives stop: measured on the bench


@dataclass(frozen=True, slots=True)
class Prediction:
    """Predicted goto.

    kind, rule, reason: those of the Decision.
    path: (k, 3) x, y, yaw to be driven on known ground, at most 60 corners.
    beyond: (m, 2) the expected way after it.
    length_m: of both, to the goal; NaN if there is no way.
    time_s: duration; NaN if there is no way.
    looks: number of scans on the way.
    """

    kind: str
    rule: str
    reason: str
    path: F64
    beyond: F64
    length_m: float
    time_s: float
    looks: int

    @property
    def leads(self) -> bool:
        """True if there is a way."""
        return math.isfinite(self.length_m)

    @property
    def words(self) -> str:
        """One line for people."""
        if not self.leads:
            return f"no way: {self.reason}"
        return f"predicted {self.length_m:.1f} m in {self.time_s:.0f} s, {self.looks} looks"

    def to_json(self, **more: Any) -> bytes:
        """One JSON object, places to the millimetre.

        more: further keys, placed first.
        """
        tree = {
            **more,
            "kind": self.kind,
            "rule": self.rule,
            "reason": self.reason,
            "length_m": _number(self.length_m, 2),
            "time_s": _number(self.time_s, 0),
            "looks": self.looks,
            "path": np.round(self.path, 3).tolist(),
            "beyond": np.round(self.beyond, 2).tolist(),
        }
        return json.dumps(tree, separators=(",", ":")).encode()


def settings_of(config: Config) -> PlanningSettings:
    """The part of the configuration that planning reads."""
    return PlanningSettings(
        config.rover, config.mapping, config.planning, config.mission, config.scanning, config.drive_guard
    )


def digest(config: Config) -> bytes:
    """Hash of 8 bytes over all settings that a prediction reads: the same on rover and ground for the same settings."""
    tree = {**asdict(settings_of(config)), "motion": asdict(config.motion), "jobs": asdict(config.jobs)}
    tree["mission"].pop("gdem")  # a file's name
    return hashlib.blake2b(json.dumps(tree, sort_keys=True).encode(), digest_size=8).digest()


def shown(request: PlanRequest, known: bool, settings: bytes = bytes(8)) -> tuple[LdemProduct, PoseMap]:
    """The map of a request as the ground receives it: heights as decoded from the product, poses and sets."""
    surface = cycle.surface_of(request)
    freedom = cycle.freedom_of(request, surface)
    pose, at = request.pose, surface.grid
    reach = reachable(freedom, *pose_index(at, pose.x_m, pose.y_m, pose.yaw_rad))
    grid = MapGrid(at.x0_m, at.y0_m, at.cell_m, at.rows, at.columns)
    poses = PoseMap(freedom, (pose.x_m, pose.y_m, pose.yaw_rad), _as_sent(request.slippery_m), known, settings)
    return LdemProduct(grid, rounded(surface.z_mean), node_sets(surface, freedom, reach)), poses


def pack(request: PlanRequest, known: bool, config: Config) -> bytes:
    """Bytes of the product of `get ldem`; runs as a job."""
    product, poses = shown(request, known, digest(config))
    return encode_ldem(product) + encode_poses(poses)


def foresee(request: PlanRequest, known: bool, config: Config) -> Prediction:
    """Prediction for the reply to a goto: `predict` on the map that the ground would receive; runs as a job."""
    product, poses = shown(request, known)
    gdem = None if request.gdem is None else closed(request.gdem, request.fences)
    return predict(product, poses, request.goal_m, gdem, config)


def predict(
    product: LdemProduct, poses: PoseMap, goal_m: tuple[float, float], gdem: Gdem | None, config: Config
) -> Prediction:
    """Prediction of a goto from the rover's place on this map, without a mission before it.

    gdem: None: a goal outside the map is assumed to lie straight ahead.
    """
    grid = Grid(*product.grid)
    z = product.heights_m
    known = np.where(np.isfinite(z), CellClass.HIT, CellClass.OCCLUDED).astype(np.uint8)
    surface = Surface(grid, known, z, z, z, np.full_like(z, np.inf))
    x_m, y_m, yaw_rad = poses.pose
    request = PlanRequest(
        ldem=ldem.empty(Grid(grid.x0_m, grid.y0_m, grid.cell_m, 1, 1)),  # not read: surface and freedom are given
        pose=Pose(x_m, y_m, yaw_rad=yaw_rad),
        goal_m=goal_m,
        gdem=gdem,
        state=MissionState(number=1) if poses.known else MissionState(),
        settings=settings_of(config),
        trail=np.array([[x_m, y_m, yaw_rad]]),
        slippery_m=poses.slippery_m,
    )
    found = cycle.decide(request, surface, poses.freedom)
    decision = found.decision
    stations = decision.path.stations
    if decision.kind == "unreachable":
        return Prediction(
            decision.kind, decision.rule, decision.reason, _corners(stations), np.empty((0, 2)), math.nan, math.nan, 0
        )
    beyond, left_m = np.empty((0, 2)), 0.0
    if decision.kind == "drive":
        beyond = _beyond(found, grid)
        left_m = _left_m(beyond, goal_m, found, config.mission.goal_tolerance_m)
    length_m = decision.path.length_m + _length_m(beyond) + left_m
    looks = _looks(length_m, config.mission.leg_m, poses.known)
    time_s = _time_s(stations, length_m, looks, poses.known, config)
    return Prediction(
        decision.kind,
        decision.rule,
        decision.reason,
        _corners(stations),
        _thinned(beyond, MOST_STATIONS),
        length_m,
        time_s,
        looks,
    )


def _as_sent(places_m: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Places rounded to the product's float32; the newest thousand."""
    return tuple((x, y) for x, y in np.array(places_m[-1000:], np.float32).reshape(-1, 2).astype(float).tolist())


def _beyond(found: cycle.PlanOutcome, grid: Grid) -> F64:
    """The optimistic way from the end of the decision's path, (m, 2); only that end if there is none."""
    chain, end = found.fields.chain, found.decision.path.stations[-1, :2]
    places = np.array([grid.x0_m, grid.y0_m]) + chain[:, 1::-1] * grid.cell_m
    if not len(places):
        return end[None, :]
    near = int(np.argmin(each.hypot(*(places - end).T)))
    return np.concatenate([[end], places[near + 1 :]])


def _left_m(beyond: F64, goal_m: tuple[float, float], found: cycle.PlanOutcome, tolerance_m: float) -> float:
    """Length of the way beyond the map's border."""
    straight_m = dist(beyond[-1].tolist(), goal_m)
    if found.global_field is None or straight_m <= tolerance_m + found.fields.surface.grid.cell_m:
        return straight_m
    way = global_path.path(found.global_field, (float(beyond[-1, 0]), float(beyond[-1, 1])))
    return _length_m(way) if len(way) > 1 else straight_m


def _looks(length_m: float, leg_m: float, known: bool) -> int:
    """Number of looks: one before each leg, one behind at an unknown place, one at the end of a long last leg."""
    legs, left_m = 1, length_m
    while left_m > 1.25 * leg_m:
        legs, left_m = legs + 1, left_m - leg_m
    return legs + (not known) + (left_m > _LOOK_AGAIN_M)


def _time_s(stations: F64, length_m: float, looks: int, known: bool, config: Config) -> float:
    """Duration: looks with their jobs, the way at cruising speed, turns on the spot."""
    sweep_s = sum(s.duration_ns for s in segments(config.scanning, config.rover.lidar_z_m)) / 1e9
    look_s = _PARK_S + sweep_s + (2 * config.jobs.map_ticks + config.jobs.plan_ticks) / 100
    steps_m = each.hypot(*np.diff(stations[:, :2], axis=0).T)
    turned = np.abs((np.diff(stations[:, 2]) + np.pi) % (2 * np.pi) - np.pi)
    on_spot = np.concatenate([[False], steps_m < _SPOT_M])
    spots_rad, spots = float(turned[on_spot[1:]].sum()), int((on_spot[1:] & ~on_spot[:-1]).sum())
    if not known:
        spots_rad, spots = spots_rad + math.pi, spots + 1
    turning_s = spots_rad / config.motion.yaw_rate_limit_radps + 2 * _STEER_S * spots
    return looks * look_s + length_m / config.motion.cruise_mps + turning_s


def _corners(stations: F64) -> F64:
    """The stations at which the way or the body turns, and the ends; at most 60."""
    kept, on_spot = [0], each.hypot(*np.diff(stations[:, :2], axis=0).T) < _SPOT_M
    for k in range(1, len(stations) - 1):
        if on_spot[k - 1] and on_spot[k]:
            continue  # in the middle of a turn on the spot
        a, b, c = stations[kept[-1]], stations[k], stations[k + 1]
        ab, ac = b[:2] - a[:2], c[:2] - a[:2]
        long_m = hypot(*ac.tolist())
        off_m = abs(float(ab[0] * ac[1] - ab[1] * ac[0])) / long_m if long_m > 1e-9 else hypot(*ab.tolist())
        turns = bool(on_spot[k - 1] or on_spot[k])
        if off_m > _STRAIGHT_M or turns or abs(math.remainder(float(c[2] - a[2]), 2 * math.pi)) > _STRAIGHT_RAD:
            kept.append(k)
    kept += [len(stations) - 1] if len(stations) > 1 else []
    return _thinned(stations[kept], MOST_STATIONS)


def _thinned(rows: F64, most: int) -> F64:
    if len(rows) <= most:
        return rows
    return rows[np.round(np.linspace(0, len(rows) - 1, most)).astype(np.int64)]


def _length_m(places: F64) -> float:
    return float(each.hypot(*np.diff(places[:, :2], axis=0).T).sum()) if len(places) > 1 else 0.0


def _number(value: float, digits: int) -> float | None:
    return round(value, digits) if math.isfinite(value) else None
