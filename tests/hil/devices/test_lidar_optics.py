"""What the emulated receiver makes of true ranges: echoes at edges, codes, clusters, and scenes that can be checked."""

import dataclasses

import numpy as np
import pytest

from hil.devices.lidar.light import grazing
from hil.devices.lidar.optics import Optics, echoes
from hil.devices.lidar.profile import IDEAL, UTM30LX_EW
from hil.devices.lidar.scenes import SCENES, Boxes, still
from protocol import scip

NOISELESS = dataclasses.replace(UTM30LX_EW, noise_near_m=0.0, noise_far_m=0.0, grazing_rad=0.0)


def step_scene():
    """2 m, then 5 m, then a post at 1 m one beam before a hole."""
    ranges_m = np.full(1081, 5.0)
    ranges_m[:300] = 2.0
    ranges_m[700], ranges_m[701:800] = 1.0, np.inf
    return ranges_m


def test_the_beam_behind_an_edge_meets_both_sides():
    found = echoes(step_scene())
    assert found[299].tolist()[:1] == [2.0] and np.isnan(found[299, 1:]).all()
    assert sorted(found[300][:2]) == [2.0, 5.0]
    assert np.isnan(found[701, 0]) and np.nanmin(found[701]) == 1.0  # a hole and a post: one echo, of the post
    alone = np.full(1081, 5.0)
    alone[99], alone[101] = 2.0, 3.0
    assert sorted(echoes(alone)[100]) == [2.0, 3.0, 5.0]


def test_scans_of_several_echoes_decode_to_what_was_met_nearest_first():
    optics = Optics(NOISELESS, np.random.default_rng(1), np.random.default_rng(2))
    measured = optics.measure(step_scene())
    for code in ("HD", "HE"):
        asked = scip.ScanRequest(code, 0, 1080)
        frame = scip.scan_reply(asked, asked.line(), 5, optics.values(asked, measured))
        values = scip.parse_scan(scip.parse_reply(frame[:-2]), asked).values
        assert values.shape == (1081, 3, asked.channels)
        assert values[300, :, 0].tolist() == [2000, 5000, scip.MISSING]
        assert values[701, :, 0].tolist() == [1000, scip.MISSING, scip.MISSING]
        assert values[750, :, 0].tolist() == [1, scip.MISSING, scip.MISSING]
        assert ((values[:, 0, 0] > 22) | (values[:, 1, 0] == scip.MISSING)).all()
    md = scip.ScanRequest("MD", 0, 1080)
    assert (optics.values(md, measured)[:, 0] == measured[:, 0]).all()


def test_two_characters_clip_at_4095():
    optics = Optics(NOISELESS, np.random.default_rng(1), np.random.default_rng(2))
    values = optics.values(scip.ScanRequest("MS", 0, 1080), optics.measure(step_scene()))
    assert values[0, 0] == 2000 and values[500, 0] == 4095


def test_a_cluster_is_its_nearest_range_and_a_code_only_if_all_are_codes():
    ranges_m = np.full(1081, np.inf)
    ranges_m[1], ranges_m[2], ranges_m[3] = 4.0, 3.0, 7.0
    optics = Optics(dataclasses.replace(IDEAL, noise_near_m=0.0), np.random.default_rng(1), np.random.default_rng(2))
    values = optics.values(scip.ScanRequest("GE", 0, 8, 3), optics.measure(ranges_m))
    assert values[:, 0].tolist() == [3000, 7000, 1] and values[:, 1].tolist() == [5000, 2500, 0]


def test_a_surface_met_flat_returns_nothing_and_an_edge_does():
    angles = np.deg2rad(np.arange(1081) * 0.25 - 135)
    with np.errstate(divide="ignore"):
        wall = np.where(np.abs(angles) < np.pi / 2, 0.5 / np.cos(angles), np.inf)
    lost = grazing(wall, 0.02)
    met = np.pi / 2 - np.abs(angles)  # the angle between beam and wall
    assert lost[(met > 0) & (met < 0.015)].all() and not lost[met > 0.025].any()
    assert not grazing(step_scene(), 0.02)[[299, 300]].any()


# -- scenes ----------------------------------------------------------------------------------------------------


def faces_met(boxes, origin, way):
    """The nearest point of any of the six faces of any box, one by one."""
    met = [np.inf]
    for box in boxes:
        for axis in range(3):
            for side in box[:, axis]:
                if way[axis] == 0:
                    continue
                range_m = (side - origin[axis]) / way[axis]
                point = origin + range_m * way
                others = [k for k in range(3) if k != axis]
                if range_m >= 0 and all(box[0, k] <= point[k] <= box[1, k] for k in others):
                    met.append(range_m)
    return min(met)


@pytest.mark.parametrize("origin", [(5.0, -5.0, 4.5), (0.1, 0.2, 0.3)])
def test_boxes_agree_with_their_faces_one_by_one(origin):
    rng = np.random.default_rng(5)
    low = rng.uniform(-4, 3, (12, 3))
    boxes = np.stack((low, low + rng.uniform(0.3, 2.0, (12, 3))), axis=1)
    ways = rng.uniform(-4, 4, (300, 3)) - origin
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    ways[:6] = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    found = Boxes(boxes).cast(np.array(origin), ways)
    assert found == pytest.approx([faces_met(boxes, np.array(origin), way) for way in ways])
    assert 20 < np.isfinite(found).sum() < 300


def test_a_ray_within_the_plane_of_a_side_and_one_from_inside():
    cube = Boxes(np.array([[(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)]]))
    ways = np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    assert cube.cast(np.array([-1.0, 0.0, 0.5]), ways).tolist() == [1.0, np.inf]
    assert cube.cast(np.array([0.5, 0.25, 0.5]), ways).tolist() == [0.5, 0.75]


def test_flat_ground_under_a_tilted_scanner_is_where_it_must_be():
    tilt = np.deg2rad(30.0)
    ranges_m = still(SCENES["flat"](), tilt)(np.zeros(1081, np.int64))
    angles = np.deg2rad(np.arange(1081) * 0.25 - 135)
    down = np.cos(angles) * np.sin(tilt)
    seen = down > 1e-3
    assert ranges_m[seen] == pytest.approx(0.5 / down[seen]) and np.isinf(ranges_m[~seen & (down < 0)]).all()


def test_the_room_shows_a_near_post_an_open_door_and_walls():
    ranges_m = still(SCENES["room"]())(np.zeros(1081, np.int64))
    assert ranges_m[540] == np.inf and ranges_m[180] == pytest.approx(3.0)
    assert ranges_m.min() == pytest.approx(0.08, abs=0.002)
    assert np.isfinite(ranges_m).mean() > 0.95


def test_a_field_of_the_bench_is_ground_to_scan():
    ranges_m = still(SCENES["fbm"](), np.deg2rad(20.0))(np.zeros(1081, np.int64))
    assert 0.5 < ranges_m[540] < 5.0
