"""How emulated scanners differ: strings, times of sensor and link. The numbers are from logs of real sensors."""

from __future__ import annotations

from dataclasses import dataclass

Bursts = tuple[tuple[float, int], ...]

VERSION = (
    ("VEND", "Hokuyo Automatic Co.,Ltd."), ("PROD", "SOKUIKI Sensor TOP-URG UTM-30LX"),
    ("FIRM", "P.1.05(17/Apr./2009)"), ("PROT", "SCIP 2.0"), ("SERI", "00903971"),
)  # fmt: skip
PARAMETERS = (
    ("MODL", "UTM-30LX(Hokuyo Automatic Co.,Ltd.)"), ("DMIN", "23"), ("DMAX", "60000"), ("ARES", "1440"), ("AMIN", "0"),
    ("AMAX", "1080"), ("AFRT", "540"), ("SCAN", "2400"),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Profile:
    """How a sensor and its link behave in time. Ratios of 1; times in ns of bench time.

    reply_tick_ns: replies leave at the next multiple of it (0: at once). latency_ns: from the end of the sweep to the
    first byte of its scan; jitter_ns: sigma of a half-normal added to it; spike_ratio of the scans wait spike_ns more
    (mean, exponential). bursts: (share of the frame's bytes, time after its first byte). usb: the stream outlives its
    client.
    """

    rate_error: float = 0.0
    start_ms: float = 0.0
    turn_ns: float = 25e6
    reply_tick_ns: int = 0
    time_reply_ns: int = 0
    latency_ns: int = 1_000_000
    jitter_ns: float = 0.0
    spike_ratio: float = 0.0
    spike_ns: float = 0.0
    bursts: Bursts = ((1.0, 0),)
    usb: bool = False
    near_m: float = 0.1
    far_m: float = 30.0
    noise_near_m: float = 0.020
    noise_far_m: float = 0.030
    dropout_ratio: float = 0.0


IDEAL = Profile()
# From the logs: one answer a turn, TM1 within 1 ms, the first byte 23.7 ms after the stamp, a frame in three bursts
# (the logged pauses are those of a frame of two turns; here they are scaled so that a frame fits its turn).
UTM30LX = Profile(
    reply_tick_ns=25_000_000, time_reply_ns=950_000, latency_ns=4_950_000, jitter_ns=300_000.0,
    bursts=((0.36, 0), (0.35, 9_400_000), (0.29, 15_800_000)), usb=True,
)  # fmt: skip
PROFILES = {"ideal": IDEAL, "utm30lx": UTM30LX}
