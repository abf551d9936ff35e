"""Monitors of the battery: POWER_LOW and BROWN_OUT, from the power node's status every 0.2 s.

A finding needs two status frames in a row, so one disturbed frame stops nothing. It ends with the first status that is
clear of the limit by a margin. A low battery stays low, and the rover goes to SAFE. A brown-out may be caused by the
load itself: the drives rest until the voltage is back, and only repeated or lasting brown-outs lead to SAFE.
"""

from __future__ import annotations

from onboard.config import Safety
from onboard.core.faults.retry_limit import Spells
from onboard.records import PowerState

POWER_ROWS = ("POWER_LOW", "BROWN_OUT")
WORDS_NEEDED = 2
CLEAR_V, CLEAR_RATIO = 0.5, 0.02
BROWN_OUTS, WITHIN_NS, LONGEST_NS = 3, 600_000_000_000, 5_000_000_000


class PowerWatch:
    """Watch of the battery; call `update` each tick.

    found: row -> measured values, in words.
    used_up: rows whose retry limit is used up.
    """

    def __init__(self) -> None:
        self.found: dict[str, str] = {}
        self._in_a_row = dict.fromkeys(POWER_ROWS, 0)
        self._told_ns = -1
        self._brown_outs = Spells(BROWN_OUTS, WITHIN_NS, LONGEST_NS)

    @property
    def used_up(self) -> frozenset[str]:
        """BROWN_OUT if its retry limit is used up."""
        return frozenset({"BROWN_OUT"} if self._brown_outs.used_up else ())

    def update(self, power: PowerState | None, now_ns: int, safety: Safety) -> None:
        """Process one tick; a status that was judged before changes nothing."""
        if power is not None and now_ns - power.age_ns != self._told_ns:
            self._told_ns = now_ns - power.age_ns
            self._judge(power, safety)
        self._brown_outs.note("BROWN_OUT" in self.found, now_ns)

    def forget(self, name: str) -> None:
        """Drop the finding of a row and reset its retry limit."""
        if name in POWER_ROWS:
            self.found.pop(name, None)
            self._in_a_row[name] = 0
        if name == "BROWN_OUT":
            self._brown_outs = Spells(BROWN_OUTS, WITHIN_NS, LONGEST_NS)

    def _judge(self, power: PowerState, safety: Safety) -> None:
        text = f"{power.voltage_v:.1f} V, {100 * power.charge_ratio:.0f} % of the charge"
        margin_v, margin_ratio = (CLEAR_V, CLEAR_RATIO) if "POWER_LOW" in self.found else (0.0, 0.0)
        low = power.voltage_v < safety.power_low_v + margin_v
        self._note("POWER_LOW", low or power.charge_ratio < safety.power_low_ratio + margin_ratio, text)
        margin_v = CLEAR_V if "BROWN_OUT" in self.found else 0.0
        self._note("BROWN_OUT", power.brown_out or power.voltage_v < safety.brown_out_v + margin_v, text)

    def _note(self, name: str, holds: bool, text: str) -> None:
        self._in_a_row[name] = self._in_a_row[name] + 1 if holds else 0
        if not holds:
            self.found.pop(name, None)
        elif self._in_a_row[name] >= WORDS_NEEDED:
            self.found[name] = text

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        return (self._told_ns, *self._in_a_row.values(), len(self.found), *self._brown_outs.digest_items())
