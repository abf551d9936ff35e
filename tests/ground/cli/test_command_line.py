"""The ground command as a user meets it: help, mistakes, exit codes; never a traceback."""

from types import SimpleNamespace

import pytest

from ground.__main__ import run
from ground.cli.operations.script import ScriptError, parse
from ground.cli.verbs.table import ASKS
from protocol.tables import commands


@pytest.fixture(autouse=True)
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def ended(capsys, *argv: str) -> tuple[int, str]:
    code = run(list(argv))
    streams = capsys.readouterr()
    assert "Traceback" not in streams.err + streams.out
    return code, streams.err or streams.out


def station(tmp_path, text: str = "bench_seed = 7\nendpoint = 'tcp/127.0.0.1:1'\n"):
    path = tmp_path / "ground.toml"
    path.write_text(text)
    return path


def test_help_lists_every_command_of_the_dictionary(capsys):
    code, text = ended(capsys, "--help")
    assert code == 0
    for row in commands.TABLE:
        assert row.typed.split()[0] in text


@pytest.mark.parametrize("row", [row for row in commands.TABLE], ids=lambda row: row.name)
def test_every_row_has_a_verb_whose_help_has_an_example_that_is_read(capsys, row):
    code, text = ended(capsys, *row.typed.split(), "--help")
    assert code == 0 and f"ground {row.typed} {row.example}".rstrip() in " ".join(text.split())
    yes = ["--yes"] if row.name in ASKS else []
    assert ended(capsys, *row.typed.split(), *row.example.split(), *yes)[0] == 66  # past the parser, no station file


def test_a_negative_number_and_degrees_pass_the_parser_of_a_verb_and_a_bad_one_is_a_usage_error(capsys):
    assert ended(capsys, "turn", "-90")[0] == 66
    assert ended(capsys, "turn", "-190")[0] == 64
    assert ended(capsys, "mission", "1", "-2", "3")[0] == 64


@pytest.mark.parametrize("verb", ["goto", "stop", "get", "script", "watch", "status"])
def test_help_of_a_verb_has_an_example(capsys, verb):
    code, text = ended(capsys, verb, "--help")
    assert code == 0
    assert f"ground {verb}" in text
    assert "Example" in text


@pytest.mark.parametrize("family", ["preview", "archive", "keys", "lease"])
def test_a_family_alone_shows_its_help_and_no_empty_error(capsys, family):
    assert run([family]) == 64
    streams = capsys.readouterr()
    assert "--help" in streams.out + streams.err and "ground:" not in streams.err


def test_help_of_goto_says_that_it_replaces_one_that_runs(capsys):
    assert "A goto replaces one that runs" in ended(capsys, "goto", "--help")[1]


@pytest.mark.parametrize(
    "argv",
    [
        ["goto"],
        ["goto", "12"],
        ["goto", "12", "east"],
        ["fly"],
        ["stop", "--loud"],
        ["get", "cheese"],
        ["goto", "1e9", "0"],
        ["script", "-", "--barrier", "somewhere"],
    ],
)
def test_wrong_usage_is_one_line_and_exit_code_64(capsys, argv):
    code, text = ended(capsys, *argv)
    assert code == 64
    assert text.startswith("ground: ")
    assert text.count("\n") == 1


def test_a_goal_out_of_range_says_what_is_allowed(capsys):
    _, text = ended(capsys, "goto", "1e9", "0")
    assert "`x_m` = 1000000000.0 should be -10000 to 10000 m" in text


def test_no_station_file_is_exit_code_66_and_says_where_it_looked(capsys):
    code, text = ended(capsys, "stop")
    assert code == 66
    assert "./ground.toml or ./build/sim/ground.toml" in text
    assert "--station FILE" in text


def test_negative_coordinates_are_numbers_not_options(capsys):
    assert ended(capsys, "goto", "-4", "-0.5")[0] == 66  # past the parser, at the missing station file
    assert ended(capsys, "goto", "-4", "0.5", "--heading", "90")[0] == 66  # the example of its help


def test_a_missing_script_is_exit_code_66(capsys, tmp_path):
    station(tmp_path)
    code, text = ended(capsys, "script", "none.txt")
    assert code == 66
    assert "none.txt: No such file" in text


def test_an_unknown_key_of_the_station_file_is_exit_code_78_with_a_suggestion(capsys, tmp_path):
    station(tmp_path, "endpont = 'x'\n")
    code, text = ended(capsys, "stop")
    assert code == 78
    assert "unknown key `endpont`; did you mean `endpoint`?" in text


def test_a_key_file_that_others_may_read_is_exit_code_78(capsys, tmp_path):
    for name in ("up", "down"):
        (tmp_path / name).write_text("")
        (tmp_path / name).chmod(0o644)
    station(tmp_path, "command_keys = 'up'\ndownlink_key = 'down'\nstate = 'state'\n")
    code, text = ended(capsys, "stop")
    assert code == 78
    assert "chmod 600" in text


def test_no_bench_at_the_barrier_is_exit_code_69(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr("ground.station.station.Station.wait_open", lambda *_: None)
    station(tmp_path)
    (tmp_path / "s").write_text("stop\n")
    code, text = ended(capsys, "script", "s", "--barrier", "tcp:127.0.0.1:1")
    assert code == 69
    assert "no bench at 127.0.0.1:1" in text


def test_nobody_on_the_link_is_exit_code_69(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr("ground.cli.operations.operate._ALONE_LIMIT_S", 0.0)  # a silent peer still has its 20 s
    station(tmp_path)
    code, text = ended(capsys, "stop")
    assert code == 69
    assert text == "ground: no link at tcp/127.0.0.1:1: nobody is there; `make sim` starts a rover to talk to\n"


@pytest.mark.parametrize(("linked", "waited_s"), [(False, 3), (True, 20)])
def test_a_link_without_a_peer_is_given_up_after_3_s_a_silent_peer_after_20_s(
    capsys, tmp_path, monkeypatch, linked, waited_s
):
    now_s = [0.0]
    monkeypatch.setattr(
        "transport.link_end.time",
        SimpleNamespace(
            monotonic=lambda: now_s[0],
            monotonic_ns=lambda: round(now_s[0] * 1e9),
            sleep=lambda _: now_s.__setitem__(0, now_s[0] + 0.25),
        ),
    )
    monkeypatch.setattr("transport.zenoh_end.ZenohEnd.linked", linked)
    station(tmp_path)
    code, text = ended(capsys, "stop")
    assert (code, now_s[0]) == (69, waited_s + 0.25)
    assert "`make sim` starts a rover to talk to" in text
    assert ("nobody answered within 20 s" if linked else "nobody is there") in text


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "nothing in it"),
        ("goto 12", "s:1: goto: `y_m` is missing"),
        ("# first\nat two: stop", "s:2: `at two: stop` should be `at SECONDS: COMMAND`"),
        ("gogo 1 2", "did you mean `goto`"),
        ("wait goto", "no such command before this line; asked so far: none"),
        ("goto 1 2 3 4", "goto takes x_m y_m heading_rad"),
        ("get cheese", "should be one of ldem, scan"),
    ],
)
def test_a_wrong_script_line_is_named(text, part):
    with pytest.raises(ScriptError) as error:
        parse(text, "s")
    assert part in str(error.value)


def test_a_script_reads_as_written():
    steps = parse("at 2.0: goto 12 3 180  # north\nwait goto\nwait 1.5\nget ldem\n")
    assert [(s.verb, s.name, s.at_s, s.pause_s) for s in steps] == [
        ("command", "goto", 2.0, 0.0),
        ("wait", "goto", None, 0.0),
        ("pause", "", None, 1.5),
        ("command", "get", None, 0.0),
    ]
    assert steps[0].arguments == pytest.approx({"x_m": 12.0, "y_m": 3.0, "heading_rad": 3.14159265})


@pytest.mark.parametrize(
    ("typed", "completed"),
    [
        ("ground arch", "archive"),
        ("ground get l", "ldem"),
        ("ground plot volt", "voltage_v"),
        ("ground faults mask COMM", "COMMAND_LOST"),
        ("ground fence add pit k", "keep_out"),
        ("ground archive export --format p", "parquet"),
    ],
)
def test_the_shell_completes_verbs_products_items_faults_and_choices(capsys, monkeypatch, typed, completed):
    monkeypatch.setenv("_GROUND_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", typed)
    monkeypatch.setenv("COMP_CWORD", str(len(typed.split()) - 1))
    with pytest.raises(SystemExit):
        run([])
    assert capsys.readouterr().out.split() == [completed]
