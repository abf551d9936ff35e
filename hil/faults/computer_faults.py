"""TABLE of the faults of the rover's own computer: fault -> begin and heal."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from hil.faults.node_faults import NodeFault
from hil.world.world import World
from onboard.records import Machine

USUAL = Machine(0.3, 0.2, 250e6, 2e9, 55.0, 20e9)
HOT_C = 97.0


def _set(**values: object) -> Callable[[World], None]:
    def change(world: World) -> None:
        for name, value in values.items():
            setattr(world.computer, name, value)

    return change


COMPUTER_FAULTS: Mapping[str, NodeFault] = {
    "computer_slow": NodeFault("the computer leaves out every tenth tick", _set(slow=True), _set(slow=False)),
    "computer_hangs": NodeFault("the computer runs no tick", _set(hangs=True), _set(hangs=False)),
    "computer_hot": NodeFault(
        f"the computer's processor is at {HOT_C:g} degrees Celsius",
        _set(machine=USUAL._replace(temperature_c=HOT_C)), _set(machine=USUAL),
    ),
}  # fmt: skip
