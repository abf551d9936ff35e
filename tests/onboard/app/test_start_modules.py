"""What a start loads: `onboard run` no other command, before a first tick nothing of other buses or the bench."""

import subprocess
import sys

import pytest
from click.testing import CliRunner

from onboard.__main__ import COMMANDS, app

BENCH = {"pybullet", "viser", "trimesh", "embreex", "matplotlib", "duckdb", "PIL", "prompt_toolkit", "typer", "rich",
         "pymap3d", "pydantic", "pytest", "hil", "ground", "pictures"}  # fmt: skip


def modules(script):
    command = [sys.executable, "-c", f"import sys; {script}; print(*sys.modules)"]
    return set(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split())


@pytest.fixture(scope="module")
def first_tick():
    """All that `onboard run` imports before its first tick on the wall clock, with a record and zenoh for a link."""
    return modules(
        "import onboard.__main__, onboard.app, mcap.writer, transport.zenoh_end; "
        "from onboard.drivers.can.bus import open_bus; open_bus('virtual:start').close(); "
        "from pkgutil import resolve_name; [resolve_name(name) for name in onboard.app.LATER]"
    )


def test_a_first_tick_needs_no_package_of_bench_or_station(first_tick):
    assert not BENCH & {name.partition(".")[0] for name in first_tick}


def test_a_first_tick_loads_no_other_command(first_tick):
    others = {place.partition(":")[0] for place in COMMANDS.values()}
    assert others and not others & first_tick


def test_a_first_tick_loads_no_scipy_but_what_the_jobs_use(first_tick):
    assert {"scipy.ndimage", "scipy.linalg", "small_gicp"} <= first_tick
    assert not {"scipy.stats", "scipy.optimize", "scipy.spatial", "scipy.sparse", "scipy.integrate"} & first_tick


def test_a_bus_loads_its_own_part_of_python_can_alone(first_tick):
    assert "can.interfaces.virtual" in first_tick
    assert not {"can.interfaces.socketcan", "can.interfaces.socketcand", "xml.etree.ElementTree"} & first_tick
    kernel = modules("from onboard.drivers.can.bus import _opener; _opener('socketcan:can0', True)")
    assert "can.interfaces.socketcan" in kernel and "can.interfaces.socketcand" not in kernel


def test_the_configuration_is_printed_without_core_bus_and_scipy():
    loaded = modules("import onboard.__main__")
    assert not {"onboard.core.tick", "can", "scipy"} & loaded


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_of_the_table_is_there_by_its_name(name):
    shown = CliRunner().invoke(app, [name, "--help"], prog_name="onboard")
    assert shown.exit_code == 0 and shown.output.startswith(f"Usage: onboard {name}")


def test_the_list_of_commands_has_all_of_them():
    shown = CliRunner().invoke(app, ["--help"]).output
    assert all(f"\n  {name} " in shown for name in (*COMMANDS, "run"))


def test_a_command_that_is_not_there_is_said_so():
    shown = CliRunner().invoke(app, ["fly"])
    assert shown.exit_code == 2 and "fly" in shown.output
