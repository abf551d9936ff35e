"""Row tick-jitter: `onboard jitter` in a child process, with the real-time options that this machine grants."""

from __future__ import annotations

import json
import subprocess
import sys
from statistics import median
from typing import Any

from tests.bench.goals import Measured

SECONDS = 12  # for each repeat
P50_LIMIT, P999_LIMIT = 2.5, 3.0


def judged(runs: list[dict[str, Any]]) -> Measured:
    """Return the medians over the runs, each against its reference in the same seconds.

    Without FIFO a loaded machine decides the tail, so only p50 counts then.
    """
    options = {row["option"]: row["granted"] for row in runs[0]["real_time"]}
    fifo = options["fifo_priority"]
    ours, theirs = (
        {name: median(late[name] for late in rows) for name in ("p50", "p999")}
        for rows in ([r["late_us"] for r in runs], [r["reference"]["late_us"] for r in runs])
    )
    ratios = {name: median(r["late_us"][name] / r["reference"]["late_us"][name] for r in runs) for name in ours}
    ratio = max(ratios["p50"] / P50_LIMIT, ratios["p999"] / P999_LIMIT if fifo else 0.0)
    kind = runs[0]["reference"]["kind"]
    note = (
        f"p50 {ratios['p50']:.2f}, p99.9 {ratios['p999']:.2f} times {kind}; ours {_words(ours)}, "
        f"it {_words(theirs)}; "
        + ("both FIFO" if fifo else "FIFO is not allowed here: both without, p50 alone is judged")
        + ("" if kind == "cyclictest" else "; cyclictest is not installed, the bare loop in C++ stands for it")
    )
    return Measured(ratio, ours["p50"] / 1e6, theirs["p50"] / 1e6, kind, note)


def tick_jitter(repeats: int) -> Measured:
    """Measure the wake-up lateness of the tick while a planner job runs."""
    words = [sys.executable, "-m", "onboard", "jitter", "--real-time", "--json", "--seconds", str(SECONDS)]
    return judged([json.loads(subprocess.check_output(words, text=True)) for _ in range(repeats)])


def _words(late_us: dict[str, float]) -> str:
    return f"{late_us['p50']:.0f} / {late_us['p999']:.0f} us"


ROWS = {"tick-jitter": tick_jitter}
