"""Passive decoder of a sensor's recorded bytes: of a lidar record, of a run's record, of a hokuyoaist log.

A hokuyoaist log is a pair NAME.logr (from the sensor) and NAME.logw (to it): pieces of bytes, each after 12 bytes of
header in network order: seconds and microseconds since the start of the log, and the number of bytes that follow.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from onboard.bringup.lidar.again import rows_of
from onboard.config import Lidar
from onboard.devices.lidar.clock import ClockQuality
from onboard.devices.lidar.model import UTM_30LX, model_of
from onboard.devices.lidar.session import BAD
from onboard.devices.lidar.stream import ScanStream
from onboard.devices.lidar.watch import CAUSES
from onboard.records import Chunk, Scan
from protocol import WireError, scip

_HEADER = struct.Struct(">III")
_LONGEST_REPLY = 24  # bytes without text or data: a longer frame that echoes a measuring command is a scan


class Listener:
    """Decoder from chunks to scans, with the same counts and info as the session."""

    def __init__(self, config: Lidar) -> None:
        self.counts: dict[str, int] = dict.fromkeys(
            ("scans", "replies", "repeated_stamp", "clock_jump", "clock_reboot", *CAUSES, *BAD), 0
        )
        self.info: dict[str, str] = {}
        self._config = config
        self._model = UTM_30LX
        self._splitter = scip.Splitter()
        self._asked: scip.ScanRequest | None = None
        self._stream: ScanStream | None = None

    @property
    def quality(self) -> ClockQuality:
        """Quality of the sensor's clock estimate."""
        return self._stream.clock.quality if self._stream is not None else ClockQuality()

    def receive(self, chunk: Chunk) -> list[Scan]:
        """The scans that became complete; damaged frames are counted by kind."""
        scans: list[Scan] = []
        for first_ns, frame in self._splitter.frames(*chunk):
            try:
                scan = self._take(first_ns, frame)
            except WireError as error:
                self.counts[error.kind] += 1
            else:
                scans += [] if scan is None else [scan]
        self.counts["overflow"] = self._splitter.overflows
        return scans

    def _take(self, rx_ns: int, frame: memoryview) -> Scan | None:
        echo = bytes(frame[:40]).partition(b"\n")[0]
        request = scip.parse_request(echo)
        if len(frame) > _LONGEST_REPLY and request.code in scip.MEASURING:
            asked = scip.parse_scan_request(request, self._model.last_step)
            if isinstance(asked, str):
                raise WireError("echo", f"{echo!r}")
            return self._streaming(asked).take(frame, rx_ns)[1]
        answer = scip.parse_reply(bytes(frame))
        self.counts["replies"] += 1
        if request.code == "QT" and self._stream is not None and not self._stream.silent(rx_ns, 0):
            self._stream.watch.pause()  # QT amid scans; after a silence a driver starts with QT
        if request.code in ("VV", "PP", "II") and answer.status == "00":
            self.info |= scip.parse_text(answer)
            if request.code == "PP":
                self._model, self._asked = model_of(self.info), None
        return None

    def _streaming(self, asked: scip.ScanRequest) -> ScanStream:
        """The decoder of this request; a request other than the last one gets a new decoder."""
        alike = asked._replace(scans=0)  # in a countdown each echo differs
        if self._stream is None or alike != self._asked:
            config = replace(
                self._config,
                command=asked.code,
                first_step=asked.first,
                last_step=asked.last,
                cluster=max(1, asked.cluster),
                skip=asked.skip,
                scans=99 if asked.scans else 0,
                wide_intensity=True,
            )
            self._asked, self._stream = alike, ScanStream(config, self.counts)
            self._stream.learn(self._model, usb=False)
            self._splitter.echo = self._stream.request.line()[:13]
        return self._stream


def chunks_of(path: Path) -> Iterator[Chunk]:
    """Bytes from the sensor with their arrival times. Raises DamagedRecordError, FileNotFoundError, ValueError."""
    if path.suffix in (".logr", ".logw"):
        yield from log_of(path.with_suffix(".logr").read_bytes())
        return
    for _, inputs, _ in rows_of(path):
        yield from inputs.lidar_chunks


def log_of(data: bytes) -> Iterator[Chunk]:
    """The pieces of one file of a hokuyoaist pair. Raises ValueError if it ends inside a piece."""
    at = 0
    while at < len(data):
        if at + _HEADER.size > len(data):
            raise ValueError(f"byte {at}: the log ends inside a header")
        seconds, micros, size = _HEADER.unpack_from(data, at)
        at += _HEADER.size
        if at + size > len(data):
            raise ValueError(f"byte {at}: the log ends inside a piece of {size} bytes")
        yield Chunk(seconds * 1_000_000_000 + micros * 1000, data[at : at + size])
        at += size
