"""A configuration is right, or the start is refused with one helpful line."""

import dataclasses

import pytest

from onboard.config import Config, ConfigError, load, parse_override
from onboard.config_text import to_toml


def write(tmp_path, text):
    path = tmp_path / "rover.toml"
    path.write_text(text)
    return path


def test_printed_configuration_reads_back_unchanged(tmp_path):
    changed = load(None, {"can.uri": 'virtual:a"b\\c', "motion.cruise_mps": 0.05})
    assert load(write(tmp_path, to_toml(changed))) == changed


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("[can]\nurj = 'x'", r"unknown key `can.urj`; did you mean `can.uri`\?"),
        ("[cann]\nuri = 'x'", r"unknown key `cann`; did you mean `can`\?"),
        ("[motion]\ncruise_mps = 'fast'", r"`motion.cruise_mps` should be float, found 'fast'"),
        ("[motion]\ncruise_mps = 20.0", r"`motion.cruise_mps` = 20.0 is out of range 0.005 to 2"),
        ("[motion]\ncruise_mps = nan", r"out of range"),
        ("[mission]\nstrategy = 'optimistik'", r"should be one of .*; did you mean 'optimistic'\?"),
        ("[mission]\nstop_limit = true", r"`mission.stop_limit` should be int, found True"),
        ("mission = 3", r"`mission` should be a table, found 3"),
        ("[mission", r"not valid TOML"),
    ],
)
def test_what_is_wrong_is_named_with_file_key_value_and_help(tmp_path, text, complaint):
    path = write(tmp_path, text)
    with pytest.raises(ConfigError, match=complaint) as raised:
        load(path)
    assert str(path) in str(raised.value)
    assert "\n" not in str(raised.value)


def test_every_value_has_a_meaning_and_a_default_within_its_range():
    for section in dataclasses.fields(Config):
        part = getattr(load(), section.name)
        for row in dataclasses.fields(part):
            low, high = row.metadata["low"], row.metadata["high"]
            assert row.metadata["meaning"]
            assert low is None or low <= getattr(part, row.name) <= high, f"{section.name}.{row.name}"


def test_overrides_are_toml_where_they_parse_and_text_elsewhere():
    assert parse_override("motion.cruise_mps=0.2") == ("motion.cruise_mps", 0.2)
    assert parse_override("can.uri=virtual:a") == ("can.uri", "virtual:a")
    with pytest.raises(ConfigError, match=r"section.key=value"):
        parse_override("can.uri")
