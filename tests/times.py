"""Time of each test: `make test-times` runs the fast suite with this plugin, then `python -m tests.times` tells it.

Processor time is that of the worker and of its ended children, so it says little of how busy the machine was. A
fixture's time counts for the test that asks for it first.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "build" / "test-times"
SLOWEST = 30


def processor_s() -> float:
    """Of this process and its ended children."""
    return sum(os.times()[:4])


def own_file() -> Path:
    """Where this process writes its lines."""
    return FOLDER / f"{os.environ.get('PYTEST_XDIST_WORKER', 'alone')}.jsonl"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """A line for each test, with its fixtures."""
    began_s, processor_before_s = time.perf_counter(), processor_s()
    outcome = yield
    row = {"id": item.nodeid, "s": time.perf_counter() - began_s, "processor_s": processor_s() - processor_before_s}
    with own_file().open("a") as file:
        file.write(json.dumps(row) + "\n")
    return outcome


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish() -> None:
    """A line for the process, imports and collection included."""
    with own_file().open("a") as file:
        file.write(json.dumps({"process_s": processor_s()}) + "\n")


def pytest_configure(config: pytest.Config) -> None:
    """Start again; the workers start later."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    if not hasattr(config, "workerinput"):
        for path in FOLDER.glob("*.jsonl"):
            path.unlink()


def told(lines: list[dict]) -> str:
    """The slowest tests and files as Markdown tables."""
    tests = sorted((line for line in lines if "id" in line), key=lambda line: -line["processor_s"])
    files: dict[str, list[float]] = defaultdict(list)
    for test in tests:
        files[test["id"].partition("::")[0]].append(test["processor_s"])
    slowest_files = sorted(files.items(), key=lambda item: -sum(item[1]))[:SLOWEST]
    total_s = sum(test["processor_s"] for test in tests)
    # of pytest itself: the workers are its children
    all_s = max(line["process_s"] for line in lines if "process_s" in line)
    text = f"{len(tests)} tests, {total_s:.0f} s of processor time; with imports and collection {all_s:.0f} s.\n\n"
    text += "| processor, s | test |\n| --- | --- |\n"
    text += "".join(f"| {test['processor_s']:.1f} | `{_short(test['id'])}` |\n" for test in tests[:SLOWEST])
    text += "\n| processor, s | tests | file |\n| --- | --- | --- |\n"
    return text + "".join(f"| {sum(times):.1f} | {len(times)} | `{name}` |\n" for name, times in slowest_files)


def _short(nodeid: str) -> str:
    path, _, name = nodeid.partition("::")
    return f"{Path(path).name}::{name}"


if __name__ == "__main__":
    found = [json.loads(line) for path in FOLDER.glob("*.jsonl") for line in path.read_text().splitlines()]
    sys.exit("run `make test-times` first") if not found else print(told(found), end="")
