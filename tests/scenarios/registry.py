"""TABLE of the campaigns: many scenarios with physics, each in one process, and the promises that each is judged by.

To add one, two files:

  1. tests/scenarios/NAME.py with the attributes of `Campaign`; its first docstring line is its title. See nominal.py:
     `fly` makes a Scenario, flies it by InMemory and returns a frozen dataclass of figures, `judge` returns the broken
     promises.
  2. here, its row.

`fly` of one seed takes about 20 s of one core; a campaign of several kinds of case numbers them by its seeds. To
observe a flight, tick by tick:

    def observe(tick, inputs, outputs, rover, state):   # inputs, outputs, the core itself, the truth
        error_m = math.dist(outputs.pose[:2], state.position_m[:2])

    InMemory(Scenario(seed=seed), step_ns=CAMPAIGN_STEP_NS).run(observe)

If docs/campaigns.md includes a campaign's figures, its module has `summary(rows)`: lines in the order of its HEADS, or
of flown.HEADS if it has none. They are printed under the rows, and `--docs` writes them into the page.

Faults are a scenario's (`faults=(Injection("wheel_silent", when="drive", after_s=5.0, target=2),)`); a condition
without an injection is set on the bench before the run (`bench.plant.set_soil(1, "soft")`), or between two steps of a
loop of the campaign's own (`while not bench.ended: bench.step(observe)`, then `bench.free()`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from tests.scenarios import calibrate, guard, library, nominal, wheels
from tests.scenarios.goals import fresh, losses, three_goals
from tests.scenarios.hostile import chaos
from tests.scenarios.pose import localisation


class Campaign(Protocol):
    """Attributes of a campaign's module. Row: a frozen dataclass of plain values with a field `seed`."""

    __doc__: str | None
    SEEDS: tuple[int, ...]  # the whole campaign
    SHORT: tuple[int, ...]  # enough for CI

    @staticmethod
    def fly(seed: int) -> Any:
        """Return one flight's row; the same seed gives the same row."""

    @staticmethod
    def judge(rows: Sequence[Any]) -> list[str]:
        """Return the broken promises of these rows, one sentence each."""


RENEWED = 4  # flights of a worker process before a new one replaces it: each flight leaves memory in use
CAMPAIGNS: Mapping[str, Campaign] = {
    "library": library,
    "guard": guard,
    "nominal": nominal,
    "localisation": localisation,
    "wheels": wheels,
    "calibrate": calibrate,
    "losses": losses,
    "three-goals": three_goals,
    "fresh": fresh,
    "chaos": chaos,
}


@dataclass(frozen=True, slots=True)
class Asked:
    """A campaign and its seeds."""

    name: str
    seeds: tuple[int, ...]


def fly_one(asked: Asked, seed: int) -> tuple[str, Any]:
    """Run in a worker: return the campaign's name and the seed's row."""
    return asked.name, CAMPAIGNS[asked.name].fly(seed)
