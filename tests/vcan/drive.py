"""The short drive over one bus: python -m tests.vcan.drive BUS FOLDER [PYTHON], as `hil run` but without its replay.

The replay is left to where the processor is not emulated. PYTHON runs the flight program in place of this one.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

from hil.run import lockstep
from hil.run.demo import certificate
from hil.run.run import run
from hil.scenarios.model import load_scenario
from hil.world.world import Progress

SCENARIO = Path(__file__).parent / "short_drive.toml"
SHOWN_S = 1.0


class Shown:
    """A line each second of bench time."""

    def __init__(self) -> None:
        self._next_s = 0.0

    def __call__(self, progress: Progress, wall_s: float) -> None:
        if progress.now_s >= self._next_s:
            self._next_s = progress.now_s + SHOWN_S
            print(f"drive: bench time {progress.now_s:.1f} s after {wall_s:.0f} s", flush=True)


def main() -> int:
    """Exit codes: 0 driven to the scenario's end, 1 not, and why."""
    can, folder, onboard_python = sys.argv[1], Path(sys.argv[2]), "".join(sys.argv[3:4])
    lockstep.ANSWER_LIMIT_S = 600.0  # on an emulated processor a tick that loads a library may take minutes
    scenario = replace(load_scenario(SCENARIO), can=can)
    result = run(scenario, folder, Shown(), onboard_python=onboard_python)
    (folder / "certificate.json").write_text(json.dumps(certificate(scenario, result), indent=2))
    print(f"drive: {can}: {result.bench_s:.1f} s of bench time in {result.wall_s:.0f} s {result.error}", flush=True)
    return 1 if result.error else 0


if __name__ == "__main__":
    sys.exit(main())
