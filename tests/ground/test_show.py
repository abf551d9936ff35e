"""Lines for people: what is known of the rover, and what of it is out of its limits."""

import pytest

from ground.show import item_line
from protocol.telemetry import TABLE


@pytest.mark.parametrize(("name", "value", "line"), [
    ("computer_temperature_c", 54.0, "computer_temperature_c   54"),
    ("computer_temperature_c", 97.0, "computer_temperature_c   97  out of limits"),
    ("free_disk_mb", 12.5, "free_disk_mb             12.5  out of limits"),
    ("mode", 2.0, "mode                     AUTONOMOUS"),
    ("x_m", 1e4, "x_m                      10000"), ("cpu_ratio", None, "cpu_ratio                ?"),
])  # fmt: skip
def test_an_item_is_a_line_and_marked_where_it_is_out_of_its_limits(name, value, line):
    assert item_line(name, value) == line


def test_every_item_with_limits_can_be_marked():
    for row in TABLE:
        if row.limits is not None:
            assert item_line(row.name, row.limits[0] - 1.0).endswith("out of limits")
