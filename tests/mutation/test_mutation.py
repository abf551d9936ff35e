"""The mutation run itself: what it changes, that a toy mutant is killed and an equivalent one lives, that it tells."""

import ast
import sys

import pytest
from typer.testing import CliRunner

from protocol.tables.faults import BY_NAME
from protocol.tables.modes import TRANSITIONS
from tests.mutation import __main__ as command
from tests.mutation.detectors import detectors
from tests.mutation.flips import flips
from tests.mutation.serve import Served, red
from tests.mutation.targets import EQUIVALENT, TARGETS, mutants, source_of
from tests.mutation.trials import End, Outcome, Trial, Trials

pytestmark = pytest.mark.tool

TOY = "def larger(a, b):\n    return a if a > b else b\n"
TOY_TEST = "from toy_of_mutation import larger\n\ndef test_larger():\n    assert larger(1, 2) == larger(2, 1) == 2\n"


def names(source):
    return [flip.name for flip in flips(source)]


def test_every_comparison_and_sign_is_flipped_alone_and_nothing_else():
    source = "def f(a, b):\n    if a < b <= 3:\n        a += 1\n    return -a * b + (a == 1)\n"
    assert names(source) == [
        "f: a < b <= 3 -> a <= b <= 3",
        "f: a < b <= 3 -> a >= b <= 3",
        "f: a < b <= 3 -> a < b < 3",
        "f: a < b <= 3 -> a < b > 3",
        "f: a += 1 -> a -= 1",
        "f: -a * b + (a == 1) -> -a * b - (a == 1)",
        "f: -a -> +a",
        "f: a == 1 -> a != 1",
    ]
    for flip in flips(source):
        before, after = flip.name.partition(": ")[2].split(" -> ")
        assert flip.source == ast.unparse(ast.parse(source)).replace(before, after)


def test_the_same_flip_twice_in_a_function_has_two_names():
    assert names("a = 1 < 2\nb = 1 < 2\n")[::2] == ["module: 1 < 2 -> 1 <= 2", "module: 1 < 2 -> 1 <= 2 #2"]


def test_a_multiplication_and_a_literal_are_left_alone():
    assert names("a = 2 * 3 / 4\n'''text < more'''\n") == []


def test_the_hook_serves_the_mutated_module_and_leaves_its_file_alone(tmp_path, monkeypatch):
    path = tmp_path / "toy_of_mutation.py"
    path.write_text(TOY)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "meta_path", [Served("toy_of_mutation", TOY.replace(">", "<")), *sys.meta_path])
    monkeypatch.delitem(sys.modules, "toy_of_mutation", raising=False)
    import toy_of_mutation

    monkeypatch.delitem(sys.modules, "toy_of_mutation")
    assert toy_of_mutation.larger(1, 2) == 1
    assert toy_of_mutation.__file__ == str(path)
    assert path.read_text() == TOY and [each.name for each in tmp_path.iterdir()] == [path.name]


def test_what_is_imported_already_cannot_be_mutated():
    with pytest.raises(RuntimeError, match=r"protocol\.tables\.modes was imported before"):
        red("protocol.tables.modes", "", ())


@pytest.fixture
def toy(tmp_path):
    """Of a source: what comes of its toy tests."""
    (tmp_path / "toy_of_mutation.py").write_text(TOY)
    tests = tmp_path / "test_toy_of_mutation.py"
    tests.write_text(TOY_TEST)
    return lambda name, source: Trial(name, red, ("toy_of_mutation", source, (str(tests),)), 60)


def hang() -> str:
    while True:
        pass


def test_a_mutant_is_killed_an_equivalent_one_survives_and_one_that_hangs_ends(toy):
    trials = [
        toy("as it is", TOY),
        *(toy(flip.name, flip.source) for flip in flips(TOY)),
        Trial("hangs", hang, (), 1),
        toy("no python", "def"),
        Trial("no tests", red, ("toy_of_mutation", TOY, ("tests/mutation/none.py",)), 60),
    ]
    with Trials(2) as running:
        outcomes = list(running.run(trials))
    assert [(each.name, each.end) for each in outcomes] == [
        ("as it is", End.SURVIVED),
        ("larger: a > b -> a >= b", End.SURVIVED),  # the same for every a and b
        ("larger: a > b -> a <= b", End.KILLED),
        ("hangs", End.TIMEOUT),
        ("no python", End.KILLED),
        ("no tests", End.BROKEN),
    ]
    assert outcomes[2].by == "test_toy_of_mutation.py::test_larger"


def test_trials_that_are_left_end_with_what_still_runs():
    with pytest.raises(KeyboardInterrupt), Trials(1) as running:
        for _ in running.run([Trial("first", str, (), 60), *[Trial("hangs", hang, (), 60)] * 3]):
            raise KeyboardInterrupt
    assert not running._live


def test_a_survivor_a_killed_equivalent_a_red_control_and_a_broken_trial_are_faults(monkeypatch):
    monkeypatch.setattr(command, "EQUIVALENT", {"m same": "a reason"})
    good = [
        Outcome("m a", End.KILLED, "t"),
        Outcome("m b", End.TIMEOUT, "9 s"),
        Outcome("m same", End.SURVIVED, ""),
        Outcome("m as it is", End.SURVIVED, ""),
    ]
    assert list(command.faults(good)) == []
    bad = [
        Outcome("m a", End.SURVIVED, ""),
        Outcome("m same", End.KILLED, "t"),
        Outcome("m as it is", End.KILLED, "t"),
        Outcome("m b", End.BROKEN, "no"),
    ]
    assert list(command.faults(bad)) == [
        "m a: no test notices",
        "m same: listed as equivalent, but killed: t",
        "m as it is: not a mutant, but killed: t",
        "m b: no",
    ]


# -- the tables ----------------------------------------------------------------------------------------------------


def test_every_row_of_the_fault_table_has_a_detector_that_is_disabled():
    assert {trial.arguments[0] for trial in detectors()} == set(BY_NAME)


def test_every_transition_is_removed_and_led_elsewhere_and_the_source_still_says_what_it_said():
    (target,) = (each for each in TARGETS if each.module == "protocol.tables.modes")
    made = [trial for trial in mutants(target) if trial.arguments[1].startswith(source_of("protocol.tables.modes"))]
    assert len(made) == 2 * len(TRANSITIONS)
    for k, row in enumerate(TRANSITIONS):
        removed, changed = (_transitions(trial.arguments[1]) for trial in made[2 * k : 2 * k + 2])
        assert removed == TRANSITIONS[:k] + TRANSITIONS[k + 1 :]
        assert [n for n, (a, b) in enumerate(zip(changed, TRANSITIONS, strict=True)) if a != b] == [k]
        assert changed[k] == row._replace(next=changed[k].next)


def _transitions(source):
    space = {"__name__": "mutant_of_modes"}
    exec(compile(source, "modes.py", "exec", dont_inherit=True), space)
    return space["TRANSITIONS"]


def test_names_are_unique_and_every_equivalent_mutant_is_one():
    made = [each.name for target in TARGETS for each in mutants(target)]
    assert len(set(made)) == len(made)
    assert set(EQUIVALENT) <= set(made) and all(EQUIVALENT.values())


def test_mutants_are_listed_by_a_word_and_an_unknown_word_is_a_usage_error():
    listed = CliRunner().invoke(command.app, ["--list", "--only", "detector WHEEL_STALE"])
    assert listed.stdout == "detector WHEEL_STALE: wheel_stale\n"
    assert CliRunner().invoke(command.app, ["--only", "no such mutant"]).exit_code == 2
