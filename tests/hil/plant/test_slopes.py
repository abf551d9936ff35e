"""What the soil comes to at the rover: slip over slope, standing on slopes, long drives, the step of the physics."""

import numpy as np
import pytest

from hil.plant.plant import STEP_NS, Plant
from hil.plant.slopes import SLOPES_DEG, inclined, slip
from hil.records import WheelDrive
from onboard.records import Pose
from pictures import slopes as picture
from protocol.conventions import TICK_NS
from tests.hil.small_fields import rough

AHEAD, STILL = (WheelDrive(0.0, 1.1),) * 4, (WheelDrive(0.0, 0.0),) * 4
CAMPAIGN_STEP_NS = 5_000_000
LOADED_N = 0.05 * 40 * 1.62 / 4  # 5 % of a wheel's share of the weight


def rises(slips):
    return bool((np.diff(slips) > -1e-4).all())


def test_slip_rises_with_the_slope_and_with_the_softness():
    slips = [slip("nominal", deg) for deg in (0.0, 10.0, 20.0)]
    assert rises(slips) and slips == pytest.approx([0.013, 0.089, 0.219], abs=0.005)
    assert slip("firm", 10.0) < 0.9 * slips[1] < 0.3 * slip("soft", 10.0)


@pytest.mark.campaign
@pytest.mark.parametrize("soil", ["firm", "nominal", "soft"])
def test_slip_is_monotone_over_all_slopes_of_the_picture(soil):
    assert rises([slip(soil, deg) for deg in SLOPES_DEG])


@pytest.fixture
def plant_on():
    plants = []

    def make(field, **settings):
        plants.append(Plant(field, **settings))
        return plants[-1]

    yield make
    for plant in plants:
        plant.close()


@pytest.mark.parametrize(("soil", "slope_deg"), [("firm", 10), ("nominal", 10), ("nominal", 20)])
def test_a_parked_rover_creeps_under_1_mm_in_its_first_minute(plant_on, soil, slope_deg):
    plant = plant_on(inclined(slope_deg), step_ns=CAMPAIGN_STEP_NS, soil=soil)
    first = plant.step()
    for _ in range(6000):
        last = plant.step()
    assert np.linalg.norm(last.position_m - first.position_m) < 0.001


def test_on_soft_soil_it_first_settles_some_millimetres_and_then_stands(plant_on):
    plant = plant_on(inclined(10), step_ns=CAMPAIGN_STEP_NS, soil="soft")
    places = [plant.step().position_m for _ in range(7000)]
    assert np.linalg.norm(places[999] - places[0]) < 0.010
    assert np.linalg.norm(places[-1] - places[999]) < 0.001


@pytest.mark.parametrize(("step_ns", "seen_ns"), [(STEP_NS, STEP_NS), (CAMPAIGN_STEP_NS, TICK_NS)])
@pytest.mark.parametrize("soil", ["firm", "nominal"])
def test_a_parked_rover_does_not_chatter_at_20_degrees(plant_on, soil, step_ns, seen_ns):
    plant = plant_on(inclined(20), step_ns=step_ns, soil=soil)
    for _ in range(500):
        plant.step()
    felt = np.array([plant.step(seen_ns).specific_force_mps2 for _ in range(500)])
    assert np.ptp(felt, axis=0).max() < 1e-3


@pytest.mark.parametrize("soil", ["firm", "nominal", "soft"])
def test_driving_on_flat_ground_shakes_less_than_0_01_mps2_up_and_down_in_any_step(plant_on, soil):
    plant = plant_on(inclined(0), soil=soil)
    plant.apply(AHEAD)
    for _ in range(300):
        plant.step()
    felt = [plant.step(STEP_NS).specific_force_mps2[2] for _ in range(1000)]
    assert max(felt) - min(felt) < 0.01


def long_drive(plant_on, seed, step_ns):
    """States of 20 m straight over rough ground, median slope 6 degrees."""
    plant = plant_on(rough(seed, side=520, ratio=0.0), step_ns=step_ns)
    plant.reset(Pose(-10.5, 0.0))
    plant.apply(AHEAD)
    states = [plant.step() for _ in range(18_700)]
    way_m = np.linalg.norm(np.diff([state.position_m for state in states], axis=0), axis=1).sum()
    assert way_m > 20
    return states


@pytest.mark.campaign
@pytest.mark.parametrize("seed", [4, 5])
def test_steps_of_5_and_2_ms_end_20_m_within_5_mm_of_1_ms(plant_on, seed):
    ends = [long_drive(plant_on, seed, step_ns)[-1].position_m for step_ns in (1_000_000, 2_000_000, 5_000_000)]
    assert max(np.linalg.norm(end - ends[0]) for end in ends) < 0.005


@pytest.mark.campaign
@pytest.mark.parametrize("seed", [2, 3])
def test_all_wheels_are_loaded_over_99_percent_of_a_rough_20_m(plant_on, seed):
    loads = [[wheel.load_n for wheel in state.wheels] for state in long_drive(plant_on, seed, CAMPAIGN_STEP_NS)]
    assert np.mean(np.min(loads, axis=1) > LOADED_N) > 0.99


def test_the_picture_has_a_line_of_percent_for_each_soil():
    made = picture.slip((0.0, 10.0), {"firm": (0.003, 0.068), "soft": (0.083, 0.441)})
    lines = {line.get_label(): line.get_ydata() for line in made.axes[0].lines}
    np.testing.assert_allclose(lines["soft"], (8.3, 44.1))
    assert [text.get_text() for text in made.axes[0].get_legend().get_texts()] == ["firm", "soft"]
