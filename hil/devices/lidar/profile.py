"""Profiles of emulated scanners: strings, quirks, times of sensor and link.

Numbers are from logs of real sensors. Marks in the order of trust: [LOG] byte logs of real sensors, [SPEC]
C-42-03320B, [SRC] a public driver or simulator, [?] no source known, a plain guess that can be changed here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

Pairs = tuple[tuple[str, str], ...]
Bursts = tuple[tuple[float, int], ...]


@dataclass(frozen=True, slots=True)
class Texts:
    """Texts of the replies to VV, PP and II.

    version, parameters: lines of VV and PP
    speed: SCSP of II
    link: SBPS of II
    well, trouble: STAT of II without and with a failure
    modes: MESM of II for the states of %ST ("" for any other)
    """

    version: Pairs
    parameters: Pairs
    speed: str
    link: str
    well: str
    trouble: str
    modes: Pairs

    def mode(self, state: str) -> str:
        """MESM of II for a state."""
        return dict(self.modes).get(state, dict(self.modes)[""])


@dataclass(frozen=True, slots=True)
class Quirks:
    """Known deviations of firmware from the standard. All off: the standard.

    state_command: %ST is known
    timing_answers: commands that TM mode does not refuse
    time_anywhere: TM1 gets a reply outside TM mode
    time_twice: TM0 in TM mode is no error
    deaf_quit: the first QT of a stream is ignored
    late_idle_ns: time after QT during which II still reports the old state
    sum_with_semicolon: the sum of a text line also covers its `;`
    sum_stops_at_arrow: the sum covers nothing from `<-` on
    leading_blanks: `DMIN: 23`
    time_in_characters: TIME of II in 4 characters instead of 6 hexadecimal digits
    cluster_floor: beams that do not fill the last cluster are omitted
    """

    state_command: bool = False
    timing_answers: frozenset[str] = frozenset()
    time_anywhere: bool = False
    time_twice: bool = False
    deaf_quit: bool = False
    late_idle_ns: int = 0
    sum_with_semicolon: bool = False
    sum_stops_at_arrow: bool = False
    leading_blanks: bool = False
    time_in_characters: bool = False
    cluster_floor: bool = False


UTM_TEXTS = Texts(
    version=(
        ("VEND", "Hokuyo Automatic Co.,Ltd."), ("PROD", "SOKUIKI Sensor TOP-URG UTM-30LX"),
        ("FIRM", "P.1.05(17/Apr./2009)"), ("PROT", "SCIP 2.0"), ("SERI", "00903971"),
    ),
    parameters=(
        ("MODL", "UTM-30LX(Hokuyo Automatic Co.,Ltd.)"), ("DMIN", "23"), ("DMAX", "60000"), ("ARES", "1440"),
        ("AMIN", "0"), ("AMAX", "1080"), ("AFRT", "540"), ("SCAN", "2400"),
    ),
    speed="Initial(2400[rpm])<-Default setting by user",
    link="USB Full Speed", well="Sensor works well.", trouble="Trouble!! Error No. =[00->33]",
    modes=(("", "IDLE"), ("004", "CLASSIC")),
)  # fmt: skip
EW_TEXTS = Texts(  # PROD, FIRM, PROT, MESM, SBPS, STAT as in urg_stamped's simulator [SRC]; the rest [?]
    version=(
        ("VEND", "Hokuyo Automatic Co.,Ltd."), ("PROD", "UTM-30LX-EW"), ("FIRM", "1.1.0 (2011-09-30)"),
        ("PROT", "SCIP 2.2"), ("SERI", "H0000000"),
    ),
    parameters=(
        ("MODL", "UTM-30LX-EW"), ("DMIN", "23"), ("DMAX", "60000"), ("ARES", "1440"), ("AMIN", "0"), ("AMAX", "1080"),
        ("AFRT", "540"), ("SCAN", "2400"),
    ),
    speed="Initial(2400[rpm])<-Default setting by user",
    link="Ethernet 100 [Mbps]", well="Stable 000 no error.", trouble="Error 033 laser trouble.",
    modes=(
        ("", "000 Idle"), ("001", "001 Booting"), ("002", "002 Time_adjust"), ("003", "003 Single_scan"),
        ("004", "004 Multi_scan"), ("005", "005 Sleep"), ("006", "006 Waking"), ("900", "900 Error"),
    ),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Profile:
    """One sensor and its link. Ratios of 1; times in ns of bench time.

    Time:
    rate_error, start_ms: rate error and first count of the counter
    turn_ns: period of the motor
    motor_jitter_ns: sigma of each turn's start
    stamp_step: step whose time is a scan's stamp
    reply_tick_ns: replies leave at the next multiple of it; 0: at once
    time_reply_ns: delay of the reply to TM1
    latency_ns: from the end of the sweep to the first byte of its scan
    jitter_ns: sigma of a half-normal added to it
    spike_ratio, spike_ns: share of the scans that wait longer, and mean of their extra wait (exponential)
    bursts: (share of the frame's bytes, time after its first byte)
    turn_bytes: capacity of the link in a turn; a longer scan takes more turns, and its bursts are as many times slower;
        0: no limit

    Power:
    dark_ns: time without link after power-on or RB
    denied_ns: time after that during which measuring and TM0 are denied
    reboot_ns: from the second RB to the power-on
    wake_ns: from QT in sleep to standby

    Features:
    usb: True if the stream outlives its client
    baud: effect of SS: "usb" (accepted without effect), "fixed" (refused) or "network" (not known)
    speeds, sensitivities, drills: CR, HS, DB are known
    echoes: largest number of echoes a beam, for ND, NE, HD, HE

    Light, set by a scenario's [lidar] (lidar_errors.py):
    near_m, far_m: limits of the range
    noise_near_m, noise_far_m: sigma up to 10 m, and beyond
    grazing_rad: a surface met at a smaller angle returns nothing (details in lidar_light.py)
    dropout_ratio: share of the beams that return nothing
    clump_ratio: share of these that are lost in clumps of clump_least to clump_most neighbours
    sun_ratio: share of the beams that return nothing, of those with an azimuth from sun_from_rad to sun_to_rad, to the
        left
    window_ratio: the same for angles of the scanner's own plane, window_from_rad to window_to_rad
    mixed_ratio: share of the beams behind an edge that report a range between both sides
    outlier_ratio: share of the returns that are wrong by up to outlier_m
    speck_ratio: share of the beams that meet a speck of dust within speck_m
    """

    name: str = "ideal"
    texts: Texts = UTM_TEXTS
    quirks: Quirks = Quirks()
    rate_error: float = 0.0
    start_ms: float = 0.0
    turn_ns: float = 25e6
    motor_jitter_ns: float = 0.0
    stamp_step: int = 0
    reply_tick_ns: int = 0
    time_reply_ns: int = 0
    latency_ns: int = 1_000_000
    jitter_ns: float = 0.0
    spike_ratio: float = 0.0
    spike_ns: float = 20e6
    bursts: Bursts = ((1.0, 0),)
    turn_bytes: int = 0
    dark_ns: int = 0
    denied_ns: int = 0
    reboot_ns: int = 1_000_000_000
    wake_ns: int = 0
    usb: bool = False
    baud: str = "usb"
    speeds: bool = False
    sensitivities: bool = False
    drills: bool = True
    echoes: int = 1
    near_m: float = 0.1
    far_m: float = 30.0
    noise_near_m: float = 0.020
    noise_far_m: float = 0.030
    grazing_rad: float = 0.0
    dropout_ratio: float = 0.0
    clump_ratio: float = 0.0
    clump_least: int = 3
    clump_most: int = 30
    mixed_ratio: float = 0.0
    outlier_ratio: float = 0.0
    outlier_m: float = 0.5
    speck_ratio: float = 0.0
    speck_m: float = 2.0
    sun_ratio: float = 0.0
    sun_from_rad: float = 0.0
    sun_to_rad: float = 0.0
    window_ratio: float = 0.0
    window_from_rad: float = 0.0
    window_to_rad: float = 0.0


IDEAL = Profile()
# [LOG] One answer a turn, TM1 within 1 ms, the first byte 23.7 ms after the stamp. The only logged frame is ME of all
# beams: 6,717 bytes in two turns, in bursts of 2,402, 2,376 and 1,939 bytes that begin 0, 24.7 and 42.4 ms after its
# first byte. A frame of one turn gets the same shares in half the time [?]. dark_ns, grazing_rad [?].
UTM30LX = replace(
    IDEAL, name="utm-30lx", reply_tick_ns=25_000_000, time_reply_ns=950_000, latency_ns=4_950_000, jitter_ns=300_000.0,
    bursts=((2402 / 6717, 0), (2376 / 6717, 12_350_000), (1939 / 6717, 21_200_000)), turn_bytes=3_600,
    dark_ns=1_500_000_000, usb=True, grazing_rad=0.02,
)  # fmt: skip
# [SRC urg_stamped] period, %ST, TM quirks, boot; scans leave right after the sweep. The reply tick is like that of the
# logged UXM-30LX-E, one or two turns [LOG]. Durations of boot and waking, grazing_rad [?].
UTM30LX_EW = replace(
    IDEAL, name="utm-30lx-ew", texts=EW_TEXTS, turn_ns=25.05e6, reply_tick_ns=25_050_000, time_reply_ns=950_000,
    latency_ns=200_000, jitter_ns=100_000.0, dark_ns=1_000_000_000, denied_ns=3_000_000_000,
    wake_ns=500_000_000, baud="network", echoes=3, grazing_rad=0.02,
    quirks=Quirks(state_command=True, timing_answers=frozenset(("VV", "II")), time_anywhere=True, time_twice=True),
)  # fmt: skip
PROFILES = {profile.name: profile for profile in (IDEAL, UTM30LX, UTM30LX_EW)}


def stamp_to_first_byte_ns(profile: Profile) -> int:
    """Time from a scan's stamp to its first byte, without jitter: lidar.latency_ns of that sensor."""
    steps = 1080 - profile.stamp_step
    return round(profile.turn_ns / (1.0 + profile.rate_error) * steps / 1440) + profile.latency_ns
