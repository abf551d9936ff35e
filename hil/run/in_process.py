"""A scenario in one process: the bench's world and the flight program's own tick, joined by calls. For campaigns.

    frames, SCIP bytes, commands -> Inputs -> onboard.core.tick -> Outputs -> wheels, scanner, operator

No socket, thread or wall clock, and no file except a requested record. Devices, plant, faults and the flight program
are those of `hil run`; jobs run at the tick at which lock-step takes their results. The timing is that of Bench:
outputs of tick n act from n + 1 on. So the same scenario gives the same bytes as over sockets, if the commands arrive
in the same ticks (tests/hil/run/test_in_memory.py). There is no link emulator and no station: an Operator (operator.py)
sends the timed commands of the scenario's `script`; during `blackout_s` nothing passes in either direction.

    flight = InMemory(Scenario(terrain="flat")).run()
    flight.arrived, flight.distance_to_goal_m, flight.contacts
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hil.faults.disk_faults import DISK_FAULTS
from hil.faults.injection import Injector
from hil.plant.plant import STEP_NS, PlantAbortError
from hil.records import PlantState
from hil.scenarios.model import Scenario, fitting_of, flight_settings, goal_words, ground_of, script_of
from hil.terrain.field import Field
from hil.world.contacts import Contact
from hil.world.equipment import equipment
from hil.world.operator import Operator, TimedCommand, orders_of
from hil.world.truth import Truth
from hil.world.world import NS, World
from onboard.config import Config, load
from onboard.config import Rover as BuiltRover
from onboard.core.rover import Rover as Rover
from onboard.core.tick import tick
from onboard.drivers.platform.workers import Inline
from onboard.record.writer import Recorder
from onboard.records import (
    BusStatus,
    Chunk,
    Event,
    Frame,
    Health,
    Inputs,
    LinkMessage,
    Outputs,
    PortState,
    RecordStatus,
)
from onboard.records.status import Save, SaveResult
from protocol.conventions import TICK_NS
from protocol.link.transactions import Request, RequestState

Observe = Callable[[int, Inputs, Outputs, Rover, PlantState], None]
GOTO_S = 2.0
CAMPAIGN_STEP_NS = 5_000_000  # of the physics: half the work, see docs/campaigns.md


@dataclass(frozen=True, slots=True)
class Flight:
    """Result of a run.

    bench_s: bench time
    distance_to_goal_m: true distance at the end
    way_m: distance driven
    sweeps: number of sweeps
    contacts: all contacts
    events: all events
    requests: the commands and their outcomes
    faults: log of the injections
    streams: counts and hashes of each channel
    states_sha256: hash of the plant's states
    error: '' or why the plant ended the run
    equipment: see hil.world.equipment
    """

    bench_s: float
    distance_to_goal_m: float
    way_m: float
    sweeps: int
    contacts: tuple[Contact, ...]
    events: tuple[Event, ...]
    requests: tuple[Request, ...]
    faults: tuple[dict[str, object], ...]
    streams: dict[str, Any]
    states_sha256: str
    error: str
    equipment: dict[str, Any]

    @property
    def arrived(self) -> bool:
        """True if the rover reports every command completed, and one of them is goto."""
        done = all(request.state is RequestState.COMPLETED for request in self.requests)
        return done and any(request.telecommand.name == "goto" for request in self.requests)


class InMemory(World):
    """One scenario, ready to `run`; or call `step` and read world and `rover` between the ticks.

    orders: commands; default those of the scenario's script
    ground: field in place of the scenario's
    built: the rover as it really is (`hil.faults.build_errors`); default as in the flight program's configuration
    record: path of the flight program's record; default no record
    truth: path of the bench's truth.mcap; default no file
    Raises PlantAbortError if the rover cannot stand at the start. Call `free` if `run` is not used.
    """

    def __init__(
        self,
        scenario: Scenario,
        orders: Sequence[TimedCommand] | None = None,
        *,
        ground: Field | None = None,
        step_ns: int = STEP_NS,
        built: BuiltRover | None = None,
        record: Path | None = None,
        truth: Path | None = None,
    ) -> None:
        ground = ground or ground_of(scenario).field
        believed = load(None, flight_settings(scenario, ground.start)).rover
        super().__init__(ground, scenario.seed, built or believed, Truth(truth), step_ns, scenario.soil)
        config = load(None, flight_settings(scenario, self.start))
        self.fit(fitting_of(scenario, config.scanning.sector_rad))
        self.scenario = scenario
        self.rover: Rover | None = Rover(config, ground.gdem)
        orders = scripted(scenario, ground) if orders is None else orders
        self.operator = Operator(orders, scenario.seed, config.link.boot_count)
        self.events: list[Event] = []
        self._injector = Injector(scenario.faults)
        self._jobs = Inline()
        self.disk.keeps = record is not None
        needed = record or any(fault.fault in DISK_FAULTS for fault in scenario.faults)
        self._recorder = _recorder(config, self, record or Path("run.mcap")) if needed else None
        self._saves: tuple[Save, ...] = ()
        self.advance(TICK_NS)

    # -- one tick ----------------------------------------------------------------------------------------------------

    def step(self, observe: Observe | None = None) -> None:
        """Run one tick. observe(tick, inputs, outputs, rover, true state) is called before the outputs act."""
        self._injector.step(self, self, self.tick * TICK_NS)
        self.tick += 1
        now_ns = self.tick * TICK_NS
        outputs = self._think(now_ns, observe)
        self.advance(now_ns + TICK_NS)
        if outputs:
            self._act(outputs, now_ns)
        self.note(now_ns)

    def _think(self, now_ns: int, observe: Observe | None) -> Outputs | None:
        """Run the flight program's tick; None if it was killed or skips this tick."""
        if self.rover is None:
            self.unheard()
            return None
        if self.computer.leaves_out(self.tick):
            return None
        inputs = self._inputs(now_ns)
        outputs = tick(self.rover, inputs)
        self._jobs.start(outputs.jobs, outputs.cancelled)
        if self._recorder:
            self._recorder.write(inputs, outputs)
        self._saves = outputs.saves
        self.events += outputs.events
        if observe:
            observe(self.tick, inputs, outputs, self.rover, self.state)
        return outputs

    def _inputs(self, now_ns: int) -> Inputs:
        """Inputs of the tick; stamps are whole microseconds, as the barrier carries them."""
        pieces = self.lidar_says()
        return Inputs(
            self.tick,
            now_ns,
            can_frames=tuple(f if f.stamp_ns % 1000 == 0 else _whole_us(f) for f in self.frames()),
            can=self._can_status(),
            lidar_chunks=tuple(Chunk(at_ns // 1000 * 1000, data) for at_ns, data in pieces or ()),
            lidar_state=PortState.CLOSED if pieces is None else PortState.OPEN,
            link_messages=self._link_says(now_ns),
            jobs=self._jobs.take(self._jobs.due(self.tick - self.wires.jobs_late_ticks)),
            saved=self._kept(),
            health=Health(slipped_ticks=self.computer.left_out),
            machine=self.computer.says(self.tick),
            record=self._recorder.status if self._recorder else RecordStatus(),
        )

    def _link_says(self, now_ns: int) -> tuple[LinkMessage, ...]:
        return () if self._cut_off(now_ns) else self.operator.messages(now_ns)

    def _cut_off(self, now_ns: int) -> bool:
        edges_s = self.scenario.blackout_s
        return any(begin_s <= now_ns / NS < end_s for begin_s, end_s in zip(edges_s[::2], edges_s[1::2]))

    def _kept(self) -> tuple[SaveResult, ...]:
        """Report all saves of state as done; they are not stored."""
        saved, self._saves = tuple(SaveResult(save.name) for save in self._saves), ()
        return saved

    def _can_status(self) -> BusStatus:
        self.can_errors()
        return self.can.status

    def _act(self, outputs: Outputs, now_ns: int) -> None:
        stamp_ns = now_ns + TICK_NS
        if outputs.can_connect:
            self.can.hang_up()  # bytes that the computer sends while its port is closed are lost
        self.hear([Frame(f.can_id, f.data, stamp_ns) for f in outputs.can_frames], outputs.lidar_bytes, stamp_ns)
        if outputs.lidar_connect and not self.lidar_open and self.wires.lidar_plugged:
            self.plug_in()
        if outputs.can_connect:
            self.can.connect()
        if not self._cut_off(now_ns):
            self.operator.hear(outputs.link_payloads, now_ns)

    # -- the run -----------------------------------------------------------------------------------------------------

    @property
    def ended(self) -> bool:
        """True at the scenario's end time, else when each command's outcome is known; at the latest at its limit."""
        now_s = self.tick * TICK_NS / 1e9
        if self.scenario.end_s:
            return now_s >= self.scenario.end_s
        return self.operator.done or now_s >= self.scenario.limit_s

    def run(self, observe: Observe | None = None, *, settle_s: float = 0.0) -> Flight:
        """Run to the end and `settle_s` longer, then free the engine."""
        error = ""
        try:
            while not self.ended:
                self.step(observe)
            for _ in range(round(settle_s * NS / TICK_NS)):
                self.step(observe)
        except PlantAbortError as abort:
            error = str(abort)
        finally:
            self.free()
        p = self.progress
        return Flight(
            self.tick * TICK_NS / 1e9,
            p.distance_to_goal_m,
            p.way_m,
            p.sweeps,
            tuple(self.truth.contacts),
            tuple(self.events),
            self.operator.requests,
            tuple(self._injector.log),
            {name: stream.report() for name, stream in self.streams.items()},
            self.truth.sha256(),
            error,
            equipment(self),
        )

    def free(self) -> None:
        """Free the engine and close the record."""
        super().free()
        if self._recorder:
            self._recorder.close()

    # -- processes, for the injector ---------------------------------------------------------------------------------

    def kill(self, name: str) -> None:
        """Remove the flight program; there is no other process here. Raises ValueError for another name."""
        if name != "onboard":
            raise ValueError(f"in one process there is no {name!r} to kill, only 'onboard'")
        self.rover = None

    def lose(self, participant: str) -> None:
        """Nothing to do: `kill` has already removed the flight program."""


def scripted(scenario: Scenario, ground: Field) -> tuple[TimedCommand, ...]:
    """Timed commands of the scenario's script; its waits and file requests are ignored here."""
    return orders_of(script_of(scenario, ground))


def goto(ground: Field, at_s: float = GOTO_S) -> tuple[TimedCommand, ...]:
    """Command to drive to the field's goal."""
    x_m, y_m = (float(word) for word in goal_words(ground).values())
    return (TimedCommand(at_s, "goto", {"x_m": x_m, "y_m": y_m}),)


def _recorder(config: Config, bench: World, path: Path) -> Recorder:
    """Flight program's own recorder, on the bench's disk."""
    record, clock = replace(config.record, path=str(path)), replace(config.clock, mode="lockstep")
    return Recorder(replace(config, record=record, clock=clock), bench.field.gdem, opener=bench.disk.open)


def _whole_us(frame: Frame) -> Frame:
    return Frame(frame.can_id, frame.data, frame.stamp_ns // 1000 * 1000)
