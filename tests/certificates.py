"""Demos on pretended processors: `python -m tests.certificates [--seed N ...] [--row NAME ...]`.

Each seed is flown by `hil demo` under each row of tests/pretended.py; the certificates have to be the same bytes, and
each record has to replay in a plain environment. Into build/certificates. Minutes each: the nightly run flies three
seeds under three rows, the fast suite a short mission under one (tests/onboard/native/test_portable_replay.py).
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from tests.pretended import OLDEST, ROWS, environment

ALL = {"plain": {}, **ROWS, "oldest": OLDEST}
FLOWN = ("plain", "numpy without AVX-512", "oldest")
FOLDER = Path("build/certificates")


def fly(seed: int, name: str) -> bytes:
    """The certificate of a demo under a row. Raises RuntimeError where the demo failed."""
    folder = FOLDER / f"seed-{seed}-{name.replace(' ', '-')}"
    words = [sys.executable, "-W", "ignore", "-m", "hil", "demo", "--seed", str(seed), "--out", str(folder)]
    done = subprocess.run(words, env=environment(ALL[name]), capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"seed {seed}, {name}: exit code {done.returncode}\n{(done.stdout + done.stderr)[-2000:]}")
    return (folder / "certificate.json").read_bytes()


def replays(seed: int, name: str) -> str:
    """What `onboard replay` says of the record of that demo, without any of the rows' variables."""
    record = FOLDER / f"seed-{seed}-{name.replace(' ', '-')}" / "onboard.mcap"
    words = [sys.executable, "-m", "onboard", "replay", str(record)]
    done = subprocess.run(words, env=environment({}), capture_output=True, text=True, check=False)
    return done.stdout.split(":")[0] or done.stderr.strip()


def main() -> int:
    """Exit code 1 where a certificate differs from that of the first row, or a record does not replay."""
    parser = argparse.ArgumentParser(prog="python -m tests.certificates", description=__doc__)
    parser.add_argument("--seed", type=int, action="append", help="default 1, 2, 3")
    parser.add_argument("--row", choices=ALL, action="append", help=f"default {', '.join(FLOWN)}")
    options = parser.parse_args()
    failed = 0
    for seed in options.seed or (1, 2, 3):
        first = b""
        for name in options.row or FLOWN:
            made = fly(seed, name)
            first = first or made
            verdict, same = replays(seed, name), made == first
            failed += not same or verdict != "identical"
            print(f"seed {seed}, {name}: {'the same' if same else 'ANOTHER'} certificate, replay {verdict}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
