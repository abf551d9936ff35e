"""`python -m tests.mutation`: do the tests notice? Each mutant has to turn tests or a scenario red.

python -m tests.mutation                        all: every detector, every flip; hours of one core
python -m tests.mutation --only kinematics      mutants whose name holds the word; repeatable
python -m tests.mutation --only "detector WHEEL_STALE"
python -m tests.mutation --list
"""

from __future__ import annotations

import json
import os
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from tests.mutation.detectors import detectors
from tests.mutation.targets import EQUIVALENT, TARGETS, control, mutants
from tests.mutation.trials import End, Outcome, Trial, Trials

EX_SURVIVED, EX_INTERRUPTED = 1, 130
KILLED = (End.KILLED, End.TIMEOUT)
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    only: Annotated[list[str], typer.Option(metavar="NAME", help="Mutants whose name holds this; repeatable.")] = [],
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = os.cpu_count() or 1,
    list_them: Annotated[bool, typer.Option("--list", help="Name the mutants, run none.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Outcomes as JSON in place of the table.")] = False,
) -> None:
    """Make every mutant, run the tests or scenarios that must notice it, say what did.

    Exit codes: 0 every mutant is killed and every equivalent one lives, 1 not so (which is said), 2 no such mutant,
    130 Ctrl-C.
    """
    wanted = [each for each in every_mutant() if not only or any(word in each.name for word in only)]
    if not wanted:
        raise typer.BadParameter(f"no mutant's name holds {' or '.join(only)}; see --list", param_hint="--only")
    if list_them:
        typer.echo("\n".join(each.name for each in wanted))
        return
    groups = {_group(each.name) for each in wanted}
    trials = [*(control(target) for target in TARGETS if target.module in groups), *wanted]
    outcomes: list[Outcome] = []
    try:
        with Trials(workers) as running:
            for count, outcome in enumerate(running.run(trials), 1):
                outcomes.append(outcome)
                typer.echo(f"{count} of {len(trials)}: {outcome.end.value:<9} {outcome.name}  {outcome.by}", err=True)
    except KeyboardInterrupt:
        typer.echo(f"stopped after {len(outcomes)} of {len(trials)}", err=True)
        raise typer.Exit(EX_INTERRUPTED) from None
    _show(outcomes, as_json)
    wrong = list(faults(outcomes))
    for text in wrong:
        typer.echo(f"falls short: {text}", err=True)
    raise typer.Exit(EX_SURVIVED if wrong else 0)


def every_mutant() -> Iterator[Trial]:
    """Flips first, they take minutes; then the detectors, a flight or two each."""
    for target in TARGETS:
        yield from mutants(target)
    yield from detectors()


def faults(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Errors: a survivor, an equivalent one that is killed, tests red without a mutant, a broken trial."""
    for outcome in outcomes:
        lives = outcome.name in EQUIVALENT or outcome.name.endswith(" as it is")
        if outcome.end is End.BROKEN:
            yield f"{outcome.name}: {outcome.by}"
        elif outcome.end is End.SURVIVED and not lives:
            yield f"{outcome.name}: no test notices"
        elif outcome.end in KILLED and lives:
            said = "listed as equivalent, but" if outcome.name in EQUIVALENT else "not a mutant, but"
            yield f"{outcome.name}: {said} {outcome.end.value}: {outcome.by}"


def _group(name: str) -> str:
    return name.partition(" ")[0]


def _show(outcomes: Sequence[Outcome], as_json: bool) -> None:
    if as_json:
        rows = [{"name": each.name, "end": each.end.name, "by": each.by} for each in outcomes]
        print(json.dumps(rows, indent=1))
        return
    table = Table("mutants of", *(end.value for end in End), "equivalent", title="do the tests notice?")
    mutated = [each for each in outcomes if not each.name.endswith(" as it is")]
    for group in dict.fromkeys(_group(each.name) for each in mutated):
        ends = Counter(
            "equivalent" if each.end is End.SURVIVED and each.name in EQUIVALENT else each.end.value
            for each in mutated
            if _group(each.name) == group
        )
        table.add_row(group, *(str(ends[end.value]) for end in End), str(ends["equivalent"]))
    Console(width=None if sys.stdout.isatty() else 110).print(table)


if __name__ == "__main__":
    app()
