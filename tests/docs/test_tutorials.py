"""The tutorials do what they say: each block of code is taken from its page and used."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest

from hil.faults.injection import causes
from hil.scenarios.model import load_scenario
from hil.scenarios.verdicts import Expect
from onboard.config import ConfigError, Planning
from onboard.planning.local.contract import Problem
from onboard.planning.local.path import is_free
from onboard.planning.local.poses import Freedom
from onboard.records import Grid
from protocol.tables.telemetry import BY_ID, BY_NAME, TABLE, Item
from tools.make_docs import DOCS

GRID = Grid(0.05, 0.05, 0.1, 60, 50)


def block(page, language):
    return re.search(rf"```{language}\n(.*?)```", (DOCS / page).read_text(), re.DOTALL)[1]


@pytest.fixture(scope="module")
def planner():
    names = {"__name__": "breadth_first"}
    exec(compile(block("tutorial-planner.md", "python"), "tutorial-planner.md", "exec"), names)
    return names["BreadthFirstPlanner"]()


def problem(open_to=35):
    freedom = np.full((8, 60, 50), Freedom.FREE, dtype=np.uint8)
    freedom[:, 25:30, :open_to] = Freedom.BLOCKED
    goals = np.zeros(freedom.shape, dtype=bool)
    goals[:, 50, 40] = True
    return Problem(freedom, GRID, (0.55, 0.55, 0.3), goals, Planning())


def test_the_tutorials_planner_keeps_the_contract(planner):
    asked = problem()
    plan, again = planner.plan(asked), planner.plan(asked)
    assert math.dist(plan.path.stations[-1, :2], GRID.centre(50, 40)) < 1e-6
    assert is_free(plan.path.stations, asked.freedom, GRID)
    assert plan.path.length_m <= plan.cost_m + 0.2
    assert np.array_equal(plan.path.stations, again.path.stations)


def test_the_tutorials_planner_reports_what_it_cannot_reach(planner):
    plan = planner.plan(problem(open_to=50))
    assert plan.path is None and plan.cost_m == math.inf and plan.reason


def test_the_tutorials_scenario_is_read_and_its_misspelt_fault_is_named(tmp_path):
    path = tmp_path / "jammed.toml"
    path.write_text(block("tutorial-scenario.md", "toml"))
    read = load_scenario(path)
    assert read.expect.raises == ("WHEEL_STUCK",) and read.faults[0].target == 2
    path.write_text(path.read_text().replace('fault = "wheel_stuck"', 'fault = "wheel_stack"'))
    with pytest.raises(ConfigError, match="did you mean `wheel_stuck`"):
        causes(load_scenario(path).faults)


def test_the_tutorial_lists_every_key_of_expect():
    rows = [line for line in (DOCS / "tutorial-scenario.md").read_text().splitlines() if line.startswith("| `")]
    listed = {key for row in rows for key in re.findall(r"`(\w+)`", row.split("|")[1])}
    assert listed == set(Expect.__dataclass_fields__)


def test_the_tutorials_telemetry_item_is_a_row_with_a_number_that_no_row_has():
    text = (DOCS / "tutorial-telemetry.md").read_text()
    item = eval(block("tutorial-telemetry.md", "python"), {"Item": Item})
    assert item.id not in BY_ID and item.name not in BY_NAME and len(item) == len(TABLE[0])
    name, source = re.search(r'"(\w+)": (lambda v: v\.\w+),', text).groups()
    assert name == item.name and eval(source)(SimpleNamespace(**{item.name: 3})) == 3
