"""Mutants of the rover: the monitor of one row of the fault table is dead, and the runs that judge the row are flown.

MONITORS["WHEEL_STALE"] = never  ->  scenario wheel_stale  ->  "answers WHEEL_STALE within 0.04 s by STOP" is red
"""

from __future__ import annotations

from collections.abc import Iterator

from hil.run.judged import Twins
from hil.run.judged import fly as fly_scenario
from hil.scenarios.library import find, scenarios
from hil.scenarios.model import load_scenario
from onboard.core.faults.monitors import MONITORS
from protocol.tables.faults import FAULTS
from tests.mutation.trials import Trial
from tests.scenarios.registry import CAMPAIGNS

LIMIT_S = 1200


def detectors() -> Iterator[Trial]:
    """For every row of the fault table each scenario that `detects` it, and each flight of a campaign that judges it.

    Raises LookupError for a row without any.
    """
    library = scenarios()
    for row in (fault.name for fault in FAULTS):
        flown = [scenario.name for scenario in library if row in scenario.expect.detects]
        seeds = [(of, seed) for of in CAMPAIGNS for seed in getattr(CAMPAIGNS[of], "DETECTS", {}).get(row, ())]
        if not flown and not seeds:
            raise LookupError(f"{row}: no scenario and no campaign judges this row")
        for name in flown:
            yield Trial(f"detector {row}: {name}", without_scenario, (row, name), LIMIT_S)
        for of, seed in seeds:
            yield Trial(f"detector {row}: {of} {seed}", without_campaign, (row, of, seed), LIMIT_S)


def without_scenario(row: str, name: str) -> str:
    """The broken promise of a scenario that names the row, flown without the row's monitor; "" where none is."""
    _disable(row)
    broken = [v.promise for v in fly_scenario(load_scenario(find(name)), Twins()).verdicts if not v.holds]
    return next((promise for promise in broken if row in promise), "")


def without_campaign(row: str, of: str, seed: int) -> str:
    """Verdict of a campaign's judge on one flight without the row's monitor; "" if it finds nothing."""
    _disable(row)
    campaign = CAMPAIGNS[of]
    return next((text for text in campaign.judge([campaign.fly(seed)]) if row in text), "")


def _disable(row: str) -> None:
    """In this process, which ends with its trial."""
    MONITORS[row] = lambda watched: False  # type: ignore[index]
