"""Bus, scanner and record of a tool that commands the hardware itself: opened together, closed together."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from onboard.bringup.calibrate.shell import CalibrationShell
from onboard.command_line import EX_CANTCREAT, EX_CONFIG, EX_IOERR, EX_UNAVAILABLE, fail
from onboard.config import Config, ConfigError
from onboard.drivers.can.bus import CanPort
from onboard.drivers.lidar.port import open_port
from onboard.record.incomplete import unwritten
from onboard.record.writer import Recorder


@contextmanager
def ports(config: Config) -> Iterator[CalibrationShell]:
    """Bus, scanner and record, open while the `with` lasts. An error of one becomes one line and an exit code."""
    from onboard.drivers.platform.clock import WallClock  # imported at each call: tests replace it by their own clock

    clock = WallClock()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: setattr(clock, "stopping", True))
    with ExitStack() as stack:
        try:
            can = CanPort(config.can.uri)
            stack.callback(can.close)
            lidar = open_port(config.lidar.address)
            stack.callback(lidar.close)
        except ConfigError as error:
            raise fail(EX_CONFIG, str(error)) from None
        except OSError as error:
            raise fail(EX_UNAVAILABLE, str(error)) from None
        if can.status.error:
            raise fail(EX_UNAVAILABLE, f"{config.can.uri}: {can.status.error}")
        recorder = stack.enter_context(Recorder(config, None))
        if problem := unwritten(recorder):
            raise fail(EX_CANTCREAT, f"{config.record.path} cannot be written: {problem}")
        clock.start()
        yield CalibrationShell(can, lidar, clock, recorder)
    if problem := unwritten(recorder):  # known only after it is closed
        raise fail(EX_IOERR, f"{config.record.path} is not whole: {problem}; the wheels are off")
