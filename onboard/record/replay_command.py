"""Command `onboard replay`."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.exceptions import Exit

from onboard.command_line import EX_CONFIG, EX_DATAERR, EX_NOINPUT, EX_UNHEALTHY, fail

if TYPE_CHECKING:
    from onboard.record.replay import Verdict

EX_OK, EX_DIFFERENT = 0, EX_UNHEALTHY
EXAMPLES = """\b
Examples:
  onboard replay build/demo/onboard.mcap
  onboard replay --with-config new.toml build/demo/onboard.mcap
  onboard replay --set motion.cruise_mps=0.1 --json build/demo/onboard.mcap"""


@click.command("replay", epilog=EXAMPLES)
@click.argument("record", type=Path)
@click.option("--with-config", type=Path, metavar="FILE", help="Another configuration in place of the record's.")
@click.option("--set", "-s", "settings", multiple=True, help="section.key=value, over the configuration; repeatable.")
@click.option("--json", "as_json", is_flag=True, help="The verdict as JSON.")
def replay(record: Path, with_config: Path | None, settings: tuple[str, ...], as_json: bool) -> None:
    """Run the same core on the inputs of RECORD and compare every output: `identical`, or the first difference.

    Further parts of the same run are read as well, if they are in the same folder. A record that was cut off is
    compared up to its end. With another configuration the result is not a verdict but a report of what the rover would
    have done differently, as far as the recorded inputs show: they do not react to what it does.

    Exit codes: 0 identical, or a report; 1 different; 65 the record is damaged; 66 no such file; 78 something wrong in
    the configuration.
    """
    from onboard.record import replay as of_runs

    if with_config is None and not settings:
        raise Exit(print_verdict(record, as_json, of_runs.replay))
    raise Exit(_print_report(record, as_json, with_config, settings))


def print_verdict(path: Path, as_json: bool, again: Callable[[Path], Verdict]) -> int:
    """Print the verdict of `again`; return the exit code."""
    from onboard.record.reader import DamagedRecordError

    if not path.is_file():
        print(f"onboard: no record {path}", file=sys.stderr)
        return EX_NOINPUT
    try:
        verdict = again(path)
    except DamagedRecordError as error:
        print(f"onboard: {path} is damaged: {error}", file=sys.stderr)
        return EX_DATAERR
    word = "identical" if verdict.identical else "different" if verdict.first_difference else "nothing compared"
    if as_json:
        print(
            json.dumps(
                {
                    "verdict": word,
                    "ticks": verdict.ticks,
                    "bytes": verdict.bytes_compared,
                    "first_difference": verdict.first_difference,
                    "cut_off": verdict.cut_off,
                    "another_program": verdict.another_program,
                }
            )
        )
    else:
        counts = ", ".join(f"{topic} {count}" for topic, count in verdict.bytes_compared.items())
        print(f"{word}: {verdict.ticks} ticks; bytes compared: {counts}")
        for line in (verdict.first_difference, verdict.another_program, verdict.cut_off):
            if line:
                print(line)
    return EX_OK if verdict.identical else EX_DIFFERENT


def _print_report(path: Path, as_json: bool, with_config: Path | None, settings: tuple[str, ...]) -> int:
    from onboard.config import ConfigError, parse_override
    from onboard.record.reader import DamagedRecordError
    from onboard.record.what_if import changed_config, fly, lines

    if not path.is_file():
        raise fail(EX_NOINPUT, f"no record {path}")
    try:
        found = fly(path, changed_config(path, with_config, dict(parse_override(text) for text in settings)))
    except ConfigError as error:
        text = re.sub(r"\S*/config\.toml", f"{path} with --set", str(error))  # its copy of the record's attachment
        raise fail(EX_CONFIG, str(error) if with_config else text) from None
    except DamagedRecordError as error:
        raise fail(EX_DATAERR, f"{path} is damaged: {error}") from None
    except FileNotFoundError:
        raise fail(EX_NOINPUT, f"no configuration file {with_config}") from None
    print(json.dumps(found.as_json()) if as_json else "\n".join(lines(found)))
    return EX_OK
