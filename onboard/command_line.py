"""Common parts of the commands: exit codes of sysexits.h, error line on standard error, configuration file."""

from __future__ import annotations

import signal
from collections.abc import Iterable
from pathlib import Path

import click
from click.exceptions import Abort, Exit

from onboard.config import Config, ConfigError, load, parse_override
from onboard.journal import Level, say
from protocol.visible import visible

EX_UNHEALTHY, EX_USAGE, EX_DATAERR, EX_NOINPUT, EX_UNAVAILABLE, EX_CANTCREAT, EX_CONFIG = 1, 64, 65, 66, 69, 73, 78
EX_SOFTWARE, EX_IOERR = 70, 74
EX_INTERRUPTED = 130


def fail(code: int, text: str) -> Exit:
    """Print one helpful line on standard error and return the exit to raise."""
    say(visible(text), Level.ERROR)
    return Exit(code)


def agreed(question: str) -> bool:
    """Return whether the operator answers yes; Ctrl-C means no."""
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return click.confirm(question, err=True)
    except Abort:
        return False
    finally:
        signal.signal(signal.SIGINT, previous)


def read_config(path: Path | None, settings: Iterable[str]) -> Config:
    """Return the configuration, or exit 66 (no such file) or 78 (something wrong in it)."""
    try:
        return load(path, dict(parse_override(text) for text in settings))
    except FileNotFoundError:
        hint = f"`onboard run --print-config > {path}` makes one"
        raise fail(EX_NOINPUT, f"no configuration file {path}; {hint}") from None
    except IsADirectoryError:
        raise fail(EX_NOINPUT, f"{path} is a folder, not a configuration file") from None
    except PermissionError:
        raise fail(EX_NOINPUT, f"{path} may not be read by this user") from None
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None


def examples_of(family: str, command: str) -> str:
    """Return the heading of `family`, the examples of a family of commands, and those lines that run `command`."""
    mark, heading, *lines = family.splitlines()
    return "\n".join([mark, heading, *(line for line in lines if f" {command} " in f"{line} ")])
