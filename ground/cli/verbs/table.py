"""Verbs of the station that need no code of their own: made from the rows of protocol.tables.commands.

`faults_mask` becomes `ground faults mask FAULT LASTING_S`; arguments are typed in the row's order, angles in degrees.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ground.cli.verbs.options import Yes, confirm
from protocol.tables.arguments import ArgumentKind
from protocol.tables.commands import FAMILIES, Argument, Command

StationFile = Annotated[
    Path | None,
    typer.Option("--station", metavar="FILE", help="Station file; else ./ground.toml or ./build/sim/ground.toml."),
]
Json = Annotated[bool, typer.Option("--json", help="One JSON object per line.")]
Timeout = Annotated[float, typer.Option(min=0, metavar="S", help="Give up after so many seconds; 0: never.")]
Contact = Annotated[float, typer.Option(min=0, metavar="S", help="How long to wait for the first word of the rover.")]
Start = Annotated[
    str,
    typer.Option(
        "--start",
        metavar="S|UTC",
        help="Begin no earlier than this: seconds of onboard time, or UTC like 2026-11-22T12:00:00Z; 0: at once.",
    ),
]
FAMILY_HELP = {
    "faults": "The fault table: what is active, what is masked.", "map": "The rover's own map.",
    "fence": "Keep-outs, which the rover never enters, and fences within which goals lie.",
    "sequence": "Steps that the rover does one after the other by itself.",
    "lease": "The control lease: which of the stations may command. Stop and safe need none.",
    "contacts": "Contact windows: the times outside of which nothing is sent.",
    "param": "Parameters: what may be changed in flight, and who changed it.",
}  # fmt: skip
ASKS = {
    "map_clear": "the rover forgets its own map, on its disk too",
    "reboot": "the flight program ends and starts again; what was not saved is lost",
    "fence_clear": "all fences go out of force",
    "sequence_clear": "the rover forgets the sequence",
}  # what is lost; --yes skips the question
_LONG_S, _SHORT_S = 0.0, 60.0
Run = Callable[[list[str], dict[str, Any]], None]


def typed(argument: Argument) -> str:
    """Return an argument's name as the help shows it: degrees where the table has radians."""
    name = argument.name.replace("rad", "deg").upper()
    return f"{name}..." if argument.kind is ArgumentKind.POINTS else name


def add(app: typer.Typer, rows: Sequence[Command], run: Run) -> dict[str, typer.Typer]:
    """Add one verb for each row and return the families. run(words, options) runs a verb.

    options: timeout, contact, station, as_json, start.
    """
    families: dict[str, typer.Typer] = {}
    for row in rows:
        family, _, verb = row.typed.partition(" ")
        if verb and family not in families:
            families[family] = typer.Typer(help=FAMILY_HELP[family], no_args_is_help=True)
            app.add_typer(families[family], name=family)
        where = families[family] if verb else app
        where.command(
            verb or family,
            epilog=f"Example: ground {row.typed} {row.example}".rstrip(),
            context_settings={"ignore_unknown_options": True},
        )(_verb(row, run))
    assert set(families) <= set(FAMILIES)
    return families


def _verb(row: Command, run: Run) -> Callable[..., None]:
    def verb(**given: Any) -> None:
        if row.name in ASKS and not (given.pop("yes") or (row.name == "fence_clear" and given.get("fence"))):
            confirm(ASKS[row.name], False)
        words = [str(word) for argument in row.arguments for word in _listed(given.pop(argument.name))]
        run([*row.typed.split(), *words], given)

    parameters = [_parameter(argument, argument is row.arguments[-1]) for argument in row.arguments]
    patience_s = _LONG_S if row.moves else _SHORT_S
    options = [
        ("start", Start, "0"),
        ("timeout", Timeout, patience_s),
        ("contact", Contact, 20.0),
        ("station", StationFile, None),
        ("as_json", Json, False),
    ]
    options += [("yes", Yes, False)] * (row.name in ASKS)
    parameters += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for name, kind, default in options
    ]
    verb.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    verb.__annotations__ = {p.name: p.annotation for p in parameters}
    verb.__name__ = row.name
    verb.__doc__ = f"{row.meaning[0].upper()}{row.meaning[1:]}."
    return verb


def _parameter(argument: Argument, last: bool) -> inspect.Parameter:
    kind: Any = list[str] if argument.takes_rest and last else str
    told = f"{argument.meaning[0].upper()}{argument.meaning[1:]}; {argument.allowed}."
    known = list(argument.choices or argument.known)
    about = typer.Argument(metavar=typed(argument), help=told, autocompletion=lambda: known)
    default = inspect.Parameter.empty if argument.required else None
    return inspect.Parameter(
        argument.name,
        inspect.Parameter.KEYWORD_ONLY,
        default=default,
        annotation=Annotated[kind if argument.required else kind | None, about],
    )


def _listed(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (list, tuple)) else [] if value is None else [value]
