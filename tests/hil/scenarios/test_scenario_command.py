"""`hil list`, `hil explain`, `hil verify`: what a user sees, and what he is told when something is wrong."""

import json
import os
import threading
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner

from hil.__main__ import app
from hil.run import demo, verify_command
from hil.run import scenario_command as command
from hil.run.demo import differences
from hil.run.options import fail
from hil.scenarios.library import scenarios
from hil.scenarios.model import Scenario


def hil(*words):
    return CliRunner().invoke(app, words)


def test_every_scenario_is_listed_with_what_happens_in_it():
    told = json.loads(hil("list", "--json").stdout)
    assert [row["name"] for row in told] == [scenario.name for scenario in scenarios()]
    assert all(row["about"] for row in told)
    assert "wheel_stuck" in hil("list").stdout


def test_a_scenario_is_explained_with_the_fault_table_s_answer():
    told = hil("explain", "wheel_stuck").stdout
    assert "a wheel's gear jams" in told
    assert "expected   WHEEL_STUCK within 1 s" in told and "RESCAN" in told
    assert "promise    ends standing" in told


def test_texts_of_a_scenario_file_draw_nothing_on_the_terminal(tmp_path, capsys):
    path = tmp_path / "s.toml"
    path.write_text('seed = 1\nabout = "\\u001b[2J\\u009b31m"\n')
    told = hil("explain", str(path)).stdout
    assert "\\x1b[2J\\x9b31m" in told and all(c.isprintable() or c == "\n" for c in told)
    command._tell([{"promise": "says '[/x]\x1b[2J'", "holds": False, "found": "[red]\x9b"}])
    told = capsys.readouterr().out
    assert "[/x]\\x1b[2J" in told and "[red]\\x9b" in told
    assert fail(78, "\x1b[2J").exit_code == 78 and capsys.readouterr().err == "hil: \\x1b[2J\n"


@pytest.mark.parametrize(
    "words, hint",
    [
        (("explain", "wheel_stuk"), "did you mean wheel_stuck?"),
        (("run", "wheel_stuk"), "did you mean wheel_stuck?"),
        (("run", "tests"), ""),
    ],
)
def test_a_scenario_that_does_not_exist_is_one_line_with_the_nearest_name(words, hint, capsys):
    done = hil(*words)
    assert done.exit_code == 66
    assert done.stderr.startswith(f"hil: no scenario {words[1]}; {hint}")
    assert "`hil list`" in done.stderr and done.stderr.count("\n") == 1


def test_what_means_nothing_over_sockets_is_refused_there():
    done = hil("run", "job_late")
    assert done.exit_code == 78
    assert done.stderr == "hil: job_late: job_late needs --quick; over sockets the bench waits for jobs\n"


@pytest.mark.parametrize("words", [("explain",), ("run", "--quick"), ("run",)])
def test_a_fault_with_a_target_that_it_cannot_have_is_one_line(tmp_path, words):
    path = tmp_path / "s.toml"
    path.write_text("seed = 1\nterrain = 'flat'\n[[faults]]\nfault = 'wheel_silent'\n")
    done = hil(*words, str(path))
    assert done.exit_code == 78 and len(done.stderr.splitlines()) == 1
    assert "faults.target = 0 of wheel_silent: should be 1 to 4" in done.stderr


def test_another_python_that_is_not_there_is_one_line():
    done = hil("run", "wheel_stuck", "--onboard-python", "/nowhere/python")
    assert done.exit_code == 66
    assert done.stderr == "hil: --onboard-python '/nowhere/python': no program there that may be run\n"


def test_another_python_is_refused_where_there_are_no_processes():
    done = hil("run", "wheel_stuck", "--quick", "--onboard-python", "python")
    assert done.exit_code == 64 and "--onboard-python needs a process" in done.stderr


def test_what_needs_processes_is_refused_where_there_are_none():
    done = hil("run", "onboard_restarted", "--quick")
    assert done.exit_code == 78
    assert "onboard_restarted needs processes; run it without --quick" in done.stderr


@pytest.mark.parametrize(
    ("text", "code", "complaint"),
    [(None, 66, "no certificate"), ("{", 65, "no certificate of a run"), ("{}", 65, "KeyError: 'flight'"),
     ('{"flight": {"faults": 3}}', 65, "no certificate of a run"), ('{"flight": 1}', 65, "TypeError"),
     ("[" * 100_000, 65, "RecursionError"),
     ('{"flight": {"faults": [], "set": {}, "expect": []}}', 65, "AttributeError")],
)  # fmt: skip
def test_what_is_no_certificate_is_one_line(tmp_path, text, code, complaint):
    path = tmp_path / "certificate.json"
    if text is not None:
        path.write_text(text)
    done = hil("verify", str(path))
    assert done.exit_code == code
    assert complaint in done.stderr and done.stderr.count("\n") == 1


def test_two_certificates_differ_where_a_leaf_does():
    old = {"plant": {"states": 3, "sha256": "aa"}, "seed": 1}
    assert list(differences(old, {"plant": {"states": 3, "sha256": "aa"}, "seed": 1})) == []
    new = {"plant": {"states": 3, "sha256": "bb"}, "seed": 1, "more": 2}
    assert list(differences(old, new)) == [("more", None, 2), ("plant.sha256", "aa", "bb")]


def test_each_of_several_runs_is_compared_and_one_that_differs_is_counted(tmp_path, monkeypatch, capsys):
    path = tmp_path / "certificate.json"
    first = {"flight": json.loads(json.dumps(asdict(Scenario()), default=dict)), "plant": {"sha256": "aa"}}
    path.write_text(json.dumps(first))
    flown, digests = [], ("aa", "ab", "aa")

    def fly(scenario, out):
        out.mkdir(exist_ok=True)
        flown.append(scenario)
        return SimpleNamespace(error="")

    monkeypatch.setattr(verify_command, "fly", fly)
    monkeypatch.setattr(demo, "certificate", lambda *_: {**first, "plant": {"sha256": digests[len(flown) - 1]}})
    with pytest.raises(typer.Exit) as ended:
        verify_command.verify(path, tmp_path / "again", times=3)
    assert ended.value.exit_code == 1 and flown == [Scenario()] * 3
    lines = capsys.readouterr().out.splitlines()
    assert [line.rpartition(": ")[2] for line in lines if ", run " in line] == [
        "the same to the byte",
        "1 differences",
        "the same to the byte",
    ]
    assert f"differs: plant.sha256: aa in {path}, ab now" in lines


def test_the_load_beside_a_run_ends_with_it():
    before = {int(pid) for pid in _children()}  # of other tests in this process
    with verify_command.cores_at_work():
        begun = {int(pid) for pid in _children()} - before
        assert len(begun) >= os.cpu_count()
    assert not begun & {int(pid) for pid in _children()}


def _children():
    return Path(f"/proc/self/task/{threading.get_native_id()}/children").read_text().split()
