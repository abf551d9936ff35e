"""State machine of the sensor: states, and changes by power, time, failures and the vendor's fault drill (DB).

                    BM                  MD ...
power-on -> BOOTING -> STANDBY <-> SINGLE <-> MULTI      QT, RS, RT, the last scan: back to STANDBY, laser off
                         ^  |  TM0, TM2
                 QT      |  +<--------> TIMING
SLEEP -> WAKING ---------+
FAULT from any state; only RB, power, DB10 or the end of the injected fault leave it
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from hil.devices.lidar.profile import Profile
from hil.devices.lidar.turns import Counter, Turns
from protocol import scip


class SensorState(Enum):
    """State of the sensor. The value is the reply to %ST; its first digit becomes 1 while the sensor is unstable."""

    STANDBY = "000"
    BOOTING = "001"
    TIMING = "002"
    SINGLE = "003"
    MULTI = "004"
    SLEEP = "005"
    WAKING = "006"
    FAULT = "900"


@dataclass(slots=True)
class Task:
    """Requested scans.

    asked: the request
    echo: its echo
    from_ns: only turns that begin at or after this time count
    left: remaining scans of a counted stream
    skipped: turns skipped since the last scan
    """

    asked: scip.ScanRequest
    echo: bytes
    from_ns: float
    left: int
    skipped: int


# DB03..05: (turns of the stream since DB, status sent then); nothing is sent between "21" and the next row.
DRILLS: Mapping[str, tuple[tuple[int, str], ...]] = {
    "01": (), "02": (), "03": ((10, "21"), (20, "98")), "04": ((10, "21"), (20, "50")), "05": ((20, "50"),),
}  # fmt: skip


class Machine:
    """State, tasks and counter of one sensor. Commands (lidar_commands) and faults (lidar_faults) change it."""

    def __init__(self, profile: Profile, turns: Turns) -> None:
        self.profile, self.turns, self.counter = profile, turns, Counter(profile)
        self.now_ns = 0
        self.state = SensorState.STANDBY
        self.unstable = False
        self.refusal = ""  # status of the reply to every command, as in a firmware update
        self.stream: Task | None = None
        self.shots: list[Task] = []
        self.laser_ns = 0  # time at which the laser was switched on
        self.boots = 0
        self.drill = ""
        self.quits = 0  # QT received during this stream
        self.mode_ns, self.mode_before = 0, SensorState.STANDBY  # state that II reports until then
        self.speed_step, self.sensitive, self.baud = 0, False, "115200"
        self.reboot_asked_ns, self._reboot_at_ns = -(1 << 62), -1
        self._dark_until_ns = self._ready_ns = 0
        self._drill_turns = 0

    @property
    def laser_on(self) -> bool:
        """True while the sensor measures."""
        return self.state in (SensorState.SINGLE, SensorState.MULTI)

    @property
    def reachable(self) -> bool:
        """True if there is a link; False in the first moments after power-on."""
        return self.now_ns >= self._dark_until_ns

    @property
    def report(self) -> str:
        """Reply to %ST."""
        steady = (
            self.state in (SensorState.BOOTING, SensorState.SLEEP, SensorState.WAKING, SensorState.FAULT)
            or not self.unstable
        )
        return self.state.value if steady else "1" + self.state.value[1:]

    def due_ns(self) -> int | None:
        """Time of the next change by itself; None if there is none."""
        times = [t for t in (self._reboot_at_ns, self._ready_ns, self._dark_until_ns) if t > self.now_ns]
        return min(times, default=None)

    def settle(self, now_ns: int) -> None:
        """Advance the time."""
        self.now_ns = max(self.now_ns, now_ns)
        if 0 <= self._reboot_at_ns <= self.now_ns:
            self.power_on()
        if self.state in (SensorState.BOOTING, SensorState.WAKING) and self.now_ns >= self._ready_ns:
            self.state = SensorState.STANDBY

    def light(self, state: SensorState) -> None:
        """Switch the laser on: to SINGLE or MULTI."""
        if not self.laser_on:
            self.laser_ns = self.now_ns
        self.state = state

    def stop(self) -> None:
        """Switch stream and laser off; BOOTING, FAULT and SLEEP stay."""
        self.stream, self.shots, self.quits = None, [], 0
        if self.state in (SensorState.SINGLE, SensorState.MULTI, SensorState.TIMING):
            self.state = SensorState.STANDBY

    def power_on(self) -> None:
        """Power off and on: the timer at zero, everything else at its default."""
        self.stop()
        self.boots += 1
        self.counter.reset(self.now_ns)
        self.to_default_speed()
        self.unstable, self.refusal, self.drill, self.sensitive = False, "", "", False
        self.reboot_asked_ns, self._reboot_at_ns = -(1 << 62), -1
        self._dark_until_ns = self.now_ns + self.profile.dark_ns
        self._ready_ns = self._dark_until_ns + self.profile.denied_ns
        self.state = SensorState.BOOTING if self._ready_ns > self.now_ns else SensorState.STANDBY

    def power_on_soon(self) -> None:
        """Reboot after reboot_ns, as after the second RB."""
        self.stop()
        self._reboot_at_ns = self.now_ns + self.profile.reboot_ns

    def to_default_speed(self) -> None:
        """Restore default speed and baud rate, as RS and power-on do."""
        if self.speed_step:
            self.turns.slow_down(0, self.now_ns)
        self.speed_step, self.baud = 0, "115200"

    def wake(self) -> None:
        """Wake up, as QT in sleep does."""
        self._ready_ns = self.now_ns + self.profile.wake_ns
        self.state = SensorState.WAKING if self.profile.wake_ns else SensorState.STANDBY

    def recover(self) -> None:
        """Leave FAULT."""
        self.drill = ""
        if self.state is SensorState.FAULT:
            self.state = SensorState.STANDBY

    def start_drill(self, code: str) -> None:
        """Start a fault drill, DB01 to DB05."""
        self.drill, self._drill_turns = code, 0

    def scan_status(self) -> str:
        """Status of the stream's next scan: "99", another for a scan without data, "" to send nothing."""
        if self.state is SensorState.FAULT:
            return "50"
        rows = DRILLS.get(self.drill, ())
        self._drill_turns += 1
        begun = [status for turn, status in rows if self._drill_turns >= turn]
        if begun and self._drill_turns in (turn for turn, _ in rows):
            return begun[-1]
        if begun and begun[-1] == "21":
            return ""
        return "0M" if self.unstable else "99"
