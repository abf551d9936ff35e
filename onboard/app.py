"""Composition root: configuration -> ports -> core -> the loop. The only file on board that uses all parts.

Over 300 lines: the two kinds of ports differ in what a tick may wait for, and are best read together with the loop.
"""

from __future__ import annotations

import gc
import json
import signal
from collections.abc import Iterable
from concurrent.futures import Future
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from onboard.config import Config, ConfigError
from onboard.core.jobs import JOBS
from onboard.core.rover import Rover
from onboard.core.schedule import Group
from onboard.core.tick import darken, farewell, tick
from onboard.drivers.can.bus import CanPort
from onboard.drivers.lidar.byte_listener import LidarEar
from onboard.drivers.lidar.port import LidarPort, open_port
from onboard.drivers.link.port import LinkPort, endpoint_of, link_keys
from onboard.drivers.link.saved_state import LinkMemory
from onboard.drivers.platform.clock import LockStepClock, WallClock
from onboard.drivers.platform.load import Probe, folders_written
from onboard.drivers.platform.memory import return_large
from onboard.drivers.platform.stopwatch import NullStopwatch, Stopwatch
from onboard.drivers.platform.workers import Workers
from onboard.drivers.storage.folder_lock import FolderLock
from onboard.drivers.storage.map_tiles import FolderContent, Keeper, load
from onboard.drivers.storage.state_folder import StateFolder, count_boot, read_kept
from onboard.journal import Announce, Level, to_journal
from onboard.maps.gdem_file import GdemError, read_gdem
from onboard.record.writer import Recorder
from onboard.records import BusStatus, Chunk, Frame, Gdem, Health, Inputs, LinkMessage, Machine, Outputs, PortState
from onboard.records.status import BUS_CLOSED, EPOCH, HALTS
from onboard.spare_time import SpareTime, TickRecorder
from onboard.status.report import rhythm
from protocol.barrier import Channel, Tick

if TYPE_CHECKING:
    from onboard.perception.map.stop_map import StopMap

WAIT_S = 60.0  # wall-clock limit for bytes that the bench says are on their way
EX_AGAIN = 75  # ended by the operator's reboot; the supervisor starts it again
DARK_TICKS = 50  # after the end, for the LIDAR to say that its laser is off
# no first tick needs these, and they load longest
LATER = ("onboard.perception.pose.ekf:ExtendedKalmanFilter", *(job.function for job in JOBS.values()))


class WallPorts:
    """Ports on the wall clock: a tick takes what has arrived. CAN stamps are the kernel's, LIDAR stamps LidarEar's."""

    def __init__(self, can: CanPort, lidar: LidarPort, link: LinkPort, clock: WallClock, probe: Probe) -> None:
        self.can, self.lidar, self.link, self._clock, self._probe = can, lidar, link, clock, probe
        self.ear = LidarEar(lidar, clock.now_ns)
        self.watch = Stopwatch()

    def forget(self) -> None:
        """Drop the frames that came while the program opened: seconds of them in the first tick look like babble."""
        self.can.forget()

    def read(self, now: Tick) -> Inputs:
        """Return the inputs of this tick: what the ports have now."""
        stamp_ns = self._clock.now_ns()
        return Inputs(
            now.number,
            now.now_ns,
            can_frames=not_later(self.can.read(stamp_ns), now.now_ns),
            can=self.can.status,
            lidar_chunks=self.ear.take(),
            lidar_state=self.lidar.state,
            link_messages=self.link.read(stamp_ns),
            link_state=self.link.state,
            health=Health(self.watch.tick_ns, self._clock.slipped_ticks),
            machine=self._probe.take(),
        )

    def look(self) -> None:
        """Read the load figures of the computer once a second, outside the tick."""
        self._probe.look(self._clock.now_ns())

    def write(self, outputs: Outputs) -> None:
        """Send the outputs; never blocks."""
        if outputs.lidar_connect:
            self.lidar.connect()
        if outputs.can_connect:
            self.can.connect()
        self.can.write(outputs.can_frames)
        self.lidar.write(outputs.lidar_bytes)
        self.link.write(outputs.link_payloads)


def not_later(frames: Iterable[Frame], now_ns: int) -> tuple[Frame, ...]:
    """Limit the stamps to the tick's time: a tick that began late also reads frames that came after its time.

    The lateness itself is a separate input (Timing.late_ns), with faults of its own.
    """
    return tuple(frame if frame.stamp_ns <= now_ns else frame._replace(stamp_ns=now_ns) for frame in frames)


class LockStepPorts:
    """Ports in lock-step: a tick takes exactly the number of pieces that the barrier announces."""

    def __init__(self, can: CanPort, lidar: LidarPort, link: LinkPort) -> None:
        self.can, self.lidar, self.link = can, lidar, link
        self.watch = NullStopwatch()
        self._tick = self._left_out = 0
        if can.state is not PortState.OPEN:
            raise OSError(can.status.error)

    def read(self, now: Tick) -> Inputs:
        """Return the inputs of this tick; blocks until each channel has its count."""
        channels = {channel.name: channel for channel in now.channels}
        lidar_state, chunks = self._read_lidar(channels.get("lidar"))
        self._tick, self._left_out = now.number, self._left_out + now.number - self._tick - 1
        return Inputs(
            now.number,
            now.now_ns,
            can_frames=self._read_can(channels.get("can")),
            can=self._can_status(channels.get("can")),
            lidar_chunks=chunks,
            lidar_state=lidar_state,
            link_messages=self._read_link(channels.get("link")),
            link_state=_state(channels.get("link")),
            health=Health(slipped_ticks=self._left_out),
            machine=Machine(*now.machine) if now.machine else None,
        )

    def look(self) -> None:
        """Do nothing: this machine's load is not part of the run; the bench may give the rover's figures."""

    def _read_can(self, channel: Channel | None) -> tuple[Frame, ...]:
        """Read frames. The bench serves an attempt to open before it counts the next tick: its result is final here."""
        state = self.can.wait_open(WAIT_S)
        if _state(channel) is not PortState.OPEN:
            self.can.close()
        elif state is not PortState.OPEN:
            raise ConnectionError(f"CAN: the bench says open, the port is not: {self.can.status.error}")
        if channel is None or not channel.stamps_us:
            return ()
        return tuple(self.can.read_upto(channel.count, channel.stamps_us, WAIT_S))

    def _can_status(self, channel: Channel | None) -> BusStatus:
        """While the bench reports closed, without an attempt's error text: it names a port that other runs lack."""
        status = self.can.status
        return status if _state(channel) is PortState.OPEN else status._replace(error=BUS_CLOSED)

    def _read_link(self, channel: Channel | None) -> tuple[LinkMessage, ...]:
        if channel is None or not channel.stamps_us:
            return ()
        return self.link.read_upto(channel.count, channel.stamps_us, WAIT_S)

    def _read_lidar(self, channel: Channel | None) -> tuple[PortState, tuple[Chunk, ...]]:
        state = _state(channel)
        if channel is None or not channel.stamps_us:
            if state is not PortState.OPEN:
                self.lidar.close()
            return state, ()
        if self.lidar.wait_open(WAIT_S) is not PortState.OPEN:
            raise ConnectionError(f"{self.lidar.address}: the bench says open, the port is not")
        data, at, chunks = self.lidar.read_exactly(channel.count, WAIT_S), 0, []
        for size, stamp_us in zip(channel.stamps_us[::2], channel.stamps_us[1::2]):
            chunks.append(Chunk(stamp_us * 1000, data[at : at + size]))
            at += size
        return state, tuple(chunks)

    def write(self, outputs: Outputs) -> None:
        """Send the outputs; all of them are sent before the barrier gets the counts."""
        if outputs.lidar_connect:
            self.lidar.connect()
            self.lidar.wait_open(WAIT_S)
        if outputs.can_connect:
            self.can.connect()
            if not self.can.served:  # the bench may send as soon as the tick is done
                self.can.wait_open(WAIT_S)
        self.can.write(outputs.can_frames)
        self.lidar.write(outputs.lidar_bytes)
        self.link.write(outputs.link_payloads)

    def sent(self) -> dict[str, int]:
        """Cumulative number of pieces sent per channel, for the barrier."""
        return {"can": self.can.sent, "lidar": self.lidar.sent, "link": self.link.sent}


def run(config: Config, announce: Announce) -> int:
    """Run the flight program; return the exit code when the bench ends the run or a signal requests a stop.

    announce: gets one line when all ports are open and the ticks begin, and one for each unusable part of a saved map.
    Raises NoMapError; JobError if a job has failed: by then the rover stands and the record is closed; OSError if a
    port or the state folder cannot be opened.
    """
    with FolderLock(config.state.folder) as lock:
        if lock.trouble:
            announce(lock.trouble, Level.WARNING)
        return _fly(config, announce)


def _fly(config: Config, announce: Announce) -> int:
    """Run the flight program, with the state folder locked."""
    return_large()
    config = _counted(config, announce)
    gdem = load_gdem(config.mission.gdem, config.mission.gdem_needed, announce)
    kept = load_tiles(config)
    for line in kept.dropped:
        announce(f"dropped: {line}", Level.WARNING)
    memory, state = recall_map(config, kept), load_state(config)
    with ExitStack() as stack:
        lockstep = config.clock.mode == "lockstep"
        clock = LockStepClock(config.clock.barrier) if lockstep else WallClock()
        stack.callback(clock.close)
        can = CanPort(config.can.uri, filtered=not lockstep)  # lock-step counts every frame
        stack.callback(can.close)
        lidar = open_port(config.lidar.address)
        stack.callback(lidar.close)
        keys, told = link_keys(config), config.link
        forgets_not = LinkMemory(config.state.folder if told.command_keys else "", keys, wait=lockstep)
        port = LinkPort(endpoint_of(config), keys, told.boot_count, forgets_not, told.rate_bps)
        link = stack.enter_context(port)
        workers = Workers(wait=lockstep)
        stack.callback(workers.close)
        state[EPOCH], state[HALTS] = b"%d" % forgets_not.epoch, json.dumps(forgets_not.halted).encode()
        recorder = stack.enter_context(Recorder(config, gdem, kept.tiles, state))
        workers.own[JOBS["product_record"].function] = (recorder.paths,)
        keeper = Keeper(config.mapping.folder, memory, partial(announce, level=Level.WARNING), wait=lockstep)
        stack.callback(keeper.close)
        folder = StateFolder(config.state.folder, wait=lockstep)
        stack.callback(folder.close)
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: setattr(clock, "stopping", True))
        if isinstance(clock, LockStepClock):
            ports: LockStepPorts | WallPorts = LockStepPorts(can, lidar, link)
            link.wait_open(WAIT_S)
        else:
            folders = str(Path(config.record.path).parent) if config.record.path else "", config.mapping.folder
            ports = WallPorts(can, lidar, link, clock, Probe(folders_written((*folders, config.state.folder))))
            clock.idle = ports.ear.listen
            workers.preload(LATER).result()  # loading during the ticks would make them late
        rover = Rover(config, gdem, memory, state)
        books = TickRecorder(rover, lidar, recorder, keeper, announce, journal=to_journal())
        spare = SpareTime(config, rover, clock, recorder, announce)
        stack.callback(spare.close)

        gc.freeze()  # start-up objects stay: collecting them again would cost ticks of 30 ms
        gc.enable()
        alarm = spare.go(workers, announce)
        if isinstance(ports, WallPorts):
            ports.ear.alarm = alarm
            ports.forget()
        clock.start()
        where = f"{config.can.uri}, {config.lidar.address}, {config.link.endpoint}"
        announce(f"running: {config.clock.mode} clock, {where}", Level.NOTICE)
        rebooting = loop(rover, ports, clock, (workers, folder), (books, spare))
        recorder.end(rover.executive.memory, rhythm(rover, spare.grants))
    return EX_AGAIN if rebooting else 0


def loop(
    rover: Rover,
    ports: LockStepPorts | WallPorts,
    clock: LockStepClock | WallClock,
    work: tuple[Workers, StateFolder],
    beside: tuple[TickRecorder, SpareTime],
) -> bool:
    """Run ticks until the clock ends the run; then stop the wheels and the LIDAR.

    They stop too if a job or the core has failed. Returns whether the operator ended the run for a restart.
    work: workers outside the tick, whose results are inputs. beside: the store of each tick's inputs and outputs, and
    the user of the time left after a tick.
    """
    try:
        return _ticks(rover, ports, clock, work, beside)
    finally:
        beside[1].stopping()
        _farewell(rover, ports, clock)


def _ticks(
    rover: Rover,
    ports: LockStepPorts | WallPorts,
    clock: LockStepClock | WallClock,
    work: tuple[Workers, StateFolder],
    beside: tuple[TickRecorder, SpareTime],
) -> bool:
    """Run the ticks of `loop`.

    In lock-step the modules in LATER load during the ticks from the first one on: bench time stops while a tick waits
    for one, so the loading changes no result. On the wall clock they are loaded already.
    """
    (workers, folder), (books, spare) = work, beside
    watch = ports.watch
    loading: Future[None] | None = None
    rebooting = False
    while not rebooting and (now := clock.wait()) is not None:
        watch.begin()
        saved = (*folder.collect(), *ports.link.collect(), *books.keeper.collect())
        inputs = replace(ports.read(now), jobs=workers.collect(now.number), saved=saved)
        inputs = replace(inputs, timing=watch.timing(clock.late_ns, workers.took_ns), record=books.recorder.status)
        outputs = tick(rover, inputs, watch.mark)
        watch.mark(Group.WRITE)
        ports.write(outputs)
        workers.start(outputs.jobs, outputs.cancelled)
        folder.start([save for save in outputs.saves if save.name != EPOCH])
        ports.link.start(outputs.saves)
        connect = [name for name, wanted in (("lidar", outputs.lidar_connect), ("can", outputs.can_connect)) if wanted]
        clock.done(now, ports.sent() if isinstance(ports, LockStepPorts) else {}, connect)
        loading = loading or workers.preload(LATER)
        watch.mark(Group.RECORD)
        books.keep(inputs, outputs)
        watch.end()
        ports.look()
        spare.use()
        rebooting = outputs.reboot
    return rebooting


def _farewell(rover: Rover, ports: LockStepPorts | WallPorts, clock: LockStepClock | WallClock) -> None:
    """Stop the wheels and switch the laser off."""
    ports.write(farewell(rover, clock.now_ns()))
    for now in clock.overtime(DARK_TICKS) if isinstance(clock, WallClock) else ():
        asked = darken(rover, ports.read(now))  # a USB sensor goes on streaming without its client
        if asked is None:
            break
        ports.write(asked)


def _counted(config: Config, announce: Announce) -> Config:
    """Configuration with the number of this start: one more than the last one's, if there is a folder."""
    number, trouble = count_boot(config.state.folder, config.link.boot_count)
    if trouble:
        announce(trouble, Level.ERROR)
    return replace(config, link=replace(config.link, boot_count=number))


class NoMapError(RuntimeError):
    """The orbiter's map that the configuration needs is missing or damaged; the text is one line for people."""

    def __init__(self, text: str, damaged: bool) -> None:
        super().__init__(text)
        self.damaged = damaged


def load_gdem(path: str, needed: bool = True, announce: Announce | None = None) -> Gdem | None:
    """Load the orbiter's map named in the configuration; None if none is named, or it is unusable and not needed.

    announce: gets one line if the rover flies without it. Raises NoMapError.
    """
    if not path:
        return None
    try:
        return read_gdem(Path(path))
    except (OSError, GdemError) as error:
        why = f"mission.gdem = {path!r}: {getattr(error, 'strerror', None) or error}"
        if needed:
            advice = "make it again (`onboard gdem import`), or set mission.gdem_needed = false to fly without"
            raise NoMapError(f"{why}; {advice}", isinstance(error, GdemError)) from error
        if announce:
            announce(f"{why}; flies without, as on unknown ground (mission.gdem_needed = false)", Level.ERROR)
        return None


def load_tiles(config: Config) -> FolderContent:
    """Load the tiles in mapping.folder; none if no folder is named or it does not exist. Raises ConfigError."""
    folder = config.mapping.folder
    try:
        return load(Path(folder), config.mapping.cell_m) if folder else FolderContent()
    except FileNotFoundError:
        return FolderContent()
    except OSError as error:
        raise ConfigError(f"mapping.folder = {folder!r} cannot be read: {error.strerror}") from error


def load_state(config: Config) -> dict[str, bytes]:
    """Load the saved state in state.folder. Raises ConfigError."""
    try:
        return read_kept(config.state.folder)
    except OSError as error:
        raise ConfigError(f"state.folder = {config.state.folder!r} cannot be read: {error.strerror}") from error


def recall_map(config: Config, kept: FolderContent) -> StopMap | None:
    """Build the map from saved tiles; None if there are none. Raises ConfigError."""
    if not kept.files:
        return None
    from onboard.perception.map.stop_map import recall  # heavy because of the registration; most starts have no map

    try:
        return recall(kept.tiles)
    except ValueError as error:
        raise ConfigError(f"mapping.folder = {config.mapping.folder!r}: {error}") from error


def _state(channel: Channel | None) -> PortState:
    return PortState(channel.state) if channel else PortState.OPEN
