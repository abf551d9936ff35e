"""Talking to an emulated scanner in tests: requests in, bytes, statuses, frames and stamps out."""

import dataclasses

import numpy as np

from hil.devices.lidar.profile import IDEAL, UTM30LX_EW
from hil.devices.lidar.sensor import Lidar
from protocol import scip

MS = 1_000_000
FULL = dataclasses.replace(IDEAL, speeds=True, sensitivities=True)
EW = dataclasses.replace(UTM30LX_EW, reply_tick_ns=0, time_reply_ns=0, jitter_ns=0.0)


def sensor(profile=IDEAL, *faults, seed=7):
    made = Lidar(seed, lambda times_ns: np.full(len(times_ns), 5.0), profile, faults)
    made.connect()
    return made


def talk(device, *lines, at_ms=0):
    """What the sensor says to requests that come together."""
    device.receive(b"".join(line + b"\n" for line in lines), at_ms * MS)
    device.step(at_ms * MS)
    return b"".join(data for _, data in device.send())


def statuses(device, *lines, at_ms=0):
    """Status of each reply, its sum checked."""
    frames = talk(device, *lines, at_ms=at_ms).split(b"\n\n")[:-1]
    return [scip.parse_reply(frame).status for frame in frames]


def frames(device, until_ms):
    device.step(until_ms * MS)
    return b"".join(data for _, data in device.send()).split(b"\n\n")[:-1]


def stamps(device, until_ms):
    found = [frame.split(b"\n") for frame in frames(device, until_ms)]
    return [scip.parse_stamp(lines[2]) for lines in found if lines[1] == b"99b"]
