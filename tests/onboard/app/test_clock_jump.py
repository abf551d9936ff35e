"""The system's clock jumps by years: nothing moves, for nothing on board is timed by it."""

import ast
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from onboard.records import Health
from tests.onboard.app.test_service import Manager
from tests.onboard.app.test_wall_clock import alone, command
from tests.onboard.core_bench import CoreBench

ROOT = Path(__file__).parents[3]
TEN_YEARS_S = 315_360_000
# the C library's clock as it is after somebody has set it by what a file says; CLOCK_MONOTONIC goes on as before
SHIM = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
int clock_gettime(clockid_t which, struct timespec *at)
{
    static int (*real)(clockid_t, struct timespec *);
    if (!real)
        real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int said = real(which, at);
    FILE *file = which == CLOCK_REALTIME ? fopen(getenv("CLOCK_SET_BY"), "r") : NULL;
    long seconds = 0;
    if (file) {
        if (fscanf(file, "%ld", &seconds) == 1)
            at->tv_sec += seconds;
        fclose(file);
    }
    return said;
}
"""


@pytest.mark.parametrize("jump_s", [TEN_YEARS_S, -TEN_YEARS_S], ids=["forward", "back"])
def test_whatever_the_time_of_day_says_the_rover_moves_as_without_and_its_scanner_is_asked_the_same(jump_s):
    def flown(jump_s):
        rover, moves = CoreBench(), []
        rover.settle()
        rover.order("drive", vx_mps=0.1, vy_mps=0.0, yaw_radps=0.0, duration_s=4.0, distance_m=2.0)
        for n in range(500):
            utc_s = 1_790_000_000 + n // 100 + (jump_s if n > 200 else 0)
            rover.health = Health(utc_ns=utc_s * 10**9)
            rover.step()
            moves.append((rover.outputs.can_frames, rover.outputs.lidar_bytes, rover.outputs.pose))
        assert rover.pose[0] > 0.2
        return moves

    assert flown(jump_s) == flown(0)


# ages of frames by the kernel's stamps, bounded (test_can_bus); and the names of exported maps
READ_IT = {"onboard/drivers/can/socketcan.py", "onboard/bringup/maps/map_command.py"}
GENERATED = {"protocol/generated/eldorado_dialect.py"}  # of pymavlink; what asks there is not called


def test_no_other_part_of_the_flight_program_asks_for_the_time_of_day():
    asks = {
        "time.time",
        "time.time_ns",
        "time.localtime",
        "time.gmtime",
        "time.ctime",
        "time.strftime",
        "time.asctime",
        "datetime.now",
        "datetime.utcnow",
        "datetime.today",
        "date.today",
    }
    found = set()
    for package in ("onboard", "protocol"):
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name | ast.Attribute):
                    owner = node.value.id if isinstance(node.value, ast.Name) else node.value.attr
                    if f"{owner}.{node.attr}" in asks:
                        found.add(str(path.relative_to(ROOT)))
                if isinstance(node, ast.ImportFrom) and node.module in ("time", "datetime"):
                    found |= {str(path.relative_to(ROOT)) for alias in node.names if f"time.{alias.name}" in asks}
    assert found - GENERATED == READ_IT


@pytest.fixture(scope="module")
def shim(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clock")
    (folder / "clock.c").write_text(SHIM)
    words = ["gcc", "-shared", "-fPIC", "-O1", "-o", folder / "clock.so", folder / "clock.c", "-ldl"]
    subprocess.run(words, check=True)
    return folder / "clock.so"


def test_the_daemon_ticks_on_when_the_systems_clock_is_set_forward_and_back_by_ten_years(tmp_path, shim):
    manager, offset = Manager(str(tmp_path / "notify")), tmp_path / "offset"
    offset.write_text("0")
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "LD_PRELOAD": str(shim),
        "CLOCK_SET_BY": str(offset),
        "NOTIFY_SOCKET": str(tmp_path / "notify"),
        "WATCHDOG_USEC": "4000000",
    }
    asked = [sys.executable, "-c", "import time; print(time.time())"]
    before_s = float(subprocess.run(asked, env=environment, capture_output=True, check=True).stdout)
    program = subprocess.Popen(command("run", **alone(tmp_path / "r.mcap")), cwd=ROOT, env=environment)
    try:
        assert manager.heard()["READY"] == "1"
        for jump_s in (TEN_YEARS_S, -TEN_YEARS_S):
            offset.write_text(str(jump_s))
            for _ in range(3):
                words = manager.heard()
                assert words["WATCHDOG"] == "1" and int(words["STATUS"].rsplit(" ", 1)[1]) < 100_000
        after_s = float(subprocess.run(asked, env=environment, capture_output=True, check=True).stdout)
        assert before_s - after_s > TEN_YEARS_S - 3600.0  # the clock did jump
        program.send_signal(signal.SIGTERM)
        assert program.wait(30) == 0
    finally:
        program.kill()
        program.wait()
        manager.socket.close()
