"""The status of a run: a log gets a line within each 10 s, and whatever follows begins on a line of its own."""

import io

import pytest
import typer
from rich.console import Console
from rich.text import Text

from hil.run.options import waiting
from hil.run.status import status


def told(wall_s, terminal=False):
    """What a run writes that tells its status at these times, and is then ended by Ctrl-C."""
    file = io.StringIO()
    console = Console(file=file, force_terminal=terminal)
    with pytest.raises(KeyboardInterrupt), status(console, Text("starting")) as tell:
        for at_s in wall_s:
            tell(Text(f"at {at_s:g}, {'long ' * 30}end"), at_s)
        raise KeyboardInterrupt
    return file.getvalue()


def test_a_log_has_a_line_within_each_10_s_and_the_last_status():
    lines = told([0.5 * k for k in range(1, 64)]).splitlines()
    assert [line.partition(",")[0] for line in lines] == ["starting", "at 9", "at 18", "at 27", "at 31.5"]
    assert all(line.endswith("end") for line in lines[1:])


def test_a_status_that_was_just_printed_is_not_printed_again():
    assert told([9.0]).count("at 9") == 1


@pytest.mark.parametrize("terminal", [False, True])
@pytest.mark.parametrize("wall_s", [[], [1.0], [9.0]])
def test_an_interrupted_status_ends_its_line(terminal, wall_s):
    assert told(wall_s, terminal).rpartition("\n")[2] in ("", "\x1b[?25h")  # at most the cursor shown again


def test_ctrl_c_after_the_flight_names_the_record_and_the_command_that_makes_its_report(tmp_path, capsys):
    (tmp_path / "onboard.mcap").touch()
    with pytest.raises(typer.Exit) as ended, waiting(tmp_path, "replaying the record ..."):
        raise KeyboardInterrupt
    told = capsys.readouterr().err
    assert ended.value.exit_code == 130 and "replaying the record ..." in told
    assert str(tmp_path / "onboard.mcap") in told and f"ground report {tmp_path}" in told.replace("\n", " ")
