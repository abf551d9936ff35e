"""Reader of recorded CAN logs, frame by frame: candump text, .asc, .blf; bad lines are reported and left out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from onboard.bringup.can.candump import ReceivedFrame, parse

TOLD_LINES = 20
OTHERS = (".asc", ".blf")


class NoLogError(ValueError):
    """File without a single line that is a frame: not a log of a CAN bus."""


def heard_in(path: Path, tell: Callable[[str], None]) -> Iterator[ReceivedFrame]:
    """The frames of a file.

    tell: receives a report for each of the first 20 lines that are no frame.

    Raises OSError, NoLogError, ValueError for a damaged .asc or .blf.
    """
    if path.suffix.lower() in OTHERS:
        from onboard.drivers.can.log import messages_of  # python-can is slow to load and text does not need it

        yield from (ReceivedFrame(*message) for message in messages_of(path))
    else:
        with path.open(encoding="ascii", errors="replace") as lines:
            yield from heard_of(lines, str(path), tell)


def heard_of(lines: Iterable[str], name: str, tell: Callable[[str], None]) -> Iterator[ReceivedFrame]:
    """The frames of lines of candump, as `heard_in`. Bad lines are reported after the first good one."""
    good, bad, held = 0, 0, list[str]()
    for number, line in enumerate(lines, 1):
        try:
            heard = parse(line)
        except ValueError as error:
            bad += 1
            if bad <= TOLD_LINES:
                held.append(f"{name}:{number}: {error}: {line.strip()[:60]!r}")
            elif not good:
                break
            continue
        if heard is not None:
            good += 1
            yield heard
        if good:
            _tell_all(held, tell)
    if held and not good:
        raise NoLogError(f"{name} is no log of a CAN bus: candump (-L or not), .asc and .blf are read; {held[0]}")
    _tell_all(held, tell)
    if bad > TOLD_LINES:
        tell(f"{name}: {bad - TOLD_LINES} more lines are none of candump")


def _tell_all(held: list[str], tell: Callable[[str], None]) -> None:
    for text in held:
        tell(text)
    held.clear()
