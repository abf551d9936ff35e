"""The bench's own scenarios and their description in words, for `hil list` and `hil explain`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hil.faults.injection import causes
from hil.faults.plan import Injection
from hil.scenarios.model import Scenario, load_scenario, scanner_of
from protocol.tables.faults import BY_NAME

FOLDER = Path(__file__).parent / "data"
_START = {"time": "of the run", "sweep": "of the first scan", "drive": "of the first drive"}


def scenarios() -> tuple[Scenario, ...]:
    """All scenarios, sorted by name."""
    return tuple(load_scenario(path) for path in sorted(FOLDER.glob("*.toml")))


def find(name: str) -> Path:
    """File of a scenario given by name or path: `wheel_stuck`, `hil/scenarios/data/wheel_stuck.toml`, `mine.toml`."""
    path, own = Path(name), FOLDER / f"{name}.toml"
    if path.is_file() or not own.is_file():
        path.open("rb").close()
        return path
    return own


def names(incomplete: str = "") -> list[str]:
    """Names of the bench's own scenarios that begin so, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*.toml") if path.stem.startswith(incomplete))


def explain(scenario: Scenario) -> Iterator[str]:
    """Yield the description line by line: events, expected responses of the flight program, promises.

    Raises ConfigError for an unknown fault.
    """
    known = causes(scenario.faults)
    yield scenario.about
    yield ""
    yield f"ground     {scenario.terrain}, seed {scenario.seed}"
    blackouts = "".join(f", nothing passes from {a:g} to {b:g} s" for a, b in _pairs(scenario.blackout_s))
    yield f"link       {scenario.link}{blackouts}"
    yield f"operator   {'; '.join(scenario.script.strip().splitlines())}"
    yield f"ends       {f'at {scenario.end_s:g} s' if scenario.end_s else 'with the script'}"
    if scenario.soil != "nominal":
        yield f"soil       {scenario.soil}"
    scanner = scanner_of(scenario.lidar)
    own = ", ".join(f"{key} = {item!r}" for key, item in scenario.lidar.items() if key != "profile")
    yield f"scanner    {scanner.profile}{': ' + own if own else ''}"
    for key, item in scenario.set.items():
        yield f"setting    {key} = {item!r}"
    for fault, cause in zip(scenario.faults, known, strict=True):
        yield f"fault      {_when(fault)}: {cause.means}"
    for name in dict.fromkeys((*scenario.expect.raises, *scenario.expect.detects)):
        row = BY_NAME[name]
        yield f"expected   {name} within {row.detect_s:g} s: {row.condition}"
        for step in row.response:
            yield f"             {step.name}: {step.value}"
    yield f"promise    {_promise(scenario)}"


def _when(fault: Injection) -> str:
    target = f" {fault.target}" if fault.target else ""
    lasts = f", for {fault.for_s:g} s" if fault.for_s < 1e8 else ""
    return f"{fault.fault}{target}, {fault.after_s:g} s after the start {_START[fault.when]}{lasts}"


def _promise(scenario: Scenario) -> str:
    expect = scenario.expect
    ends = {"goal": f"ends within {expect.within_m:g} m of the goal", "stopped": "ends standing", "anyhow": "runs"}
    seen = f", each fault seen within {expect.seen_within_s:g} s" if scenario.faults else ""
    return f"{ends[expect.ends]}, {expect.contacts} contacts, no process dies, nothing else raised{seen}"


def _pairs(numbers: tuple[float, ...]) -> Iterator[tuple[float, float]]:
    return zip(numbers[::2], numbers[1::2], strict=True)
