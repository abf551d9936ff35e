"""`python -m tests.fuzz.lidar [--seconds S] [--seed N]`: any bytes as requests to the emulated scanner.

For any bytes, cut in any way: no exception, the same answer as to the bytes one by one, one reply a line with the
line's own beginning as echo and a correct sum, and no more memory than a line and the limit of the queue.
"""

from __future__ import annotations

import argparse
import dataclasses
import time

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from hil.devices.lidar.commands import COMMANDS, REQUEST_LIMIT
from hil.devices.lidar.faults import KINDS, ScheduledFault
from hil.devices.lidar.profile import IDEAL, UTM30LX, UTM30LX_EW, Profile
from hil.devices.lidar.sensor import QUEUE_LIMIT, Lidar
from protocol import scip

MS = 1_000_000
EXAMPLES = 200
DRAIN_MS = 200  # after the last request: longer than any frame's bursts
FULL = dataclasses.replace(IDEAL, name="full", speeds=True, sensitivities=True)
NO_TICK = tuple(dataclasses.replace(p, reply_tick_ns=0, time_reply_ns=0) for p in (IDEAL, UTM30LX, UTM30LX_EW, FULL))

_digits = st.text("0123456789", max_size=14)
_usual = st.sampled_from(
    ("", "0", "1", "2", "00", "03", "10", "115200", "0000108001", "0000108001000", "0100020003205")
)
_string = st.sampled_from(("", ";a", ";0123456789abcdef", ";0123456789abcdefg", ";-", ";;", ";\xe9"))
_request = st.builds(lambda code, rest, tail: (code + rest + tail).encode(), st.sampled_from(sorted(COMMANDS)),
                     _digits | _usual, _string)  # fmt: skip
_line = _request | st.binary(max_size=40) | st.binary(min_size=60, max_size=70) | st.just(b"V" * 5000)
_end = st.sampled_from((b"\n", b"\r", b"\r\n", b""))
talks = st.lists(st.tuples(_line, _end, st.integers(0, 60)), max_size=30)  # a line, its end, ms until it comes


def sensor_of(profile: Profile, *faults: ScheduledFault) -> Lidar:
    """Return a connected sensor 5 m from everything."""
    made = Lidar(1, lambda times_ns: np.full(len(times_ns), 5.0), profile, faults)
    made.connect()
    return made


def answers(profile: Profile, talk: list[tuple[bytes, bytes, int]], whole: bool) -> tuple[list[bytes], bytes]:
    """Return the lines that should be answered, and all output."""
    sensor, sent, now_ms, out = sensor_of(profile), b"", 0, b""
    for line, end, wait_ms in talk:
        now_ms += wait_ms
        data = line + end
        for part in (data,) if whole else (data[k : k + 1] for k in range(len(data))):
            sensor.receive(part, now_ms * MS)
        sensor.step(now_ms * MS)
        out += b"".join(piece for _, piece in sensor.send())
        sent += data
        assert len(sensor._input) <= REQUEST_LIMIT + 1
    sensor.step((now_ms + DRAIN_MS) * MS)
    out += b"".join(piece for _, piece in sensor.send())
    *lines, _ = sent.replace(b"\r", b"\n").split(b"\n")
    return [line for line in lines if line], out


def check_talk(profile: Profile, talk: list[tuple[bytes, bytes, int]]) -> None:
    """Check one conversation, in one piece a line and byte by byte."""
    lines, out = answers(profile, talk, True)
    assert answers(profile, talk, False)[1] == out
    *frames, begun = out.split(b"\n\n")
    assert begun == b"" or begun[:1] in (b"M", b"N")  # of a stream the end may still be on its way, in bursts
    replies = []
    for frame in frames:
        answer = scip.parse_reply(frame)
        if answer.status not in ("99", "0M"):
            replies.append(answer.echo)
    expected = [line[:REQUEST_LIMIT] for line in lines]
    streams = [echo for echo in expected if echo[:2] in (b"GD", b"GS", b"GE", b"HD", b"HE")]
    rebooted = b"RB" in [echo[:2] for echo in expected]
    if not rebooted and not streams and not any(echo[:2] == b"DB" for echo in expected):
        assert replies == expected


def check_faults(talk: list[tuple[bytes, bytes, int]], kinds: list[str]) -> None:
    """Check the same with faults of the cable and the sensor: no exception, a bounded queue."""
    sensor, now_ms = sensor_of(UTM30LX_EW, *(ScheduledFault(kind, 0.05 * k) for k, kind in enumerate(kinds))), 0
    for line, end, wait_ms in talk:
        now_ms += wait_ms
        sensor.receive(line + end, now_ms * MS)
        sensor.step(now_ms * MS)
        sensor.pieces()
        assert sensor._queued == sum(len(piece.data) for piece in sensor._output) <= QUEUE_LIMIT + 20_000


profiles_and_talks = given(st.sampled_from(NO_TICK), talks)
faults_and_talks = given(talks, st.lists(st.sampled_from(sorted(KINDS)), unique=True, max_size=6))


def main() -> int:
    """Run until the seconds are over, 200 examples at a time of each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    calm = settings(
        max_examples=EXAMPLES,
        deadline=None,
        database=None,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )
    end_s, rounds = time.monotonic() + options.seconds, 0
    while rounds == 0 or time.monotonic() < end_s:
        for wrapped, check in ((profiles_and_talks, check_talk), (faults_and_talks, check_faults)):
            seed(options.seed * 1_000_003 + rounds)(calm(wrapped(check)))()
        rounds += 1
    print(f"{2 * EXAMPLES * rounds} conversations with the emulated scanner, nothing found")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
