"""Command `hil watch FOLDER`: a run in a browser, as a film, or as a file for Rerun."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from hil.view.film_kind import KindError, check_kind
from hil.view.live import until_ctrl_c, watched
from hil.view.port import PortInUseError
from protocol.visible import visible_lines

EPILOG = (
    "Examples:\n\n  hil watch build/demo\n\n  hil watch build/demo --video demo.webp\n\n"
    "  hil watch build/demo --rrd demo.rrd\n\n  hil run hil/scenarios/data/wheel_stuck.toml --watch"
)
PORT = 8080
EX_UNAVAILABLE, EX_NOINPUT, EX_INTERRUPTED, EX_USAGE = 69, 66, 130, 64

WatchOption = Annotated[bool, typer.Option("--watch", help="Show it in the browser, until Ctrl-C.")]
AfterOption = Annotated[Path | None, typer.Option("--video", help="Afterwards a film: .webp, .gif; .mp4 by ffmpeg.")]
FolderArgument = Annotated[Path, typer.Argument(help="Folder of a run, finished or still going on.")]
PortOption = Annotated[int, typer.Option(min=1024, max=65535, help="Of 127.0.0.1, for the browser.")]
WaitOption = Annotated[bool, typer.Option("--wait", help="Wait for the run to begin.")]
VideoOption = Annotated[Path | None, typer.Option(help="Write a film instead: .webp or .gif; .mp4 needs ffmpeg.")]
RrdOption = Annotated[Path | None, typer.Option(help="Write a file for Rerun instead: needs the extra rerun.")]


def main(
    folder: FolderArgument,
    port: PortOption = PORT,
    wait: WaitOption = False,
    video: VideoOption = None,
    rrd: RrdOption = None,
) -> None:
    """Play a run in the browser, live or afterwards; Ctrl-C ends it.

    Exit codes: 0 written, 64 unknown kind of film, 66 no run there, 69 port in use or Rerun missing, 130 Ctrl-C.
    """
    from hil.view.tail import NoRunError

    try:
        if wait and not (video or rrd):
            _wait_for(folder)
        if video:
            film(folder, video)
        if rrd:
            _rerun(folder, rrd)
        if not (video or rrd):
            _serve(folder, port)
    except NoRunError as error:
        raise _fail(EX_NOINPUT, str(error)) from None
    except KeyboardInterrupt:
        raise typer.Exit(EX_INTERRUPTED) from None


def _wait_for(folder: Path) -> None:
    import os
    import time

    os.nice(10)  # the run has priority
    while not (folder / "truth.mcap").is_file():
        time.sleep(0.1)


def _serve(folder: Path, port: int) -> None:
    from hil.view.folder import Folder

    found = Folder(folder)  # first: the viewer takes a second to load
    from hil.view.browser.serve import serve

    try:
        serve(found, port, lambda address: typer.echo(f"watch {folder}: {address}   Ctrl-C ends it"))
    except PortInUseError as error:
        raise _fail(EX_UNAVAILABLE, str(error)) from None


@contextmanager
def shown(folder: Path, watch: bool, port: int) -> Iterator[None]:
    """Start the viewer of a run if `watch` is set; after the run it stays until Ctrl-C. Raises typer.Exit."""
    if not watch:
        yield
        return
    try:
        with watched(folder, port) as place:
            typer.echo(f"watch: {place}", err=True)
            yield
            typer.echo("the run is over, its picture stays; Ctrl-C ends it", err=True)
            until_ctrl_c()
    except PortInUseError as error:
        raise _fail(EX_UNAVAILABLE, str(error)) from None


def check_film(path: Path | None) -> None:
    """Check before a run that its film can be written. Raises typer.Exit."""
    try:
        if path:
            check_kind(path)
    except KindError as error:
        raise _fail(EX_USAGE, str(error)) from None


def film(folder: Path, path: Path) -> None:
    """Write the film of a run and print its path. Raises typer.Exit, NoRunError."""
    check_film(path)
    from hil.view.video import write

    write(folder, path)
    typer.echo(f"film: {path}")


def _rerun(folder: Path, path: Path) -> None:
    try:
        from hil.view.rrd import write
    except ModuleNotFoundError as error:
        raise _fail(EX_UNAVAILABLE, f"{error.name} is not installed: `pip install .[rerun]` brings it") from None
    write(folder, path)
    typer.echo(f"for Rerun: {path}   `rerun {path}` shows it")


def _fail(code: int, text: str) -> typer.Exit:
    typer.echo(visible_lines(f"hil: {text}"), err=True)
    return typer.Exit(code)
