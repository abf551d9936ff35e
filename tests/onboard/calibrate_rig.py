"""The bench's world and `onboard calibrate`'s drive in one process, joined by calls as in `hil.run.in_process`."""

from hil.run.in_process import CAMPAIGN_STEP_NS
from hil.terrain.grounds import GROUNDS
from hil.world.truth import Truth
from hil.world.world import World
from onboard.bringup.calibrate.drive import CalibrationDrive
from onboard.bringup.can.moving.jog import Phase
from onboard.records import Chunk, Frame, Inputs, PortState
from protocol.conventions import TICK_NS

MOST_TICKS = 60_000


class Yard(World):
    """A rover as `built` on the bench's yard; `run` a drive of it."""

    def __init__(self, built, seed=1, soil="firm", terrain="yard"):
        super().__init__(GROUNDS[terrain](seed).field, seed, built, Truth(), CAMPAIGN_STEP_NS)
        for n in (1, 2, 3, 4):
            self.plant.set_soil(n, soil)
        self.advance(TICK_NS)

    def run(self, drive: CalibrationDrive, observe=None, recorder=None):
        """To its end; agreed to as soon as it is ready."""
        while drive.phase is not Phase.DONE:
            self.tick += 1
            assert self.tick < MOST_TICKS, "the drive does not come to an end"
            now_ns = self.tick * TICK_NS
            inputs = self.inputs(now_ns)
            outputs = drive.tick(inputs)
            if recorder:
                recorder.write(inputs, outputs)
            self.advance(now_ns + TICK_NS)
            stamp_ns = now_ns + TICK_NS
            self.hear([Frame(f.can_id, f.data, stamp_ns) for f in outputs.can_frames], outputs.lidar_bytes, stamp_ns)
            if outputs.lidar_connect and not self.lidar_open:
                self.plug_in()
            if drive.phase is Phase.READY:
                drive.go(now_ns)
            if observe:
                observe(self, drive)
        return drive

    def inputs(self, now_ns):
        """What the ports hold."""
        pieces = self.lidar_says()
        return Inputs(
            self.tick,
            now_ns,
            can_frames=tuple(self.frames()),
            can=self.can.status,
            lidar_chunks=tuple(Chunk(at_ns, data) for at_ns, data in pieces or ()),
            lidar_state=PortState.CLOSED if pieces is None else PortState.OPEN,
        )
