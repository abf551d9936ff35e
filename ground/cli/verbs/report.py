"""The verb `ground report`. The drawing code is loaded only when the verb runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ground.cli.verbs.screen import line_beside, line_out

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
    line_out(str(path))


def _fail(code: int, text: str) -> typer.Exit:
    line_beside(f"ground: {text}")
    return typer.Exit(code)
