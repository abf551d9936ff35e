"""CAN bus of the bench between the nodes and the computer's controller, with the faults of a scenario.

    nodes -- to_computer --> foreign, twin, babble, lose, corrupt, future --> computer
    nodes <-- to_nodes ----------------------------------------------------- computer

Nothing passes either way while it is unplugged or bus-off.

An error frame goes to the computer alone. `status` is the report of a controller's driver.
"""

from __future__ import annotations

from hil.own_functions import generator
from onboard.records import BusStatus, BusTrouble, Frame, PortState
from onboard.records.status import BUS_CLOSED, BUS_WORDS
from protocol.conventions import TICK_NS
from protocol.generated.can_codec import DBC_VERSION, TABLE

BABBLE_PER_TICK = 10  # 1000 frames a second
TWIN_LAG = 7  # offset of the second node's alive counter
ERROR_FRAMES = {  # kind -> SocketCAN's error class, byte 1 of the data
    BusTrouble.BUS_OFF: (0x40, 0x00), BusTrouble.RESTARTED: (0x100, 0x00), BusTrouble.PASSIVE: (0x04, 0x30),
    BusTrouble.ACTIVE: (0x04, 0x40), BusTrouble.BUS_ERROR: (0x88, 0x00),
}  # fmt: skip
_HEARTBEAT = "NODE_HEARTBEAT_"


class CanWire:
    """Wire of one run. Faults change these attributes:

    corrupt_ratio: share of the frames with a wrong bit
    lost_ratio: share of the frames that are lost
    babble_id: CAN id that is sent all the time, or None
    foreign: name of the node with another DBC version, or ''
    twin: name of the node that is doubled, or ''
    ahead_ns: time by which the stamps are in the future
    """

    def __init__(self, seed: int) -> None:
        self._rng = generator([seed, 0xB5])
        self.plugged, self.connected, self.bus_off = True, True, False
        self.corrupt_ratio, self.lost_ratio, self.ahead_ns = 0.0, 0.0, 0
        self.babble_id: int | None = None
        self.foreign = self.twin = ""
        self._errors: list[BusTrouble] = []
        self._told = [0] * len(BusTrouble)
        self._word, self._openings, self._refused = "", 1, 0
        self._newest: dict[int, bytes] = {}

    def error(self, kind: BusTrouble) -> None:
        """Let the controller report this error with the next tick's frames."""
        self._errors.append(kind)
        if kind in (BusTrouble.BUS_OFF, BusTrouble.RESTARTED):
            self.bus_off = kind is BusTrouble.BUS_OFF

    def to_computer(self, frames: list[Frame], now_ns: int) -> list[Frame]:
        """Frames of the nodes as the computer receives them."""
        if not self.connected or self.bus_off:
            return []
        if self.foreign:
            frames = [self._translated(frame) for frame in frames]
        self._newest.update((can_id, data) for can_id, data, _ in frames)
        if self.twin:
            frames = frames + [self._of_twin(frame) for frame in frames if self.twin == _sender(frame)]
        frames = sorted([*frames, *self._babble(now_ns)], key=_by_arrival)
        if self.lost_ratio:
            frames = [frame for frame, hit in self._draw(frames, self.lost_ratio) if not hit]
        if self.corrupt_ratio:
            frames = [self._corrupted(frame) if hit else frame for frame, hit in self._draw(frames, self.corrupt_ratio)]
        return [Frame(f.can_id, f.data, f.stamp_ns + self.ahead_ns) for f in frames] if self.ahead_ns else frames

    def to_nodes(self, frames: list[Frame]) -> list[Frame]:
        """Frames of the computer as the nodes receive them."""
        if not self.connected:
            self._refused += len(frames)
        return frames if self.connected and not self.bus_off else []

    def errors(self) -> list[BusTrouble]:
        """Error frames since the last call; those at an unplugged computer are lost."""
        errors, self._errors = self._errors, []
        if not self.connected:
            return []
        for kind in errors:
            self._told[kind] += 1
            self._word = BUS_WORDS.get(kind, "")
        return errors

    def unplug(self) -> None:
        """Close the computer's port from now on; plug() allows it to be opened again."""
        self.plugged = self.connected = False

    def hang_up(self) -> None:
        """Close the port, free to be opened: unplug() and plug() at once."""
        self.connected = False

    def plug(self) -> None:
        """Let the next attempt to open the port succeed."""
        self.plugged = True

    def connect(self) -> None:
        """Try to open the computer's port again."""
        self._openings += 1
        self.connected, self._word = self.plugged, ""

    @property
    def status(self) -> BusStatus:
        """Bus status after the newest errors(); for a computer without sockets."""
        state = PortState.CLOSED if not self.connected else PortState.ERROR if self.bus_off else PortState.OPEN
        word = self._word if self.connected else BUS_CLOSED
        return BusStatus(state, word, self._refused, self._openings, tuple(self._told))

    def _translated(self, frame: Frame) -> Frame:
        """Frame with another DBC version, if it is a heartbeat of the foreign node."""
        row = TABLE[frame.can_id]
        if row.name == _HEARTBEAT + self.foreign:
            values = row.decode(frame.data)._replace(dbc_version=DBC_VERSION + 1 & 0xFF)
            return Frame(frame.can_id, row.encode(*values, frame.data[6] >> 4), frame.stamp_ns)
        return frame

    def _of_twin(self, frame: Frame) -> Frame:
        """Same content from a second node, with another alive counter."""
        row = TABLE[frame.can_id]
        counter = (frame.data[6] >> 4) + TWIN_LAG & 15
        return Frame(frame.can_id, row.encode(*row.decode(frame.data), counter), frame.stamp_ns)

    def _babble(self, now_ns: int) -> list[Frame]:
        """Newest frame of an id, or zeros, BABBLE_PER_TICK times in the tick before now."""
        if self.babble_id is None:
            return []
        data, step_ns = self._newest.get(self.babble_id, bytes(8)), TICK_NS // BABBLE_PER_TICK
        return [Frame(self.babble_id, data, now_ns - k * step_ns) for k in range(BABBLE_PER_TICK)]

    def _draw(self, frames: list[Frame], ratio: float) -> list[tuple[Frame, bool]]:
        return list(zip(frames, (self._rng.random(len(frames)) < ratio).tolist(), strict=True))

    def _corrupted(self, frame: Frame) -> Frame:
        bit = 1 << int(self._rng.integers(64))
        data = (int.from_bytes(frame.data, "little") ^ bit).to_bytes(8, "little")
        return Frame(frame.can_id, data, frame.stamp_ns)


def _by_arrival(frame: Frame) -> tuple[int, int]:
    return frame.stamp_ns, frame.can_id


def _sender(frame: Frame) -> str:
    return TABLE[frame.can_id].sender
