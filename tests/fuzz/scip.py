"""`python -m tests.fuzz.scip [--seconds S] [--seed N]`: damage of any kind to the driver's input.

First a million single flipped bits in measurement frames, none of which may be accepted; then, until the time is over,
damaged streams against the oracle, and sessions that receive any bytes: no exception, no growth, and scans again when
the line is good.
"""

from __future__ import annotations

import argparse
import time

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from onboard.kernel_calls.scip import Blocks
from onboard.records import Chunk, PortState
from protocol import WireError, scip
from tests.onboard.lidar_rig import Rig
from tests.protocol.scip.test_scip_damage import (
    DAMAGE,
    FULL,
    scan_of,
    test_undamaged_scans_come_out_once_and_others_only_if_the_oracle_finds_every_check_satisfied,
)

FLIPS = 1_000_000
EXAMPLES = 200
LAW = test_undamaged_scans_come_out_once_and_others_only_if_the_oracle_finds_every_check_satisfied.hypothesis.inner_test
_reply = st.sampled_from((b"QT", b"VV", b"PP", b"II", b"MD0000108001000", b"BM")).flatmap(
    lambda echo: st.binary(max_size=60).map(lambda rest: b"\n\n" + echo + b"\n00P\n" + rest + b"\n\n")
)
_words = st.lists(_reply | st.binary(max_size=200) | st.just(b"x" * 70_000), max_size=12)


def flips(tries: int, start: int) -> int:
    """Return the number of accepted frames among those with one flipped bit: all bits of frame after frame."""
    at, taken, done, k = len(FULL.line()) + 11, 0, 0, start
    blocks, decoder = Blocks(at, FULL.values, 3), scip.ScanDecoder(FULL)
    while done < tries:
        frame, k = bytearray(scan_of(FULL, k)[:-2]), k + 1
        assert blocks(frame)
        for place in range(len(frame)):
            for bit in range(8):
                frame[place] ^= 1 << bit
                taken += blocks(frame) if place >= at else _decoded(decoder, bytes(frame))
                frame[place] ^= 1 << bit
        done += 8 * len(frame)
    return taken


def _decoded(decoder: scip.ScanDecoder, frame: bytes) -> bool:
    try:
        decoder.decode(frame)
    except WireError:
        return False
    return True


def survives(words: list[bytes]) -> None:
    """Feed any bytes to a streaming session; it must stream again."""
    rig = Rig()
    rig.session.stream(True)
    rig.run(20)
    for word in words:
        rig.scans += rig.session.receive([Chunk(rig.now_ns, word)], PortState.OPEN, rig.now_ns)
        rig.run(1)
    before = len(rig.scans)
    assert rig.run(400, lambda: len(rig.scans) > before + 3), rig.session.counts
    assert len(rig.session._splitter._buffer) == 2 * scip.FRAME_LIMIT


def hunt(examples: int, number: int) -> None:
    """Try `examples` examples of each law."""
    rules = settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=False,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )
    seed(number)(rules(given(DAMAGE, st.lists(st.integers(1, 3000), min_size=1, max_size=4))(LAW)))()
    seed(number)(settings(rules, max_examples=max(1, examples // 10))(given(_words)(survives)))()


def main() -> None:
    """Run flips, then rounds of examples until the time is over."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=120)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    began, rounds = time.monotonic(), 0
    taken = flips(FLIPS, asked.seed)
    print(f"{FLIPS} flipped bits, {taken} taken, {time.monotonic() - began:.0f} s")
    assert taken == 0
    while time.monotonic() - began < asked.seconds:
        rounds += 1
        hunt(EXAMPLES, 1000 * asked.seed + rounds)
    print(f"{rounds * EXAMPLES} damaged streams, {rounds * EXAMPLES // 10} sessions: no law was broken")


if __name__ == "__main__":
    main()
