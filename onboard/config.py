"""Configuration: one frozen tree with units and ranges, read from TOML, handed down in parts.

Each value is declared once, by `config_value.value`: default, range, unit, meaning. An unknown key, a wrong type or a
value out of range is a ConfigError that names file, key and value, the allowed values and the probable intention.
`rover.toml` in this folder is the output of `onboard run --print-config`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from onboard.config_value import AT_ONCE, NEXT_MISSION, RESTART, ConfigError, from_tree, section, value
from onboard.toml_text import TomlError, parse_toml, read_toml, shown

__all__ = [
    "AT_ONCE",
    "NEXT_MISSION",
    "RAD",
    "RESTART",
    "Config",
    "ConfigError",
    "from_tree",
    "load",
    "parse_override",
    "value",
]

RAD = math.pi / 180.0


@dataclass(frozen=True, slots=True)
class Rover:
    """Geometry and limits of the vehicle (`10-navigation`, section 2)."""

    half_wheelbase_m: float = value(0.375, "half the distance of the axles (l)", low=0.05, high=3)
    half_track_m: float = value(0.23, "half the distance of left and right wheels (d)", low=0.05, high=3)
    wheel_radius_m: float = value(0.10, "rolling radius", low=0.02, high=1)
    wheel_width_m: float = value(0.10, "width of a wheel", low=0.01, high=1)
    body_length_m: float = value(0.95, "length of all that must not touch: wheels included", low=0.1, high=6)
    body_width_m: float = value(0.56, "outer width", low=0.1, high=6)
    belly_m: float = value(0.15, "clearance under the body above the wheel plane", low=0.02, high=2)
    steer_limit_rad: float = value(105 * RAD, "range of a steering unit to each side", low=0.1, high=math.pi)
    steer_rate_radps: float = value(0.5, "fastest steering", low=0.01, high=10)
    wheel_rate_limit_radps: float = value(4.0, "fastest wheel without load", low=0.1, high=100)
    lidar_x_m: float = value(0.30, "scanner's centre ahead of base_link, on the tilt axis", low=-3, high=3)
    lidar_z_m: float = value(0.70, "scanner's centre above the wheel plane", low=0.1, high=5)
    lidar_y_m: float = value(0.0, "scanner's centre left of base_link", low=-3, high=3)
    lidar_roll_rad: float = value(
        0.0,
        "tilt unit as it is bolted on: about x, after that pitch and yaw; see docs (calibration)",
        low=-0.3,
        high=0.3,
    )
    lidar_pitch_rad: float = value(0.0, "likewise, about y: down where the axis says 0", low=-0.3, high=0.3)
    lidar_yaw_rad: float = value(0.0, "likewise, about z: it looks to the left", low=-0.3, high=0.3)
    imu_roll_rad: float = value(
        0.0, "inertial sensor as it is bolted on: about x, after that pitch and yaw", low=-math.pi, high=math.pi
    )
    imu_pitch_rad: float = value(0.0, "likewise, about y", low=-math.pi, high=math.pi)
    imu_yaw_rad: float = value(0.0, "likewise, about z", low=-math.pi, high=math.pi)
    steer_1_offset_rad: float = value(0.0, "angle of wheel 1 (front left) where its unit says 0", low=-0.3, high=0.3)
    steer_2_offset_rad: float = value(0.0, "likewise of wheel 2, rear left", low=-0.3, high=0.3)
    steer_3_offset_rad: float = value(0.0, "likewise of wheel 3, rear right", low=-0.3, high=0.3)
    steer_4_offset_rad: float = value(0.0, "likewise of wheel 4, front right", low=-0.3, high=0.3)


@dataclass(frozen=True, slots=True)
class Can:
    """CAN bus between computer and hardware."""

    uri: str = value("socketcan:can0", "socketcan:IF, socketcand:HOST:PORT/BUS or virtual:NAME")
    stale_ns: int = value(30_000_000, "wheel feedback older than this stops the rover", low=1e7, high=1e9)
    silent_ns: int = value(200_000_000, "wheel feedback older than this goes to SAFE", low=5e7, high=1e10)


@dataclass(frozen=True, slots=True)
class Lidar:
    """Port and model of the scanner."""

    address: str = value("tcp:192.168.0.10:10940", "tcp:HOST:PORT, tty:PATH or, of a serial line, tty:PATH@BITRATE")
    model: str = value("UTM-30LX", "what the sensor's name must hold; empty: any")
    command: str = value(
        "MD",
        "how it is asked: D range, S short range, E with intensity; M stream, G scan by scan; "
        "N and H the same with several echoes",
        one_of=("MD", "MS", "ME", "ND", "NE", "GD", "GS", "GE", "HD", "HE"),
    )
    first_step: int = value(-1, "first step of the sector, -1: the sensor's", low=-1, high=9999)
    last_step: int = value(-1, "last step of the sector, -1: the sensor's", low=-1, high=9999)
    cluster: int = value(1, "neighbouring steps that become one value", low=1, high=99)
    skip: int = value(0, "turns left out between two scans", low=0, high=9)
    scans: int = value(0, "scans to ask for at a time, 0: endless", low=0, high=99)
    wide_intensity: bool = value(False, "intensity over more than 95 degrees by USB (old firmware crashes its laser)")
    time_seed: bool = value(False, "bound latency_ns by the sensor's counter (TM1) before the first stream")
    probe_state: bool = value(False, "ask for the state code (%ST) where the sensor does not speak SCIP 2.2 as well")
    health_ns: int = value(5_000_000_000, "while idle, the sensor's state is read this often", low=1e8, high=1e12)
    ring: int = value(16, "scans whose memory is used again", low=2, high=4096)
    reference_step: int = value(0, "step whose time the stamp names (see docs)", low=-540, high=1440)
    latency_ns: int = value(
        23_700_000,
        "from the stamped instant to the first byte of its frame, at best; a logged "
        "UTM-30LX, 1.5 ms; `onboard lidar lag` measures it",
        low=0,
        high=1e8,
    )
    range_noise_m: float = value(0.02, "1 sigma of a range", low=0, high=0.5)
    silent_ns: int = value(150_000_000, "no valid frame while streaming: LIDAR_SILENT", low=1e7, high=1e10)
    reply_timeout_ns: int = value(1_000_000_000, "a command is sent again after this", low=1e7, high=1e11)


@dataclass(frozen=True, slots=True)
class Link:
    """Space link: endpoint, keys, rate."""

    endpoint: str = value("tcp/127.0.0.1:7447", "zenoh locator of the link's rover side; udp/HOST:PORT: listen there")
    remote_node: bool = value(False, "take a tcp/ endpoint on another computer: only on a closed bench network")
    rate_bps: float = value(256_000.0, "line rate of the downlink", low=1000, high=1e9)
    command_keys: str = value("", "file with the operator stations' keys (mode 0600)")
    downlink_key: str = value("", "file with the rover's key (mode 0600)")
    bench_seed: int = value(
        -1, "where no key files are named: keys from this seed; bench only, -1 = not a bench", low=-1, high=2**31
    )
    boot_count: int = value(1, "boot id of this start on a bench", low=1, high=2**31)
    lease_s: float = value(120.0, "a station not heard for longer loses the control lease", low=10, high=1e6)


@dataclass(frozen=True, slots=True)
class Clock:
    """Source of time."""

    mode: str = value("wall", "wall, or lockstep: the bench owns time", one_of=("wall", "lockstep"))
    barrier: str = value("", "tcp:HOST:PORT of the bench's barrier (lockstep only)")


@dataclass(frozen=True, slots=True)
class Scanning:
    """Sweep of a stop (`10-navigation`, section 3). Angles in the body frame, positive down."""

    start_rad: float = value(60 * RAD, "first tilt", low=-1.6, high=1.6)
    end_rad: float = value(-20 * RAD, "last tilt", low=-1.6, high=1.6)
    spacing_m: float = value(0.05, "distance of the lines on flat ground", low=0.01, high=1)
    floor_rad: float = value(0.04 * RAD, "smallest step from line to line", low=1e-4, high=0.1)
    cap_rad: float = value(0.5 * RAD, "largest step from line to line", low=1e-3, high=0.2)
    range_m: float = value(8.0, "mapping range", low=1, high=30)
    sector_rad: float = value(65 * RAD, "usable half sector of a nodding scanner", low=0.2, high=math.pi)


@dataclass(frozen=True, slots=True)
class LostBeams:
    """Response to beams that should hit ground within 4 m and return nothing (docs, lost-beams).

    A UTM-30LX loses about 1 % over favourable ground (grey soil, steep light); the old limit was half of the beams.
    """

    slow_ratio: float = value(0.07, "share lost from which a sweep is made at half the rate", low=0.005, high=1)
    second_ratio: float = value(0.14, "and a second one is made at each stop", low=0.005, high=1)
    short_ratio: float = value(0.20, "and legs and the trusted range are short", low=0.005, high=1)
    stop_ratio: float = value(0.30, "in the last sweep of a stop: LIDAR_DIRTY, the mission ends", low=0.005, high=1)
    side_ratio: float = value(
        0.25, "share lost towards the goal that makes `no way is left` doubtful", low=0.005, high=1
    )
    looks: int = value(2, "times in a mission that it looks again before it gives up so", low=0, high=20)
    short_leg_m: float = value(2.0, "longest way between two scans then", low=0.5, high=100)
    short_range_m: float = value(5.0, "trusted range then", low=1, high=30)


@dataclass(frozen=True, slots=True)
class Mapping_:
    """The LDEM and its evaluation."""

    cell_m: float = value(0.1, "cell of the LDEM", low=0.02, high=1, takes=RESTART)
    size_m: float = value(20.0, "side of the LDEM, centred on the rover at each stop", low=4, high=100)
    near_m: float = value(5.0, "a cell with 3 hits from nearer takes the newest scan alone (R3)", low=0, high=30)
    assumed_m: float = value(0.9, "radius of the assumed disc at the start (R1)", low=0, high=3)
    trust_m: float = value(
        1.5, "on pitted ground wheels roll only over cells seen from nearer; 2.0 without the guard", low=0.7, high=30
    )
    fill_cells: int = value(2, "most missing cells that are filled between hits", low=0, high=10)
    folder: str = value("", "where the map is kept from run to run, in tiles; empty: it is not", takes=RESTART)


@dataclass(frozen=True, slots=True)
class Planning:
    """Pose freedom and the planners."""

    step_m: float = value(
        0.06, "highest step under a wheel, of those the map shows: a rock's top reads 2 cm low", low=0.01, high=1
    )
    under_belly_m: float = value(0.10, "highest thing under the body above the wheel plane", low=0.01, high=1)
    tilt_limit_rad: float = value(25 * RAD, "steepest roll or pitch from the four wheels", low=0.05, high=1)
    slope_limit_rad: float = value(20 * RAD, "steepest ground", low=0.05, high=1)
    turn_cost_m: float = value(0.08, "price of a turn of 22.5 degrees", low=0, high=5)
    closeness_weight: float = value(1.5, "soft cost near what is not free", low=0, high=20)
    touching_ratio: float = value(
        5.0, "likewise right beside a blocked pose: only where there is no other way", low=0, high=100
    )
    unknown_ratio: float = value(0.2, "price of a metre over unknown ground, above that over free", low=0, high=10)
    slippery_ratio: float = value(2.0, "price of a metre where wheels slipped, above that over free", low=0, high=10)
    planner: str = value("pose-field", "row of planning.PLANNERS", one_of=("pose-field", "distance-transform"))
    weight_roughness: float = value(1.0, "W_B of Eq. 25", low=0, high=100)
    weight_length: float = value(1.0, "W_L of Eq. 25; the unit of the others", low=0.01, high=100)
    weight_roll: float = value(0.5, "W_theta_x of Eq. 25", low=0, high=100)
    weight_pitch: float = value(0.5, "W_theta_y of Eq. 25", low=0, high=100)


@dataclass(frozen=True, slots=True)
class Mission:
    """Mission rule."""

    strategy: str = value(
        "optimistic",
        "row of planning.sensing.strategies.STRATEGIES: how the next stop is chosen",
        one_of=("optimistic", "explore", "visibility", "hill-climb"),
    )
    goal_tolerance_m: float = value(0.3, "arrived when the estimate is this near", low=0.05, high=10)
    leg_m: float = value(4.0, "longest way between two scans: odometry slips", low=0.5, high=100)
    guard: bool = value(True, "R10: a strategy chooses only while the way left shrinks; false for simulation only")
    stop_limit: int = value(40, "most sensing stops of one mission", low=1, high=10_000)
    weight_occlusion: float = value(1.0, "W_occ of Eq. 28", low=0, high=100)
    weight_distance: float = value(0.5, "W_L of Eq. 28", low=0, high=100)
    distance: str = value(
        "cost-to-go",
        "L of Eq. 28: over the map's ways, or Eq. 27's straight line",
        one_of=("cost-to-go", "straight-line"),
    )
    ground: str = value(
        "smooth",
        "smooth, or pitted: holes are possible, so wheels trust near views only (trust_m)",
        one_of=("smooth", "pitted"),
    )
    gdem: str = value(
        "", "the orbiter's map, an .npz of heights_m, x0_m, y0_m, cell_m; empty: flat, unknown", takes=RESTART
    )
    gdem_needed: bool = value(
        True, "no start where that map is missing or damaged; false: it flies without, and says so", takes=RESTART
    )


@dataclass(frozen=True, slots=True)
class DriveGuard:
    """Drive guard: the scanner, held at one angle while driving, watches the wheels' tracks."""

    on: bool = value(False, "whether it rides along")
    tilt_rad: float = value(40 * RAD, "held while driving, positive down", low=0.3, high=1.1)
    step_m: float = value(0.08, "highest step in the strip", low=0.01, high=1)
    depth_m: float = value(0.06, "depth or height against the strip's plane, change against the map", low=0.01, high=1)


@dataclass(frozen=True, slots=True)
class Motion:
    """Path following."""

    cruise_mps: float = value(0.11, "speed on a path", low=0.005, high=2)
    look_ahead_m: float = value(0.35, "distance of the carrot", low=0.05, high=5)
    heading_gain_hz: float = value(0.8, "K_p: yaw rate for an error of heading", low=0.01, high=10)
    yaw_rate_limit_radps: float = value(0.25, "fastest turn", low=0.01, high=2)
    point_turn_start_rad: float = value(45 * RAD, "error of heading at which it stops and turns", low=0.1, high=3)
    point_turn_end_rad: float = value(5 * RAD, "error of heading at which it goes on", low=0.01, high=1)
    arrive_m: float = value(0.05, "end of a path: this near to its last station", low=0.005, high=1)
    arrive_yaw_rad: float = value(2 * RAD, "end of a turn: this near to its heading", low=0.002, high=0.5)
    steer_hold_rad: float = value(15 * RAD, "steering error that holds the drive", low=0.02, high=1.5, takes=AT_ONCE)
    steer_release_rad: float = value(5 * RAD, "steering error that releases it", low=0.01, high=1.5, takes=AT_ONCE)
    law: str = value("pose-carrot", "row of motion.follower.LAWS", one_of=("pose-carrot", "carrot", "pure-pursuit"))


@dataclass(frozen=True, slots=True)
class Localisation:
    """Localisation filter and its gate."""

    start_x_m: float = value(0.0, "where the rover stands at the start, in the map frame", low=-1e5, high=1e5)
    start_y_m: float = value(0.0, "likewise", low=-1e5, high=1e5)
    start_yaw_rad: float = value(0.0, "and looks (from the lander, a star tracker, an operator)", low=-7, high=7)
    slope_slip_ratio: float = value(
        0.36, "slide down a small slope: of the way of the rims, times the slope's tangent", low=0, high=2
    )
    soil_friction_rad: float = value(
        35 * RAD, "angle at which the soil bears nothing more: the slide grows towards it", low=0.1, high=1.4
    )
    registration_range_m: float = value(15.0, "hits up to here are registered", low=2, high=30)
    level_slip_ratio: float = value(
        0.015, "share of the wheels' way that is lost on level soil, until stops tell more", low=-0.3, high=0.9
    )
    odometry_noise_ratio: float = value(0.01, "1 sigma of it", low=0, high=1)
    gyro_noise_radps: float = value(0.001, "1 sigma of a sample of the gyro", low=0, high=1)
    registration_scale: float = value(2.5, "sigmas of a registration, of those its planes tell", low=0.01, high=100)
    registration_sigma_m: float = value(0.002, "and no less than", low=0.001, high=1)
    registration_sigma_rad: float = value(3e-4, "and its heading no less than", low=1e-4, high=1)
    gate_m: float = value(0.8, "a registration that moves the pose by more is refused", low=0.01, high=10)
    gate_rad: float = value(8 * RAD, "likewise its heading", low=0.01, high=1)


@dataclass(frozen=True, slots=True)
class Safety:
    """Limits of the monitors of this rover; detection times are in protocol.tables.faults."""

    command_lost_ns: int = value(
        300_000_000_000, "no authenticated contact: finish the leg, then STANDBY", low=1e9, high=1e14
    )
    command_lost: str = value(
        "standby", "and what then: stand by, or return to the start along the driven way", one_of=("standby", "return")
    )
    tilt_limit_rad: float = value(28 * RAD, "roll or pitch that stops the rover", low=0.1, high=1)
    pose_sigma_m: float = value(0.25, "1 sigma of the place at which the rover stops and looks", low=0.01, high=10)
    heading_sigma_rad: float = value(4 * RAD, "likewise of the heading", low=0.01, high=1)
    degraded_drive: bool = value(True, "on with three drives, one steering fixed, or without an encoder; else SAFE")
    power_low_ratio: float = value(0.1, "charge under which the rover goes to SAFE", low=0, high=1)
    power_low_v: float = value(22.0, "voltage under which it does", low=0, high=40)
    brown_out_v: float = value(20.0, "voltage under which the drives rest until it is back", low=0, high=40)


@dataclass(frozen=True, slots=True)
class Computer:
    """Limits of the rover's own computer; over one of them it reports COMPUTER_STRAINED."""

    cpu_ratio: float = value(0.98, "share of all cores at work", low=0.1, high=2)
    rss_bytes: float = value(1e9, "resident memory of the flight program", low=1e7, high=1e12)
    free_memory_bytes: float = value(64e6, "least memory that stays free", low=0, high=1e12)
    temperature_c: float = value(90.0, "of the hottest sensor", low=0, high=150)


@dataclass(frozen=True, slots=True)
class Jobs:
    """Budgets of the jobs, in ticks of 10 ms."""

    map_ticks: int = value(100, "registration and map", low=1, high=100_000)
    plan_ticks: int = value(200, "sets, fields, decision, path", low=1, high=100_000)
    guard_ticks: int = value(8, "a line of the drive guard; the next comes after 10", low=1, high=100)


@dataclass(frozen=True, slots=True)
class Record:
    """Record of the run."""

    path: str = value("", "MCAP file, or with / at its end a folder with one for each run; empty: no record")
    part_bytes: int = value(64 << 20, "a longer record goes on in another file", low=1 << 16, high=1e12)
    keep_bytes: int = value(0, "the oldest files go when the folder's records are more, 0: never", low=0, high=1e15)
    spare_bytes: int = value(128 << 20, "stay free on the disk, for map and parameters", low=0, high=1e15)
    waiting_bytes: int = value(16 << 20, "wait in memory while the disk refuses", low=1 << 16, high=1e9)


@dataclass(frozen=True, slots=True)
class State:
    """Saved state, without the map."""

    folder: str = value("", "where changed parameters and fences are kept; empty: they end with the run")


@dataclass(frozen=True, slots=True)
class Realtime:
    """Real-time requests to the operating system, on the wall clock; the start reports what was granted."""

    fifo_priority: int = value(0, "SCHED_FIFO with this priority for the tick, 0: not", low=0, high=90)
    lock_memory: bool = value(False, "nothing of the program is ever swapped out (mlockall)")
    absolute_sleep: bool = value(False, "the tick is woken by a timer of the kernel at its absolute time (timerfd)")
    collect_in_slack: bool = value(False, "garbage is collected in the time left after a tick, never within one")
    cpu: int = value(-1, "the tick stays on this core and the jobs leave it, -1: any", low=-1, high=1023)


@dataclass(frozen=True, slots=True)
class Status:
    """Socket of `onboard status`."""

    socket: str = value("auto", "unix socket; auto: the usual place, and none in lock-step; off: none")


@dataclass(frozen=True, slots=True)
class Config:
    """Whole configuration tree."""

    rover: Rover = section(Rover)
    can: Can = section(Can)
    lidar: Lidar = section(Lidar)
    link: Link = section(Link)
    clock: Clock = section(Clock)
    scanning: Scanning = section(Scanning, NEXT_MISSION)
    lost_beams: LostBeams = section(LostBeams, NEXT_MISSION)
    mapping: Mapping_ = section(Mapping_, NEXT_MISSION)
    planning: Planning = section(Planning, NEXT_MISSION)
    mission: Mission = section(Mission, NEXT_MISSION)
    drive_guard: DriveGuard = section(DriveGuard, NEXT_MISSION)
    motion: Motion = section(Motion, NEXT_MISSION)
    localisation: Localisation = section(Localisation)
    safety: Safety = section(Safety, AT_ONCE)
    computer: Computer = section(Computer, AT_ONCE)
    jobs: Jobs = section(Jobs, NEXT_MISSION)
    record: Record = section(Record)
    state: State = section(State)
    realtime: Realtime = section(Realtime)
    status: Status = section(Status)


def load(path: Path | None = None, overrides: Mapping[str, Any] | None = None, source: str = "command line") -> Config:
    """Load the defaults, changed by a TOML file, then by dotted overrides ({"can.uri": "virtual:a"}).

    source: origin of the overrides, for error texts without a file. Raises FileNotFoundError for a missing file,
    ConfigError for any error in it.
    """
    tree: dict[str, Any] = {}
    if path is not None:
        try:
            tree = read_toml(path)
        except TomlError as error:
            raise ConfigError(f"{path}: not valid TOML: {error}") from error
    for dotted, item in (overrides or {}).items():
        section, _, key = dotted.rpartition(".")
        table = tree.setdefault(section, {}) if section else tree
        if not isinstance(table, dict):
            raise ConfigError(f"{path or source}: `{section}` should be a table, found {shown(table)}")
        table[key] = item
    return from_tree(Config, tree, str(path or source))


def parse_override(text: str) -> tuple[str, Any]:
    """Parse `can.uri=virtual:a` to (key, value); the value is TOML if it parses as such, else text."""
    key, sign, raw = text.partition("=")
    if not sign:
        raise ConfigError(f"command line: `{text}` should be section.key=value")
    try:
        return key.strip(), parse_toml(f"v = {raw}")["v"]
    except TomlError:
        return key.strip(), raw
