"""Command `hil verify`: run a certificate's scenario again and compare every hash."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from hil.run.options import EX_DATA, EX_FAILED, EX_NOINPUT, EX_OK, EX_SOFTWARE, fail, fly
from hil.scenarios.model import Scenario, scenario_of

_BURN = "import os\nwhile os.getppid() == {parent}: sum(range(100_000))"  # ends with its parent


def verify(
    certificate: Annotated[Path, typer.Argument(help="certificate.json of a run.")],
    out: Annotated[Path, typer.Option(help="Folder of the new run.")] = Path("build/verify"),
    times: Annotated[int, typer.Option(min=1, help="So many runs, each compared.")] = 1,
    busy: Annotated[bool, typer.Option("--busy", help="With every core of this machine at work beside it.")] = False,
) -> None:
    """Run a certificate's scenario again and compare every hash.

    Exit codes: 0 no difference, 1 differences (each is printed), 65 no certificate, 66 no such file, 70 a process
    failed.

    Examples: hil verify build/demo/certificate.json | hil verify build/demo/certificate.json --times 5 --busy
    """
    old, scenario = _read(certificate)
    different = 0
    with cores_at_work() if busy else nullcontext():
        for count in range(1, times + 1):
            found = _compare(old, scenario, certificate, out)
            different += bool(found)
            verdict = f"{found} differences" if found else "the same to the byte"
            of_all = f", run {count} of {times}" if times > 1 else ""
            print(f"{scenario.name}, seed {scenario.seed}{of_all}: {verdict}", flush=True)
    raise typer.Exit(EX_FAILED if different else EX_OK)


def _read(certificate: Path) -> tuple[dict[str, Any], Scenario]:
    try:
        old = json.loads(certificate.read_text())
        return old, scenario_of(old["flight"])
    except FileNotFoundError:
        raise fail(EX_NOINPUT, f"no certificate {certificate}") from None
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, OSError) as error:
        raise fail(EX_DATA, f"{certificate}: no certificate of a run: {type(error).__name__}: {error}") from None


def _compare(old: dict[str, Any], scenario: Scenario, certificate: Path, out: Path) -> int:
    """Run once, print each leaf that differs and return their number."""
    from hil.run.demo import certificate as certify
    from hil.run.demo import differences

    result = fly(scenario, out)
    if result.error:
        raise fail(EX_SOFTWARE, f"after {result.bench_s:.1f} s of bench time: {result.error}")
    new = certify(scenario, result)
    (out / "certificate.json").write_text(json.dumps(new, indent=2) + "\n")
    found = list(differences(old, new))
    for where, was, now in found:
        print(f"differs: {where}: {was} in {certificate}, {now} now")
    return len(found)


@contextmanager
def cores_at_work() -> Iterator[None]:
    """Keep every core busy inside the block: one process for each core that only burns time."""
    burn = [sys.executable, "-c", _BURN.format(parent=os.getpid())]
    with ExitStack() as stack:
        for _ in range(os.cpu_count() or 1):
            started = stack.enter_context(subprocess.Popen(burn))
            stack.callback(started.kill)
        yield
