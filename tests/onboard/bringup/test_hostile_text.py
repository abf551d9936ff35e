"""A configuration or a price that nobody meant well: one line, never a traceback."""

import math
from pathlib import Path

import numpy as np
import pytest
from click.exceptions import Exit

from onboard.command_line import read_config
from onboard.config import ConfigError, load, parse_override
from onboard.config_text import to_toml
from onboard.kernel_calls import pose_field
from onboard.planning.local.pose_field import moves_m

HOSTILE = {
    "brackets": "a = " + "[" * 100_000,
    "braces": "a = " + "{a=" * 50_000,
    "deep but closed": "a = " + "[" * 400 + "]" * 400,
    "deep keys": "a" + ".a" * 5000 + " = 1",
    "deep table": "[can" + ".a" * 5000 + "]",
    "5000 digits": "a = " + "9" * 5000,
    "huge hexadecimal number": "[can]\nstale_ns = 0x" + "f" * 20_000,
    "a number beyond floats": "[link]\nrate_bps = 1" + "0" * 400,
    "a text of a megabyte": "[mission]\nstrategy = '" + "a" * 1_000_000 + "'",
    "a date": "[link]\nrate_bps = 1979-05-27",
}


@pytest.mark.parametrize("case", HOSTILE)
def test_a_hostile_configuration_is_one_line(tmp_path, case):
    path = tmp_path / "rover.toml"
    path.write_text(HOSTILE[case])
    with pytest.raises(ConfigError) as raised:
        load(path)
    text = str(raised.value)
    assert str(path) in text and "\n" not in text and len(text) < 1000


@pytest.mark.parametrize("text", ["[" * 100_000, "{a=" * 50_000, "9" * 5000, "0x" + "f" * 20_000, "1" + "0" * 400])
def test_a_hostile_value_of_the_command_line_is_one_line(text):
    with pytest.raises(ConfigError) as raised:
        load(None, dict([parse_override(f"link.rate_bps={text}")]))
    assert "\n" not in str(raised.value) and len(str(raised.value)) < 1000


def test_a_configuration_that_never_ends_is_not_read(capsys):
    with pytest.raises(Exception) as raised:
        read_config(Path("/dev/zero"), ())
    assert raised.value.exit_code == 78 and "/dev/zero" in capsys.readouterr().err


def test_a_key_with_control_characters_is_one_visible_line(tmp_path, capsys):
    path = tmp_path / "rover.toml"
    path.write_text('"\\u001b[2J\\nonboard: running" = 1\n')
    with pytest.raises(Exit) as raised:
        read_config(path, ())
    told = capsys.readouterr().err
    assert raised.value.exit_code == 78 and "\\x1b[2J\\n" in told
    assert told.count("\n") == 1 and told[:-1].isprintable()


def test_a_text_with_control_characters_is_printed_as_toml_that_reads_back(tmp_path):
    config = load(None, {"record.path": 'a\x1b[2J\n\t\x7f"\\b\u202e'})
    (tmp_path / "rover.toml").write_text(text := to_toml(config))
    assert all(c.isprintable() or c == "\n" for c in text)
    assert load(tmp_path / "rover.toml") == config


@pytest.mark.parametrize("turn_m", [math.nan, math.inf, -math.inf, 0.0])
def test_a_turn_without_a_price_is_refused(turn_m):
    seeds = np.zeros(1, np.int64), np.zeros(1, np.float32)
    with pytest.raises(ValueError, match="turn_m"):
        pose_field.cost_to_go(np.full((8, 3, 3), 2, np.uint8), 1, seeds, moves_m(0.1), turn_m, None)
