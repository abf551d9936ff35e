"""One fault of a scenario, with the time at which it begins and ends."""

from __future__ import annotations

from dataclasses import dataclass

from onboard.config import value

WHEN = ("time", "sweep", "drive")


@dataclass(frozen=True, slots=True)
class Injection:
    """One fault to inject; the fields' meanings are in their `value` texts.

    The fault begins `after_s` after `when` is first true and lasts `for_s`.
    """

    fault: str = value("", "row of hil.faults.injection.INJECTIONS")
    when: str = value("time", "start of the count: time, first sweep, first drive", one_of=WHEN)
    after_s: float = value(0.0, "seconds after that", low=0, high=1e6)
    for_s: float = value(1e9, "how long", low=0, high=1e9)
    target: int = value(0, "wheel, node, CAN id or percent, as the fault needs", low=0, high=0x7FF)
