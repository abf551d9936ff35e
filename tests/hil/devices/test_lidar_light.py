"""Which beams return nothing and which a false range: shares, clumps, grazing, dark, sun, mixed pixels, dust."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hil.devices.lidar.errors import IDEAL, REAL, SETS, LidarErrors, lidar_errors, lidar_table
from hil.devices.lidar.light import BEAM_RAD, Light, Surface, grazing, in_sector, sector
from hil.devices.lidar.optics import NO_RETURN, Optics
from hil.plant.rays.ground_rays import GroundRays
from hil.world.surfaces import Surfaces, asked
from onboard.config import ConfigError
from tests.hil.small_fields import field_of, rough

WALL_M = np.full(1081, 5.0)


def optics(seed=1, **errors):
    """A sensor without noise and with these errors, in mm or codes."""
    profile = replace(LidarErrors(**errors).applied(), noise_near_m=0.0, noise_far_m=0.0)
    return Optics(profile, np.random.default_rng(seed), np.random.default_rng((seed, 3)))


def turns(sensor, count=400, ranges_m=WALL_M, surface=None):
    """(count, 1081) values of the first echo."""
    return np.array([sensor.measure(ranges_m, surface)[:, 0] for _ in range(count)])


def runs(lost):
    """Lengths of the runs of True in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], lost.astype(np.int8), [0]))))
    return edges[1::2] - edges[::2]


@pytest.mark.parametrize("clump_ratio", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("lost_ratio", [0.01, 0.3])
def test_the_share_of_lost_beams_is_the_one_set_however_they_are_clumped(lost_ratio, clump_ratio):
    sensor = optics(lost_ratio=lost_ratio, clump_ratio=clump_ratio)
    lost = turns(sensor, 1500) == NO_RETURN
    assert lost.mean() == pytest.approx(lost_ratio, rel=0.08)
    assert sensor.light.count.lost_ratio == lost.mean() and sensor.light.count.lost["random"] == lost.sum()
    by_beam = lost.mean(axis=0)
    assert by_beam[:40].mean() == pytest.approx(by_beam[500:540].mean(), rel=0.5)  # the rim is met like the middle


def test_clumps_are_as_long_as_set_and_take_their_share():
    lost = turns(optics(lost_ratio=0.002, clump_ratio=1.0, clump_least_beams=4, clump_most_beams=12), 4000) == NO_RETURN
    inside = np.concatenate([runs(row[12:-12]) for row in lost if not (row[:24] | row[-24:]).any()])
    assert inside.min() == 4 and (inside <= 12).mean() > 0.97  # two may overlap
    assert inside.mean() == pytest.approx(8.0, rel=0.08)


def test_an_outlier_is_off_by_no_more_than_set_and_as_often_as_set():
    values = turns(optics(outlier_ratio=0.002, outlier_m=0.4), 1000)
    off = values[values != 5000] - 5000
    assert len(off) / values.size == pytest.approx(0.002, rel=0.1)
    assert -400 <= off.min() < -350 and 350 < off.max() <= 400


def test_a_speck_of_dust_is_near_whatever_stands_behind_it():
    sky = np.full(1081, np.inf)
    for behind_m, code in ((WALL_M, 5000), (sky, NO_RETURN)):
        values = turns(optics(speck_ratio=0.01, speck_m=1.5), 200, behind_m)
        specks = values[values != code]
        assert len(specks) / values.size == pytest.approx(0.01, rel=0.15)
        assert specks.min() >= 100 and specks.max() <= 1500


def test_only_beams_behind_an_edge_are_mixed_and_lie_between_its_sides():
    ranges_m = np.full(1081, 4.0)
    ranges_m[400:500], ranges_m[900:] = 2.0, np.inf  # a post, and at the end the sky: its edge mixes nothing
    sensor = optics(mixed_ratio=0.5)
    values = turns(sensor, 600, ranges_m)
    usual = np.where(np.isinf(ranges_m), NO_RETURN, ranges_m * 1e3)
    beams, counts = np.unique(np.nonzero(values != usual)[1], return_counts=True)
    assert beams.tolist() == [399, 500]  # the far ones beside the post
    assert counts / 600 == pytest.approx(0.5, abs=0.07)
    mixed = values[:, [399, 500]]
    assert mixed.min() >= 2000 and mixed.max() <= 4000 and np.std(mixed[mixed != 4000]) > 400
    assert sensor.light.count.mixed == counts.sum()


def test_the_sun_takes_the_beams_of_its_sector_of_the_map_across_the_x_axis():
    azimuth_rad = (BEAM_RAD + 1.0) % math.tau  # a rover that looks a radian to the left
    sunny = optics(sun_ratio=0.8, sun_from_rad=-0.3, sun_to_rad=0.4)
    lost = turns(sunny, 300, surface=Surface(np.ones(1081), np.full(1081, np.inf), azimuth_rad)) == NO_RETURN
    inside = (azimuth_rad >= math.tau - 0.3) | (azimuth_rad <= 0.4)
    assert lost[:, inside].mean() == pytest.approx(0.8, abs=0.02) and not lost[:, ~inside].any()


def test_a_dirty_window_takes_the_same_directions_of_the_scanner_wherever_the_rover_looks():
    dirty = optics(window_ratio=0.8, window_from_rad=-0.3, window_to_rad=0.4)
    inside = (BEAM_RAD >= -0.3) & (BEAM_RAD <= 0.4)
    for azimuth_rad in (BEAM_RAD, (BEAM_RAD + 1.0) % math.tau):
        lost = turns(dirty, 300, surface=Surface(np.ones(1081), np.full(1081, np.inf), azimuth_rad)) == NO_RETURN
        assert lost[:, inside].mean() == pytest.approx(0.8, abs=0.02) and not lost[:, ~inside].any()


def test_a_sector_of_a_full_turn_or_more_holds_all_directions():
    assert in_sector(BEAM_RAD, 0.0, math.tau).all() and in_sector(BEAM_RAD, -7.0, 7.0).all()


@pytest.mark.parametrize("name", ["sun", "window"])
def test_a_share_of_beams_lost_in_a_sector_without_width_is_refused(name):
    with pytest.raises(ConfigError, match=f"{name}_ratio = 0.5 needs a sector"):
        lidar_errors({f"{name}_ratio": 0.5}, "test")


@pytest.mark.parametrize(("word", "found"), [("lost_ratio", "write lost_ratio=VALUE"), ("=3", "write KEY=VALUE")])
def test_a_word_that_is_no_setting_of_the_scanner_is_refused_with_what_to_write(word, found):
    with pytest.raises(ConfigError, match=found):
        lidar_table([word], {})


def test_the_same_seed_loses_the_same_beams_and_the_ideal_sensor_draws_nothing_for_it():
    real = {"lost_ratio": 0.02, "clump_ratio": 0.5, "outlier_ratio": 0.01, "speck_ratio": 0.01}
    assert (turns(optics(3, **real), 20) == turns(optics(3, **real), 20)).all()
    assert (turns(optics(3, **real), 20) != turns(optics(4, **real), 20)).any()
    drawn = np.random.default_rng(5)
    light = Light(IDEAL.applied(), drawn)
    assert light.lost(WALL_M, None) is None and light.outliers(light.mixed(WALL_M)) is WALL_M
    assert len(light.specks()[0]) == 0 and drawn.random() == np.random.default_rng(5).random()


def test_with_several_echoes_a_lost_beam_returns_none_of_them():
    ranges_m = np.where(np.arange(1081) % 2, 2.0, 6.0)
    real = replace(SETS["utm-30lx-ew"], lost_ratio=1.0).applied()
    lost = Optics(real, np.random.default_rng(1), np.random.default_rng(2)).measure(ranges_m)
    assert (lost[:, 0] == NO_RETURN).all() and lost.shape == (1081, 3) and (lost[:, 1:] < 0).all()


def test_the_counted_beams_are_those_of_the_sector_that_the_rover_maps():
    sensor = optics(lost_ratio=1.0)
    sensor.light.counted = sector(math.radians(65))
    assert (sensor.light.counted.start, sensor.light.counted.stop) == (280, 801)
    ranges_m = WALL_M.copy()
    ranges_m[300:400], ranges_m[400:410] = np.inf, 31.0  # nothing there, and beyond far_m: not due
    sensor.measure(ranges_m)
    assert (sensor.light.count.due, sensor.light.count.lost_ratio) == (521 - 110, 1.0)


# -- what the beams meet on a field --------------------------------------------------------------------------------

LEVEL = field_of(np.zeros((900, 900)))


def looking(field, tilt_rad, at=(0.0, 0.0, 0.7), yaw_rad=0.0):
    """Origins, directions and ranges of a turn whose front looks down, from `at`."""
    x, y = np.cos(BEAM_RAD), np.sin(BEAM_RAD)
    ahead, down = x * math.cos(tilt_rad), -x * math.sin(tilt_rad)
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    directions = np.column_stack((ahead * cosine - y * sine, ahead * sine + y * cosine, down))
    origins = np.broadcast_to(np.array(at), directions.shape).copy()
    return origins, directions, GroundRays(field).cast(origins, directions, 60.0)


def test_level_ground_under_a_scanner_at_0_7_m_begins_to_be_lost_at_8_m_and_is_lost_at_16():
    errors = LidarErrors(grazing_rad=math.radians(5.0))
    surfaces, sensor = Surfaces(LEVEL, errors, 1), optics(grazing_rad=errors.grazing_rad)
    shares = {}
    for far_m in (7.9, 10.0, 12.0, 16.2):
        rays = looking(LEVEL, math.atan2(0.7, far_m))
        shares[far_m] = (turns(sensor, 400, rays[2], surfaces.met(*rays))[:, 540] == NO_RETURN).mean()
    assert shares[7.9] == 0.0 and shares[16.2] == 1.0
    met_sine = {far_m: 0.7 / math.hypot(0.7, far_m) for far_m in shares}
    for far_m in (10.0, 12.0):
        assert shares[far_m] == pytest.approx(2 * (1 - met_sine[far_m] / math.sin(math.radians(5))), abs=0.06)


def test_a_surface_flat_to_the_beam_along_the_tilt_is_lost_though_its_neighbours_in_the_line_do_not_show_it():
    rays = looking(LEVEL, math.radians(2.0))
    ahead = slice(535, 546)
    surface = Surfaces(LEVEL, LidarErrors(grazing_rad=0.1), 1).met(*rays)
    assert surface.sine[540] == pytest.approx(math.sin(math.radians(2.0)), abs=1e-6)
    assert (turns(optics(grazing_rad=0.1), 3, rays[2], surface)[:, ahead] == NO_RETURN).all()
    assert not grazing(rays[2], 0.1)[ahead].any()


def test_a_slope_that_faces_the_scanner_is_met_steeper_than_level_ground():
    x = (np.arange(900) - 449.5) * 0.05
    rising = field_of(np.broadcast_to(np.maximum(x - 3.0, 0.0) * 0.5, (900, 900)).copy())
    rays = looking(rising, math.radians(3.0))
    slope_rad = math.atan(0.5)
    met = Surfaces(rising, REAL, 1).met(*rays)
    assert met.sine[540] == pytest.approx(math.sin(slope_rad + math.radians(3.0)), abs=1e-3)


def on_rock(field, rays):
    """Number of the rock whose solid each hit lies on by a slow plain test, -1: soil."""
    origins, directions, ranges_m = rays
    found = np.full(len(ranges_m), -1)
    bare = field_of(field.soil_z)
    soil_m = GroundRays(bare).cast(origins, directions, 60.0)
    for k in np.flatnonzero(ranges_m < soil_m - 0.02):
        point = origins[k] + ranges_m[k] * directions[k]
        away = [math.hypot(point[0] - rock.x_m, point[1] - rock.y_m) - rock.diameter_m / 2 for rock in field.rocks]
        found[k] = int(np.argmin(away))
    return found


def test_dark_rocks_return_nothing_and_everything_else_does():
    field = rough(3, ratio=0.08)
    errors = LidarErrors(dark_rocks_ratio=0.5)
    surfaces = Surfaces(field, errors, 9)
    assert 0.3 < surfaces.dark.mean() < 0.7 and (surfaces.dark == Surfaces(field, errors, 9).dark).all()
    dark_hits = light_hits = 0
    for yaw_rad in np.arange(0.0, 6.2, 0.7):
        rays = looking(field, 0.35, at=(0.0, 0.0, float(field.soil_z[80, 80]) + 0.7), yaw_rad=yaw_rad)
        values = optics(dark_rocks_ratio=0.5).measure(rays[2], surfaces.met(*rays))[:, 0]
        rock, met = on_rock(field, rays), rays[2] < 30.0
        dark = (rock >= 0) & surfaces.dark[rock] & met
        assert (values[dark] == NO_RETURN).all()
        light = met & (rock >= 0) & ~surfaces.dark[rock]
        assert (values[light] != NO_RETURN).all()
        dark_hits, light_hits = dark_hits + dark.sum(), light_hits + light.sum()
    assert dark_hits > 50 and light_hits > 50


def test_a_dark_patch_is_lost_and_ground_of_a_low_albedo_is_seen_as_far_as_its_root_says():
    rays = looking(LEVEL, math.radians(20.0))
    origins, directions, ranges_m = rays
    points = origins + np.where(np.isfinite(ranges_m), ranges_m, 0)[:, None] * directions
    patch = LidarErrors(dark_patches_m=((1.9, 0.3, 0.4),))
    values = optics().measure(ranges_m, Surfaces(LEVEL, patch, 1).met(*rays))[:, 0]
    inside = np.hypot(points[:, 0] - 1.9, points[:, 1] - 0.3) < 0.4
    assert inside.sum() > 20 and (values[inside] == NO_RETURN).all()
    assert (values[~inside & (ranges_m < 30)] != NO_RETURN).all()
    dim = LidarErrors(ground_albedo=0.01)  # 30 m * 0.1
    seen = optics().measure(ranges_m, Surfaces(LEVEL, dim, 1).met(*rays))[:, 0] != NO_RETURN
    assert (seen == (ranges_m <= 3.0)).all() and 20 < seen.sum() < 1000


def test_what_the_beams_meet_is_looked_up_only_where_it_matters():
    assert not asked(IDEAL) and asked(REAL)
    assert all(
        asked(replace(IDEAL, **changed))
        for changed in (
            {"ground_albedo": 0.5},
            {"rock_albedo": 0.5},
            {"dark_rocks_ratio": 0.1},
            {"grazing_rad": 0.1},
            {"dark_patches_m": ((0.0, 0.0, 1.0),)},
            {"sun_ratio": 0.5, "sun_to_rad": 1.0},
        )
    )
