"""All wheel monitors: a tick of plain values in; the faults' names, the wheels' health and corrections out.

A finding about a wheel is latched: it goes into the health, and the wheel is not judged again until `forget`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from onboard.config import Rover
from onboard.core.faults.wheels.blocks import WheelBlocks
from onboard.core.faults.wheels.drive import drive_word, encoder_bad
from onboard.core.faults.wheels.offset import OffsetWatch
from onboard.core.faults.wheels.seen import WheelInputs, unheard
from onboard.core.faults.wheels.slip import SlipWatch
from onboard.core.faults.wheels.steering import SteerWatch
from onboard.motion.kinematics import wheel_places
from onboard.motion.wheel_health import SOUND, DriveHealth, WheelHealth, Wheels
from onboard.native.elementary import total
from onboard.records import WheelCommand, WheelState
from protocol.conventions import TICK_NS

WHEEL_ROWS = (
    "ENCODER_BAD", "WHEEL_STUCK", "WHEEL_FREE", "WHEEL_WEAK", "STEER_STUCK", "STEER_OFFSET", "SLIP_HIGH", "NOT_MOVING",
)  # fmt: skip
DRIVE_OF = {"WHEEL_STUCK": DriveHealth.STUCK, "WHEEL_FREE": DriveHealth.FREE, "WHEEL_WEAK": DriveHealth.FREE}
MOST_LEFT_OUT = 100  # ticks; after a longer pause the wheels' nodes have stopped the wheels


class WheelWatch:
    """Watch of all wheels; call `update` each tick. faults: name -> wheels (1 to 4); none if it concerns the rover."""

    def __init__(self, rover: Rover) -> None:
        places = wheel_places(rover)
        q_m2 = total(a * a + b * b for a, b in places)
        self.health: Wheels = SOUND
        self.slip = SlipWatch()
        self._seen: WheelInputs | None = None
        self._found: dict[str, tuple[int, ...]] = {}
        self._radius_m = rover.wheel_radius_m
        self._drives = [WheelBlocks() for _ in places]
        self._steers = [SteerWatch(rover.steer_rate_radps) for _ in places]
        self._offsets = [OffsetWatch(place, q_m2) for place in places]
        self._new_steer: Callable[[], SteerWatch] = lambda: SteerWatch(rover.steer_rate_radps)
        self._new_offset: Callable[[int], OffsetWatch] = lambda k: OffsetWatch(places[k], q_m2)
        self._last: list[WheelState | None] = [None] * len(places)

    @property
    def faults(self) -> dict[str, tuple[int, ...]]:
        """Faults that are active now."""
        rover = {"SLIP_HIGH": self.slip.high, "NOT_MOVING": self.slip.still}
        return {**self._found, **{name: () for name, holds in rover.items() if holds}}

    def update(self, seen: WheelInputs) -> None:
        """Process one tick, and before it the ticks left out since the last: the wheels turned on meanwhile."""
        before, self._seen = self._seen or seen, seen
        for _ in range(min((seen.now_ns - before.now_ns) // TICK_NS - 1, MOST_LEFT_OUT)):
            before = unheard(before)
            self._take(before)
        self._take(seen)

    def _take(self, seen: WheelInputs) -> None:
        self.slip.update(seen, strays=not self._pulls_aside())
        for k in range(len(self._drives)):
            self._drive(k, seen)
            self._steer(k, seen)
            self._last[k] = seen.wheels[k]

    def forget(self, name: str) -> None:
        """Drop the finding of this row: its wheels count as sound in it and are judged again."""
        for wheel in self._found.pop(name, ()):
            k = wheel - 1
            if name == "STEER_OFFSET":
                self._offsets[k] = self._new_offset(k)
            elif name == "STEER_STUCK":
                self._steers[k] = self._new_steer()
                self._set_health(k, replace(self.health[k], steer_fixed_rad=None))
            else:
                self._drives[k] = WheelBlocks()
                cured = {"encoder": True} if name == "ENCODER_BAD" else {"drive": DriveHealth.GOOD}
                self._set_health(k, replace(self.health[k], **cured))

    def readings(self, wheels: Sequence[WheelState | None]) -> tuple[WheelState | None, ...]:
        """Return the wheels' states with known wrong steering readings corrected."""
        return tuple(
            _less(state, offset.off_rad) if offset.verdict else state for state, offset in zip(wheels, self._offsets)
        )

    def steerings(self, wheels: Sequence[WheelState | None]) -> tuple[WheelState | None, ...]:
        """Return `readings` less the offsets of unknown cause: the angle at which each steering believes it is.

        A steering that has reached its believed angle must not stop the drives: only driving shows the cause.
        """
        return tuple(
            state if offset.verdict is False else _less(state, offset.off_rad)
            for state, offset in zip(wheels, self._offsets)
        )

    def orders(self, orders: Sequence[WheelCommand]) -> tuple[WheelCommand, ...]:
        """Return the orders with the angles corrected for steerings known to stand off."""
        return tuple(
            order._replace(steer_rad=order.steer_rad - offset.off_rad) if offset.verdict is False else order
            for order, offset in zip(orders, self._offsets)
        )

    def digest_items(self) -> tuple[float, ...]:
        """Values of this state that go into the state digest."""
        body = self.slip.body
        return (body.vx_mps, body.vy_mps, self.slip.shortfall, *(steer.off_rad for steer in self._steers))

    def _drive(self, k: int, seen: WheelInputs) -> None:
        watch, health = self._drives[k], self.health[k]
        closed = watch.update(seen.orders[k], seen.wheels[k], seen.currents_a[k])
        if not closed or health.drive is not DriveHealth.GOOD or not health.encoder:
            return
        others_a = self._others_a(k)
        if encoder_bad(watch.blocks, others_a):
            self._find("ENCODER_BAD", k, replace(health, encoder=False))
            return
        name = drive_word(watch.blocks, others_a)
        if name:
            self._find(name, k, replace(health, drive=DRIVE_OF[name]))

    def _steer(self, k: int, seen: WheelInputs) -> None:
        steer, offset, health = self._steers[k], self._offsets[k], self.health[k]
        steer.update(seen.orders[k], seen.wheels[k])
        if health.steer_fixed_rad is not None:
            return
        if steer.stuck_rad is not None:
            self._find("STEER_STUCK", k, replace(health, steer_fixed_rad=steer.stuck_rad))
            return
        state, last = seen.wheels[k], self._last[k]
        turned_rad = state.position_rad - last.position_rad if state and last else 0.0
        offset.update(steer.off_rad, turned_rad * self._radius_m, seen, k)
        if offset.verdict is not None:
            self._find("STEER_OFFSET", k, health)

    def _pulls_aside(self) -> bool:
        """Return whether a wheel is known to turn the rover, or its reading the odometry, instead of the ground."""
        return any(h.drive is DriveHealth.STUCK or h.steer_fixed_rad is not None for h in self.health) or any(
            offset.open for offset in self._offsets
        )

    def _others_a(self, k: int) -> float:
        """Mean absolute current of the other wheels in their newest block."""
        drawn = [
            abs(watch.blocks[-1].current_a or 0.0) for n, watch in enumerate(self._drives) if n != k and watch.blocks
        ]
        return total(drawn) / len(drawn) if drawn else 0.0

    def _find(self, name: str, k: int, health: WheelHealth) -> None:
        wheel = k + 1
        if wheel not in self._found.get(name, ()):
            self._found[name] = (*self._found.get(name, ()), wheel)
        self._set_health(k, health)

    def _set_health(self, k: int, health: WheelHealth) -> None:
        one, two, three, four = (health if n == k else old for n, old in enumerate(self.health))
        self.health = (one, two, three, four)


def _less(state: WheelState | None, off_rad: float) -> WheelState | None:
    """Return a wheel's state with the steering reading less its offset."""
    return state._replace(steer_rad=state.steer_rad - off_rad) if state and off_rad else state
