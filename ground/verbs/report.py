"""The verb `ground report`; what draws is loaded only when it is asked for."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

NO_INPUT, CANNOT_CREATE = 66, 73


def report_command(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of a run, with its onboard.mcap.")],
    truth: Annotated[bool, typer.Option(help="Use what the bench knows of rover and ground.")] = True,
    picture: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the paths alone, a PNG file.")] = None,
) -> None:
    """Make one HTML file of a run: FOLDER/report.html.

    Exit codes: 0 done, 66 no run or a damaged one, 73 cannot write.
    """
    from ground.report.report import report, write_paths
    from ground.report.run_files import NoRunError

    try:
        path = write_paths(folder, picture, truth) if picture else report(folder, truth)
    except NoRunError as error:
        raise _fail(NO_INPUT, str(error)) from None
    except OSError as error:
        raise _fail(CANNOT_CREATE, str(error)) from None
    sys.stdout.write(f"{path}\n")


def _fail(code: int, text: str) -> typer.Exit:
    sys.stderr.write(f"ground: {text}\n")
    return typer.Exit(code)
