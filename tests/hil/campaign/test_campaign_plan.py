"""Plans of campaigns: what a knob may be, what a bad plan is told, and that draws depend on plan and case alone."""

import math
from collections import Counter

import numpy as np
import pytest

from hil.campaign.case import built, case_of, drawn_ground, seen_from_orbit
from hil.campaign.plan import GroundKnobs, OrbitKnobs, check_cases, drawn, find_plan, load_plan, plan_names, plan_of
from hil.terrain.grounds import flat_field
from onboard.config import ConfigError, Rover

HEAD = {"name": "p", "cases": 200, "seed": 5}


def plan(**tables):
    return plan_of({**HEAD, **tables}, "p.toml")


def column(made, knob):
    return [drawn(made, number)[knob] for number in range(1, made.cases + 1)]


def test_a_uniform_knob_fills_its_range_evenly():
    values = np.array(column(plan(lidar={"lost_ratio": {"uniform": [0.1, 0.3]}}), "lidar.lost_ratio"))
    assert values.min() >= 0.1 and values.max() <= 0.3
    quarters = np.histogram(values, 4, (0.1, 0.3))[0]
    assert all(abs(count - 50) < 3.5 * math.sqrt(50 * 0.75) for count in quarters)  # binomial, 3.5 sigma


def test_a_normal_knob_has_its_mean_and_sigma_and_stays_within_four_of_them():
    values = np.array(column(plan(build={"wheel_radius_ratio": {"normal": [1.0, 0.01]}}), "build.wheel_radius_ratio"))
    assert abs(values.mean() - 1.0) < 3.5 * 0.01 / math.sqrt(200)
    assert 0.008 < values.std() < 0.012 and np.abs(values - 1.0).max() <= 0.04


def test_a_truncated_normal_knob_stays_within_its_ends():
    law = {"normal": [0.01, 0.05], "low": 0.0, "high": 0.02}
    values = column(plan(lidar={"lost_ratio": law}), "lidar.lost_ratio")
    assert min(values) >= 0.0 and max(values) <= 0.02


@pytest.mark.parametrize(("low", "high"), [(0.01, 0.01), (0.00999, 0.01001), (0.01, 0.0112)])
def test_a_normal_knob_whose_ends_hold_nearly_nothing_is_refused(low, high):
    """Of a normal distribution 0.96 % lie from its mean to 0.024 sigma, by the table of the error function."""
    with pytest.raises(ConfigError, match=r"p\.toml: `lidar\.lost_ratio`\.normal: between low = .* at least"):
        plan(lidar={"lost_ratio": {"normal": [0.01, 0.05], "low": low, "high": high}})


@pytest.mark.parametrize(("sigma", "low", "high"), [(0.05, 0.01, 0.0113), (0.0, 0.01, 0.01), (1e-9, 0.0, 0.01)])
def test_a_normal_knob_whose_ends_hold_a_hundredth_is_drawn(sigma, low, high):
    law = {"normal": [0.01, sigma], "low": low, "high": high}
    assert low <= min(column(plan(lidar={"lost_ratio": law}), "lidar.lost_ratio")) <= high


def test_a_choice_follows_its_weights_and_an_integer_takes_both_ends():
    made = plan(
        mission={"soil": {"choice": ["firm", "soft"], "weights": [3, 1]}},
        lidar={"clump_least_beams": {"integer": [2, 4]}},
    )
    soils = Counter(column(made, "mission.soil"))
    assert abs(soils["firm"] - 150) < 3.5 * math.sqrt(200 * 0.75 * 0.25)
    assert set(column(made, "lidar.clump_least_beams")) == {2, 3, 4}


def test_a_fault_with_a_share_occurs_in_that_share_of_the_cases():
    row = {"share": 0.25, "fault": "imu_silent", "when": "drive", "after_s": {"uniform": [1.0, 5.0]}}
    made = plan(faults=[row])
    values = [drawn(made, number) for number in range(1, 201)]
    occurs = sum("faults.1.fault" in each for each in values)
    assert abs(occurs - 50) < 3.5 * math.sqrt(200 * 0.25 * 0.75)
    assert all(("faults.1.after_s" in each) == ("faults.1.fault" in each) for each in values)


def test_a_case_depends_on_seed_and_number_only_and_not_on_the_other_knobs():
    one = {"lidar": {"lost_ratio": {"uniform": [0, 0.1]}}}
    alone, beside = plan(**one), plan(**one, build={"wheel_radius_ratio": {"uniform": [0.9, 1.1]}})
    assert drawn(alone, 17)["lidar.lost_ratio"] == drawn(beside, 17)["lidar.lost_ratio"]
    assert drawn(alone, 17) == drawn(alone, 17) != drawn(alone, 18)
    assert drawn(plan_of({**HEAD, **one, "seed": 6}, "p"), 17) != drawn(alone, 17)


def test_the_identity_of_a_plan_is_that_of_its_draws_not_of_name_or_number_of_cases():
    one = plan()
    assert one.sha256 == plan_of({**HEAD, "name": "q", "cases": 3}, "q.toml").sha256
    assert one.sha256 != plan(mission={"soil": "firm"}).sha256 != plan_of({**HEAD, "seed": 6}, "p").sha256


@pytest.mark.parametrize(("tables", "words"), [
    ({"lidra": {}}, ("unknown key `lidra`", "`lidar`")),
    ({"lidar": {"lost_rato": 0.1}}, ("`lidar.lost_rato`", "`lidar.lost_ratio`")),
    ({"lidar": {"lost_ratio": {"unifrom": [0, 1]}}}, ("`lidar.lost_ratio`", "`uniform`")),
    ({"lidar": {"lost_ratio": {"uniform": [0.0, 1.5]}}}, ("`lidar.lost_ratio` = 1.5", "0 to 1")),
    ({"lidar": {"lost_ratio": {"normal": [0.01, 0.01]}}}, ("`lidar.lost_ratio` = -0.03", "0 to 1")),
    ({"lidar": {"lost_ratio": {"uniform": [0.2, 0.1]}}}, ("uniform", "0.2, 0.1")),
    ({"lidar": {"lost_ratio": {"uniform": [0.2]}}}, ("two numbers",)),
    ({"lidar": {"lost_ratio": {"uniform": [0.1, 0.2], "low": 0}}}, ("unknown key `low`", "`uniform`")),
    ({"lidar": {"lost_ratio": {"normal": [0.1, 0.1], "low": 0.2}}}, ("low", "0.2")),
    ({"lidar": {"lost_ratio": {"choice": []}}}, ("list of values",)),
    ({"mission": {"soil": {"choice": ["firm", "sotf"]}}}, ("`mission.soil` = 'sotf'", "'soft'")),
    ({"mission": {"soil": {"choice": ["firm"], "weights": [1, 2]}}}, ("weights", "1 numbers")),
    ({"mission": {"seed": {"uniform": [1, 9]}}}, ("`mission.seed` should be int",)),
    ({"mission": {"terrain": "fmb"}}, ("`mission.terrain`", "'fbm'")),
    ({"set": {"mission": {"stratgy": "explore"}}}, ("`mission.stratgy`", "`mission.strategy`")),
    ({"set": {"mission": {"strategy": {"chocie": ["explore"]}}}}, ("`set.mission.strategy`", "`choice`")),
    ({"sensors": {"imu": {"lever_x_m": {"uniform": [0, 9]}}}}, ("`sensors.imu.lever_x_m` = 9", "-3 to 3")),
    ({"faults": [{"fault": "imu_silnt"}]}, ("`faults.1.fault`", "`imu_silent`")),
    ({"faults": [{"fault": "imu_silent", "share": 1.5}]}, ("`faults.1.share` = 1.5", "0 to 1")),
    ({"faults": [{"when": "drive"}]}, ("`faults.1.fault` is missing",)),
    ({"faults": [{"fault": "wheel_silent"}]}, ("`faults.1.target` is missing", "wheel_silent", "1 to 4")),
    ({"faults": [{"fault": "wheel_silent", "target": 9}]}, ("`faults.1.target` = 9", "1 to 4")),
    ({"faults": [{"fault": "steer_stuck", "target": {"integer": [0, 4]}}]}, ("`faults.1.target` = 0", "1 to 4")),
    ({"faults": [{"fault": {"choice": ["imu_silent", "pot_offset"]}}]}, ("`faults.1.target` is missing", "pot_offset")),
    ({"faults": [{"fault": "node_twice", "target": 8}]}, ("`faults.1.target` = 8", "0 to 7")),
    ({"faults": [{"fault": "can_lose", "target": 101}]}, ("`faults.1.target` = 101", "1 to 100")),
    ({"faults": [{"fault": "onboard_restarted"}]}, ("`faults.1.fault`",)),
    ({"cases": 0}, ("`cases` = 0", "1 to")),
    ({"seed": "x"}, ("`seed` should be int",)),
    ({"name": "../x"}, ("`name`",)),
])  # fmt: skip
def test_a_bad_plan_is_told_file_key_value_and_what_is_meant(tables, words):
    with pytest.raises(ConfigError) as caught:
        plan(**tables)
    text = str(caught.value)
    assert text.startswith("p.toml: ") and "\n" not in text
    assert [word for word in words if word not in text] == []


@pytest.mark.parametrize("row", [
    {"fault": {"choice": ["wheel_silent", "imu_silent"]}, "target": {"integer": [1, 4]}}, {"fault": "no_grip"},
    {"fault": "node_foreign"}, {"fault": "can_babble", "target": {"choice": [0, 2047]}}, {"fault": "ground_collapse"},
])  # fmt: skip
def test_a_fault_may_have_the_targets_that_it_needs_and_any_that_it_does_not(row):
    assert drawn(plan(faults=[row]), 1)["faults.1.fault"] in ("wheel_silent", "imu_silent", row["fault"])


def test_keys_of_the_scanner_that_need_each_other_are_checked_together_in_each_case():
    sector = {"sun_ratio": 0.5, "sun_from_rad": {"uniform": [0.0, 1.0]}, "sun_to_rad": {"uniform": [0.5, 2.0]}}
    check_cases(plan(lidar=sector))
    with pytest.raises(ConfigError, match=r"p\.toml.*sun_ratio.*case 1"):
        check_cases(plan(lidar={"sun_ratio": 0.5}))
    clumps = {"clump_least_beams": {"integer": [1, 20]}, "clump_most_beams": {"integer": [10, 30]}}
    with pytest.raises(ConfigError, match=r"clump_least_beams = \d+ is more.* \(case \d+\)"):
        check_cases(plan(lidar=clumps))


@pytest.mark.parametrize("name", plan_names())
def test_the_benchs_own_plans_are_called_as_their_files_and_every_case_is_allowed(name):
    made = load_plan(find_plan(name))
    assert made.name == name and made.about
    check_cases(made)


def test_a_file_here_goes_before_a_plan_of_the_bench(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert find_plan("first").parent.name == "plans"
    (tmp_path / "first").touch()
    assert find_plan("first").resolve() == tmp_path / "first"


def test_a_plan_file_is_called_by_its_name_and_needs_the_number_of_cases(tmp_path):
    path = tmp_path / "first.toml"
    path.write_text("cases = 3\n")
    assert load_plan(path).name == "first"
    path.write_text("seed = 3\n")
    with pytest.raises(ConfigError, match="`cases` is missing"):
        load_plan(path)
    path.write_text("cases = \n")
    with pytest.raises(ConfigError, match="not valid TOML"):
        load_plan(path)


def test_the_values_of_a_case_reach_scenario_and_rover():
    made = case_of(
        plan(
            mission={"terrain": "flat", "soil": "soft", "limit_s": 50, "blackout_from_s": 10, "blackout_for_s": 5},
            lidar={"lost_ratio": 0.2},
            sensors={"imu": {"lever_x_m": 0.1}},
            set={"mission": {"strategy": "explore"}},
            faults=[{"fault": "wheel_silent", "target": 2, "after_s": 3.0}],
            build={"wheel_radius_ratio": 1.02, "steer_2_rad": 0.1},
        ),
        4,
    )
    scenario = made.scenario
    assert (scenario.terrain, scenario.seed, scenario.soil, scenario.limit_s) == ("flat", 8, "soft", 50)
    assert scenario.blackout_s == (10, 15) and scenario.lidar == {"lost_ratio": 0.2}
    assert scenario.sensors == {"imu": {"lever_x_m": 0.1}} and scenario.set == {"mission.strategy": "explore"}
    assert (scenario.faults[0].fault, scenario.faults[0].target, scenario.faults[0].after_s) == ("wheel_silent", 2, 3.0)
    assert made.built.wheel_radius_m == pytest.approx(1.02 * Rover().wheel_radius_m)
    assert made.built.steer_2_offset_rad == pytest.approx(0.1)


def test_a_plan_without_build_errors_flies_the_drawing_and_assembly_draws_them():
    assert built({}, 1) is None
    assert built({"assembly": True}, 1) != built({"assembly": True}, 2) != Rover()


def test_a_drawn_ground_has_the_slopes_rocks_and_goal_that_were_asked():
    knobs = GroundKnobs(median_slope_deg=6.0, rocks_ratio=0.05, goal_m=8.0, goal_bearing_deg=20.0)
    field = drawn_ground(knobs, 3)
    assert field.stats["median_slope_deg"] == pytest.approx(6.0, abs=0.1)
    assert math.hypot(*field.goal_m) == pytest.approx(8.0)
    assert math.degrees(math.atan2(field.goal_m[1], field.goal_m[0])) == pytest.approx(20.0)
    assert field.rocks and not drawn_ground(GroundKnobs(rocks_ratio=0.0), 3).rocks
    tilted = drawn_ground(GroundKnobs(median_slope_deg=0.01, rocks_ratio=0.0, tilt_deg=10.0, tilt_towards_deg=90.0), 3)
    rise = (tilted.soil_z[300, 200] - tilted.soil_z[100, 200]) / (200 * tilted.grid.cell_m)
    assert math.degrees(math.atan(rise)) == pytest.approx(10.0, abs=0.1)  # along y


def test_errors_of_the_orbiters_map_leave_the_ground_alone():
    field = flat_field(1).field
    seen = seen_from_orbit(field, OrbitKnobs(shift_x_m=3.0, offset_m=7.0, noise_m=2.0, missing_ratio=0.25), 9)
    heights = seen.gdem.heights_m
    assert seen.gdem.grid.x0_m == field.gdem.grid.x0_m + 3.0 and seen.soil_z is field.soil_z
    assert abs(np.isnan(heights).mean() - 0.25) < 3.5 * math.sqrt(0.25 * 0.75 / heights.size)
    assert np.nanmean(heights) == pytest.approx(7.0, abs=0.5) and np.nanstd(heights) == pytest.approx(2.0, rel=0.2)
    assert np.array_equal(seen_from_orbit(field, OrbitKnobs(), 9).gdem.heights_m, field.gdem.heights_m)
