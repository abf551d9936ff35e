"""The command `hil campaign`: equal tables however it is flown and interrupted, and what it says of what goes wrong."""

import json
import os
import resource
import select
import signal
import subprocess
import sys
from contextlib import chdir, contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from hil.__main__ import app
from hil.campaign.plan import load_plan
from hil.campaign.table import TIMES, CampaignFolder, read_parquet, write_parquet
from tests.hil.campaign_flights import LOG

ROOT = Path(__file__).parents[3]
PLAN = """
cases = 8
seed = 3
[mission]
soil = { choice = ["firm", "soft"] }
[lidar]
lost_ratio = { uniform = [0.0, 0.05] }
"""
LIMIT_S = 120  # of a command that hangs


@pytest.fixture
def place(tmp_path):
    """A folder with a plan, and one for the notes of the flights."""
    (tmp_path / "plan.toml").write_text(PLAN)
    (tmp_path / "flights").mkdir()
    return tmp_path


def words(flies, *more):
    return ["campaign", "plan.toml", "--flies", f"tests.hil.campaign_flights:{flies}", *more]


def surroundings(place):
    return {"PYTHONPATH": str(ROOT), LOG: str(place / "flights")}


def run(place, flies="fly", *more):
    """The command in this process, in the folder of the plan."""
    with chdir(place):
        done = CliRunner().invoke(app, words(flies, *more), env=surroundings(place))
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done


def process_of(place, flies, *more, **how):
    """The command in a process of its own."""
    command = [sys.executable, "-m", "hil", *words(flies, "--workers", "1", *more)]
    how = {"stderr": subprocess.PIPE, "text": True, "cwd": place, "env": {**os.environ, **surroundings(place)}, **how}
    return subprocess.Popen(command, **how)


@contextmanager
def started(place, flies, *more):
    """A campaign in a process of its own, up to the flight of case 4, when the first three cases are stored."""
    process = process_of(place, flies, *more)
    try:
        until(lambda: len(stored(place)) == 3 and flights(place, 4), process)
        yield process
    finally:
        process.kill()
        process.wait()
        process.stderr.close()


def until(done, process):
    while not done():
        assert process.poll() is None, process.stderr.read()
        os.sched_yield()


def stored(place, name="plan"):
    path = place / "build/campaigns" / name / "cases.jsonl"
    return path.read_text().splitlines() if path.exists() else []


def flights(place, number):
    return list((place / "flights").glob(f"{number}-*"))


def table(place, name="plan"):
    """The table without what depends on the time and the process."""
    rows = read_parquet(place / "build/campaigns" / name / "results.parquet")
    return [{key: item for key, item in row.items() if key not in TIMES} for row in rows]


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """The table of the plan flown in one go by one worker."""
    place = tmp_path_factory.mktemp("reference")
    (place / "plan.toml").write_text(PLAN)
    (place / "flights").mkdir()
    done = run(place, "fly", "--workers", "1")
    assert done.exit_code == 0, done.stderr
    return table(place)


def test_two_workers_give_the_table_of_one(place, reference):
    assert run(place, "fly", "--workers", "2").exit_code == 0
    assert table(place) == reference and [row["case_number"] for row in reference] == list(range(1, 9))


def test_equal_rows_give_equal_files(tmp_path, reference):
    files = [write_parquet(tmp_path / name, [dict(row) for row in reference]).read_bytes() for name in ("a", "b")]
    assert files[0] == files[1]


def test_a_campaign_killed_in_the_middle_goes_on_to_the_same_table_and_flies_no_case_twice(place, reference):
    with started(place, "waits") as process:
        process.kill()
        process.wait()
    (place / "flights/go").touch()
    done = run(place, "waits", "--workers", "1")
    assert done.exit_code == 0 and "3 cases are in build/campaigns/plan already; 5 are missing" in done.stderr
    assert table(place) == reference
    assert all(len(flights(place, number)) == 1 for number in (1, 2, 3)) and len(flights(place, 4)) == 2


def test_the_flight_of_a_killed_campaign_ends_with_it(place):
    with started(place, "waits") as process:
        pid = int(flights(place, 4)[0].name.split("-")[1])
        flight = os.pidfd_open(pid)
        process.kill()
        assert select.select([flight], [], [], LIMIT_S)[0]
        os.close(flight)


def test_ctrl_c_ends_a_campaign_with_what_is_stored_and_it_goes_on(place, reference):
    with started(place, "waits") as process:
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=LIMIT_S)
        assert process.returncode == 130 and "3 of 8 cases are stored" in said and "Traceback" not in said
    assert run(place).exit_code == 0
    assert table(place) == reference


def test_half_a_line_at_the_end_is_cut_off_and_its_case_flown_again(place, reference):
    assert run(place).exit_code == 0
    path = place / "build/campaigns/plan/cases.jsonl"
    whole = path.read_bytes()
    path.write_bytes(whole[:-40])
    done = run(place)
    assert done.exit_code == 0 and "7 cases" in done.stderr
    assert table(place) == reference and len(stored(place)) == 8


def test_a_file_in_the_present_folder_is_no_module_of_a_flight(place, reference):
    (place / "tempfile.py").write_text("raise SystemExit('the wrong one')")
    assert run(place).exit_code == 0 and table(place) == reference


def test_the_commands_that_fly_a_failure_again_are_quoted_for_the_shell(place):
    (place / "plan.toml").rename(place / "my plan.toml")
    (place / "my plan.toml").write_text(f'name = "mine"\n{PLAN}')
    with chdir(place):
        words = ["campaign", "my plan.toml", "--flies", "tests.hil.campaign_flights:fly", "--out", "a b"]
        done = CliRunner().invoke(app, words, env=surroundings(place))
    assert done.exit_code == 0 and "`hil case --campaign 'a b' 'my plan.toml' " in done.stdout
    assert "hil case --campaign &#x27;a b&#x27; &#x27;my plan.toml&#x27; " in (place / "a b/report.html").read_text()


def test_cases_of_another_version_are_told(place):
    assert run(place).exit_code == 0
    said = run(place).stderr
    assert "The stored cases were flown by test, this is " in said and "use another folder (--out)." in said


def test_a_case_whose_process_is_killed_is_flown_again(place, reference):
    done = run(place, "killed_once", "--workers", "2")
    assert done.exit_code == 0, done.stderr
    assert table(place) == reference and len(flights(place, 3)) == 2


def test_a_case_that_is_always_killed_is_named_and_the_others_have_table_and_report(place, reference):
    done = run(place, "always_killed", "--workers", "2")
    assert done.exit_code == 70 and "case 2" in done.stderr and "memory" in done.stderr
    assert table(place) == [row for row in reference if row["case_number"] != 2] and len(stored(place)) == 7
    report = place / "build/campaigns/plan/report.html"
    assert "7 of 8 cases" in report.read_text() and "at the goal, of all" in done.stdout
    assert run(place).exit_code == 0 and table(place) == reference
    assert "7 of 8 cases" not in report.read_text()


def test_a_campaign_without_any_row_has_no_table(place):
    (place / "plan.toml").write_text("cases = 1\n")
    done = run(place, "killed")
    assert done.exit_code == 70 and not (place / "build/campaigns/plan/results.parquet").exists()


def test_a_defect_in_a_flight_is_told_with_its_last_words(place):
    done = run(place, "fails")
    assert done.exit_code == 70 and "case 2" in done.stderr and "no such thing" in done.stderr


def test_more_cases_of_the_same_plan_are_added_and_another_plan_is_refused(place, reference):
    assert run(place).exit_code == 0
    (place / "plan.toml").write_text(PLAN.replace("cases = 8", "cases = 10"))
    assert run(place).exit_code == 0 and table(place)[:8] == reference and len(table(place)) == 10
    (place / "plan.toml").write_text(PLAN.replace("0.05", "0.06"))
    done = run(place)
    assert done.exit_code == 78 and "another plan" in done.stderr and "lidar" in done.stderr
    assert len(stored(place)) == 10


def test_a_full_disk_is_named_and_the_cases_before_it_stay(place, reference):
    def small_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

    process = process_of(place, "fly", preexec_fn=small_files)
    _, said = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 74 and "of 8 cases are stored" in said and "Traceback" not in said
    assert 0 < len(stored(place)) < 8 and all(json.loads(line) for line in stored(place))
    assert run(place).exit_code == 0 and table(place) == reference


def test_a_folder_in_use_or_of_something_else_is_refused(place):
    plan = load_plan(place / "plan.toml")
    folder = CampaignFolder(place / "build/campaigns/plan", plan)
    done = run(place)
    assert done.exit_code == 69 and "in use" in done.stderr
    folder.close()
    (place / "other").mkdir()
    (place / "other/letter.txt").touch()
    done = run(place, "fly", "--out", "other")
    assert done.exit_code == 78 and "letter.txt" in done.stderr


def test_a_flight_by_hil_case_and_what_a_killed_start_left_do_not_refuse_the_campaign(place, reference):
    folder = place / "build/campaigns/plan"
    (folder / "case-7").mkdir(parents=True)
    (folder / "case-7/onboard.mcap").touch()
    (folder / ".campaign.json.part").write_text('{"name"')
    done = run(place)
    assert done.exit_code == 0, done.stderr
    assert table(place) == reference


def test_a_file_called_like_a_flight_is_something_else(place):
    (place / "other").mkdir()
    (place / "other/case-7").touch()
    done = run(place, "fly", "--out", "other")
    assert done.exit_code == 78 and "`case-7`" in done.stderr


@contextmanager
def disk_calls(monkeypatch):
    """Names of the files that are written through, and of those that get their names, in order."""
    calls, sync, rename = [], os.fsync, os.replace

    def fsync(descriptor):
        calls.append(("sync", os.path.basename(os.readlink(f"/proc/self/fd/{descriptor}"))))
        sync(descriptor)

    def replace(old, new):
        calls.append(("name", Path(new).name))
        rename(old, new)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", fsync)
        patch.setattr(os, "replace", replace)
        yield calls


def test_the_plan_of_a_folder_is_on_the_disk_before_its_rows_and_is_written_once(place, monkeypatch):
    plan, path = load_plan(place / "plan.toml"), place / "mine"
    with disk_calls(monkeypatch) as calls:
        CampaignFolder(path, plan).close()
        about = [("sync", ".campaign.json.part"), ("name", "campaign.json"), ("sync", "mine")]
        assert calls == [*about, ("sync", "mine")]  # once more for the name of the file of rows
        calls.clear()
        CampaignFolder(path, plan).close()
        assert calls == []
        (place / "plan.toml").write_text(PLAN.replace("cases = 8", "cases = 9"))
        CampaignFolder(path, load_plan(place / "plan.toml")).close()
        assert calls == about


def test_a_scheduler_that_is_not_there_is_named(place, monkeypatch):
    monkeypatch.setattr("hil.campaign.cluster.CONNECT_S", 1)
    done = run(place, "fly", "--scheduler", "tcp://127.0.0.1:1")
    assert (
        done.exit_code == 69 and "no scheduler at tcp://127.0.0.1:1" in done.stderr and "Traceback" not in done.stderr
    )
    done = run(place, "fly", "--scheduler", "nonsense:x")
    assert done.exit_code == 69 and "nonsense" in done.stderr


@pytest.mark.parametrize(("text", "code", "said"), [
    (None, 66, "no plan"), ("cases = 3\n[lidar]\nlost_rato = 1\n", 78, "`lidar.lost_ratio`"), ("x", 78, "TOML"),
])  # fmt: skip
def test_a_bad_plan_ends_with_its_code_and_one_line(place, text, code, said):
    (place / "plan.toml").unlink() if text is None else (place / "plan.toml").write_text(text)
    done = run(place)
    assert done.exit_code == code and said in done.stderr and len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("address", [
    "tls://127.0.0.1:1", "tcp://127.0.0.1:xx", "tcp://127.0.0.1", "tcp://", "ucx://127.0.0.1:1", "inproc://x",
])  # fmt: skip
def test_what_is_no_address_of_a_scheduler_is_one_line(place, address):
    done = run(place, "fly", "--scheduler", address)
    assert done.exit_code == 69 and f"no scheduler at {address}: " in done.stderr and "Traceback" not in done.stderr


def test_a_plan_below_a_file_is_no_plan(place):
    with chdir(place):
        done = CliRunner().invoke(app, ["campaign", "plan.toml/x.toml"])
    assert done.exit_code == 66 and "no plan plan.toml/x.toml" in done.stderr and len(done.stderr.splitlines()) == 1


def test_a_plan_that_may_not_be_read_is_named(place, monkeypatch):
    def read_toml(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("hil.campaign.plan.read_toml", read_toml)
    done = run(place)
    assert done.exit_code == 66 and done.stderr == "hil: plan.toml: Permission denied\n"


@contextmanager
def external_cluster(place, workers):
    """A scheduler and workers of dask in processes of their own; the address."""
    code = (
        "import sys; from distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        f"    with LocalCluster(n_workers={workers}, threads_per_worker=1, dashboard_address='127.0.0.1:0') as made:\n"
        "        print(made.scheduler_address, flush=True)\n"
        "        sys.stdin.read()\n"
    )
    script = place / "scheduler.py"
    script.write_text(code)
    process = subprocess.Popen(
        [sys.executable, str(script)], cwd=place, env={**os.environ, **surroundings(place)}, stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    try:
        yield process.stdout.readline().strip()
    finally:
        process.stdin.close()
        process.wait(LIMIT_S)
        process.stdout.close()


def test_a_scheduler_without_workers_is_waited_for(place):
    from distributed import Client, Worker

    from hil.campaign.cluster import without_workers

    with external_cluster(place, 0) as address, Client(address, set_as_default=False) as client:
        waiting = without_workers(client, every_s=0.01)
        assert [next(waiting) for _ in range(2)] == [None, None]
        worker = client.sync(_started, Worker, address)
        list(waiting)  # ends
        assert len(client.scheduler_info()["workers"]) == 1
        client.sync(worker.close)


async def _started(worker, address):
    return await worker(address, nthreads=1)


def test_a_scheduler_elsewhere_that_loses_a_worker_in_the_middle_gives_the_same_table(place, reference):
    with external_cluster(place, 2) as address:
        done = run(place, "kills_its_worker", "--scheduler", address)
    assert done.exit_code == 0, done.stderr
    assert table(place) == reference and len(flights(place, 3)) == 2


def test_a_case_that_dask_gives_up_counts_each_worker_that_it_took():
    from distributed import KilledWorker

    from hil.campaign.cluster import _ended

    error = KilledWorker("task", None, 2)  # dask allows two failures, and gives up at the third
    ended = _ended(SimpleNamespace(status="error", exception=lambda: error), 1)
    assert (ended.row, ended.losses) == (None, 3) and ended.problem == "case 1: 3 workers were lost with it"
