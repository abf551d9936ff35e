"""Planted regressions: functions that fly a case of the gate with one defect in the flight program.

PLANTS has them by name. To add one: a function here; its docstring says what is wrong. `python -m tests.gate --plant
NAME` flies the gate with it, and must end red.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any
from unittest import mock

from hil.campaign.case import fly
from hil.campaign.plan import Plan, plan_of
from onboard.core import tick
from onboard.motion.kinematics import WheelCommands
from onboard.perception.map import stop_map
from onboard.perception.pose.registration import RegistrationResult, refused
from onboard.records import F64

STEP_M = 0.12


def step_limit(plan: Plan, number: int) -> dict[str, Any]:
    """A wheel may meet steps of 0.12 m."""
    return fly(_with(plan, "planning", "step_m", STEP_M), number)


def guard_off(plan: Plan, number: int) -> dict[str, Any]:
    """The drive guard is off."""
    return fly(_with(plan, "drive_guard", "on", False), number)


def wheel_sign(plan: Plan, number: int) -> dict[str, Any]:
    """Wheel 1 turns backwards."""
    sound = tick.wheel_commands

    def turned(*args: Any) -> tuple[WheelCommands, bool]:
        orders, held = sound(*args)
        first = orders[0]._replace(rate_radps=-orders[0].rate_radps)
        return (first, *orders[1:]), held

    with mock.patch.object(tick, "wheel_commands", turned):
        return fly(plan, number)


def registration_off(plan: Plan, number: int) -> dict[str, Any]:
    """No scan is registered to the map."""
    with mock.patch.object(stop_map, "register", _not_registered):
        return fly(plan, number)


def no_return_lowers(plan: Plan, number: int) -> dict[str, Any]:
    """A beam without return lowers the bound of the ground that it passed."""
    with mock.patch.object(stop_map, "cloud", partial(stop_map.cloud, lost=True)):
        return fly(plan, number)


PLANTS: Mapping[str, Callable[[Plan, int], dict[str, Any]]] = {
    each.__name__: each for each in (step_limit, guard_off, wheel_sign, registration_off, no_return_lowers)
}


def _with(plan: Plan, table: str, key: str, item: object) -> Plan:
    """The plan with a setting of the flight program."""
    settings = dict(plan.tree.get("set", {}))
    settings[table] = {**settings.get(table, {}), key: item}
    return plan_of({**plan.tree, "set": settings}, plan.where)


def _not_registered(_source: object, _target: object, guess: F64, _config: object) -> RegistrationResult:
    return refused(guess, "planted")
