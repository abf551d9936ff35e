"""Tests of the map under scan errors: its counts, and its broken promises."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.missions import __main__ as command
from tests.missions.proofs import commands as proofs
from tests.missions.proofs import map_proof
from tests.missions.proofs.map_proof import MapRow, cases, in_hard_contact, poses_of, shortfalls, summed, sweeps
from tests.missions.tables import put
from tests.missions.world.scanner import scanner
from tests.missions.world.small import quick, world

SMALL = scanner(quick())
ROW = MapRow("campaign", 1, "1 % lost, single", 1000, 900, 990, 890, 3, 3, 0)


def test_dark_ground_returns_nothing_and_is_not_free():
    clear = world()
    dark = replace(clear, dark=np.array([(0.5, 0.0, 0.7)]))
    free, dark_free = (poses_of(SMALL, ground, sweeps(SMALL, ground)).free for ground in (clear, dark))
    middle = np.s_[:, 60:61, 85:86]  # 0.5 m ahead of the origin, the map's centre is the start at (-2, 0)
    assert free[middle].all()
    assert not dark_free[middle].any()
    assert dark_free.sum() < free.sum()


def test_a_sweep_without_errors_keeps_every_pose():
    ground = world()
    seen = sweeps(SMALL, ground)
    grid, free, reach = poses_of(SMALL, ground, seen)
    again = poses_of(SMALL, ground, sweeps(SMALL, ground))
    assert free.sum() > 10_000 and reach.sum() > 10_000
    assert grid == again.grid and np.array_equal(free, again.free) and np.array_equal(reach, again.reachable)


def test_a_pose_that_stands_over_a_wall_is_in_hard_contact_and_one_beside_it_is_not():
    ground = world(boxes=[(0.9, -0.1, 1.1, 0.1)])
    grid = poses_of(SMALL, ground, sweeps(SMALL, ground)).grid
    for x_m, hard in ((1.0, True), (-1.0, False)):
        assert in_hard_contact(ground, grid, np.array([0, *grid.cell(x_m, 0.0)]), SMALL.config) == hard


def test_a_line_is_the_mean_and_the_worst_field_and_false_poses_do_not_make_up_for_lost_ones():
    (line,) = summed(
        [ROW, replace(ROW, seed=2, kept_free=500, kept_reachable=450, false_free=900, looked=400, hard=100)]
    )
    assert line.free == pytest.approx((0.745, 0.5))
    assert line.reachable == pytest.approx(((890 / 900 + 0.5) / 2, 0.5))
    assert line.false_ratio == pytest.approx(903 / 2000)
    assert line.hard_ratio == pytest.approx(100 / 403)


def test_a_case_under_its_promise_falls_short_and_one_without_a_promise_never():
    assert shortfalls(summed([ROW])) == []
    short = shortfalls(summed([replace(ROW, kept_reachable=850)]))
    assert len(short) == 1 and "1 % lost, single" in short[0] and "95 % promised" in short[0]
    assert shortfalls(summed([replace(ROW, case="dark discs", kept_reachable=0)])) == []


def test_the_promises_are_those_of_the_issue():
    promised = {case.name: case.least_ratio for case in cases() if case.least_ratio is not None}
    of_loss = {"0.01 %": 0.98, "0.1 %": 0.98, "1 %": 0.95, "5 %": 0.80}
    for share, least in of_loss.items():
        assert promised.pop(f"{share} lost, single") == promised.pop(f"{share} lost, clumps") == least
    assert set(promised.values()) == {0.95} and len(promised) == 2


def flown(run, seed):
    return tuple(replace(ROW, fields=run.fields, seed=seed, case=case.name) for case in cases())


def lossy(run, seed):
    return tuple(replace(row, kept_reachable=0) for row in flown(run, seed))


@pytest.mark.parametrize(("fly", "code"), [(flown, 0), (lossy, 1)])
def test_the_command_writes_rows_and_table_and_its_exit_code_is_the_promise(tmp_path, monkeypatch, fly, code):
    monkeypatch.setattr(map_proof, "fly", fly)
    monkeypatch.setattr(proofs, "fly_all", lambda fly, runs, workers: (fly(r, s) for r in runs for s in r.seeds))
    said = CliRunner().invoke(command.app, ["map", "--seeds", "1-2", "--out", str(tmp_path)])
    assert said.exit_code == code
    assert "4 of 4: demo 2" in said.output
    assert (tmp_path / "map.json").exists()
    assert "| 1 % lost, single |" in (tmp_path / "map.md").read_text()


def test_a_part_of_the_seeds_does_not_get_into_the_page():
    said = CliRunner().invoke(command.app, ["map", "--seeds", "1", "--docs"])
    assert said.exit_code == 2 and "whole run" in said.output


def test_a_table_takes_its_place_in_a_page_and_a_page_without_one_is_named(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- begin map: how -->\nold\n<!-- end map -->\nafter\n")
    put(page, "map", "| new |\n")
    put(page, "map", "| newer |\n")
    text = page.read_text()
    assert text == "before\n<!-- begin map: how -->\n\n| newer |\n\n<!-- end map -->\nafter\n"
    with pytest.raises(ValueError, match="begin rocks"):
        put(page, "rocks", "")
    assert page.read_text() == text
    assert "<!-- begin map" in proofs.MAPS_PAGE.read_text()
