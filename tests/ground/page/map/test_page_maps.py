"""Pictures of the page's map, the age of its cells, previews, and the link's thread with its orders."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ground.archive.store import Archive
from ground.page.live import orders
from ground.page.live.acknowledged import Acknowledged
from ground.page.live.link import Live
from ground.page.map import layers
from ground.page.map.maps import Maps
from ground.page.past.archive import read_past, thinned, trail
from ground.products.preview import NoMapError
from ground.station.settings import StationSettings
from onboard.records import Gdem, Grid
from protocol.link.bulk import Product
from protocol.products import LDEM_CODEC, LdemProduct, MapGrid, encode_ldem
from protocol.products.height_std import HEIGHT_STD_CODEC, HeightStd, encode_height_std
from protocol.products.pose_map import PoseMap

UTC = 1_700_000_000 * 10**9


def a_map(x0_m=0.05, rise_m=0.0):
    heights = np.arange(30, dtype=np.float32).reshape(5, 6) / 100 + rise_m
    heights[0, 0] = np.nan
    return LdemProduct(MapGrid(x0_m, 0.05, 0.1, 5, 6), heights, np.full((5, 6), 3, np.uint8))


def poses():
    freedom = np.full((8, 5, 6), 2, np.uint8)
    freedom[:, 4, 5] = 0
    return PoseMap(freedom, (0.2, 0.2, 0.0))


def pixels(data):
    return np.asarray(Image.open(io.BytesIO(data)))


@pytest.mark.parametrize("layer", layers.LAYERS)
def test_a_layer_has_a_pixel_for_each_cell_north_up_and_unknown_cells_are_clear(layer):
    std_m = np.where(np.isfinite(a_map().heights_m), np.geomspace(0.001, 0.5, 30).reshape(5, 6), np.nan)
    seen = layers.seen(a_map(), poses(), UTC)._replace(std=HeightStd(a_map().grid, std_m.astype(np.float32)))
    found = pixels(layers.ldem_picture(seen, layer, UTC / 1e9))
    assert found.shape == (5, 6, 4) and layers.legend(layer)
    if layer in ("height", "deviation", "age"):
        assert found[4, 0, 3] == 0 and found[..., 3].sum() == 29 * 255  # row 0 of the map is the southern edge
    assert len({tuple(pixel) for pixel in found.reshape(-1, 4)}) > 1


def test_an_unknown_layer_is_refused_and_names_the_known():
    with pytest.raises(ValueError, match="node sets"):
        layers.ldem_picture(layers.seen(a_map(), None, UTC), "slope", 0.0)


def test_a_cell_keeps_its_time_in_a_map_that_has_moved_and_a_changed_cell_gets_a_new_one():
    first = layers.seen(a_map(), None, UTC)
    heights = np.roll(a_map().heights_m, -2, axis=1)  # the window moved two cells east
    heights[2, 0] += 0.05
    moved = LdemProduct(MapGrid(0.25, 0.05, 0.1, 5, 6), heights, a_map().node_sets)
    second = layers.seen(moved, None, UTC + 10**10, first)
    assert second.utc_s[1, 0] == UTC / 1e9 and second.utc_s[2, 0] == UTC / 1e9 + 10
    assert (second.utc_s[:, 4:][np.isfinite(heights[:, 4:])] == UTC / 1e9 + 10).all()
    assert np.isnan(second.utc_s[~np.isfinite(heights)]).all()


@pytest.mark.parametrize(
    "other",
    [
        MapGrid(0.1, 0.05, 0.1, 5, 6),
        MapGrid(0.05, 0.05, 0.2, 5, 6),
        MapGrid(9.05, 9.05, 0.1, 5, 6),
    ],
)
def test_maps_that_do_not_lie_on_each_other_share_no_ages(other):
    first = layers.seen(a_map(), None, UTC)
    moved = layers.seen(LdemProduct(other, a_map().heights_m, a_map().node_sets), None, UTC + 10**9, first)
    assert np.nanmin(moved.utc_s) == UTC / 1e9 + 1


def test_a_map_of_the_largest_size_is_drawn_and_an_empty_one_too():
    grid = MapGrid(0.0, 0.0, 0.1, 200, 200)
    for heights in (np.zeros((200, 200), np.float32), np.full((200, 200), np.nan, np.float32)):
        seen = layers.seen(LdemProduct(grid, heights, np.zeros((200, 200), np.uint8)), None, UTC)
        assert all(pixels(layers.ldem_picture(seen, one, 0.0)).shape == (200, 200, 4) for one in layers.LAYERS)
    gdem = Gdem(Grid(0.0, 0.0, 0.2, 500, 500), np.zeros((500, 500), np.float32))
    assert pixels(layers.gdem_picture(gdem)).shape == (500, 500, 4)


def test_deviations_are_drawn_in_the_cells_of_a_map_that_has_moved_and_colours_rise_with_them():
    std_m = np.full((5, 6), np.nan, np.float32)
    std_m[2, 2:5] = 0.001, 0.02, 0.5
    maps = Maps(None, None)
    maps.add(Product(1, "height_std", HEIGHT_STD_CODEC, encode_height_std(HeightStd(a_map().grid, std_m))), UTC)
    maps.add(Product(2, "ldem", LDEM_CODEC, encode_ldem(a_map(x0_m=0.25))), UTC)  # two cells further east
    found = pixels(maps.picture(1, "deviation", 0.0))
    assert maps.tree()["ldem"]["deviations"] and np.argwhere(found[..., 3]).tolist() == [[2, 0], [2, 1], [2, 2]]
    assert [tuple(found[2, k, :3]) for k in (0, 2)] == [(0, 32, 77), (255, 234, 70)]
    assert 0 < found[2, 1, 0] < 255


def test_deviations_that_come_after_the_map_raise_the_revision_and_a_damaged_one_leaves_the_old():
    maps = Maps(None, None)
    maps.add(Product(1, "ldem", LDEM_CODEC, encode_ldem(a_map())), UTC)
    assert not maps.tree()["ldem"]["deviations"] and not pixels(maps.picture(1, "deviation", 0.0))[..., 3].any()
    std = HeightStd(a_map().grid, np.full((5, 6), 0.01, np.float32))
    maps.add(Product(2, "height_std", HEIGHT_STD_CODEC, encode_height_std(std)), UTC)
    maps.add(Product(3, "height_std", HEIGHT_STD_CODEC, b"STD1 damaged"), UTC)
    assert maps.tree()["ldem"]["revision"] == 2 and pixels(maps.picture(2, "deviation", 0.0))[..., 3].all()


def test_a_map_from_the_link_raises_the_revision_and_a_damaged_one_leaves_the_old():
    maps = Maps(None, None)
    with pytest.raises(LookupError):
        maps.picture(0, "height", 0.0)
    maps.add(Product(1, "ldem", LDEM_CODEC, encode_ldem(a_map())), UTC)
    maps.add(Product(2, "ldem", LDEM_CODEC, b"LDM1 damaged"), UTC)
    tree = maps.tree()
    assert tree["ldem"]["revision"] == 1 and tree["ldem"]["bounds"] == pytest.approx([0.0, 0.6, 0.0, 0.5])
    assert "ldem" in tree["trouble"] and pixels(maps.picture(1, "height", 0.0)).shape == (5, 6, 4)
    with pytest.raises(NoMapError, match="fetch"):
        maps.preview(1.0, 1.0)  # the map has no poses


@pytest.mark.parametrize(("text", "name"), [
    ("goto 8 3", "goto"), ("ground stop", "stop"), ("reboot --yes", "reboot"), ("get ldem", "get"),
])  # fmt: skip
def test_a_typed_order_is_that_of_the_terminal(text, name):
    found, _, lifetime_s = orders.parsed(text)
    assert found == name and lifetime_s == (60.0 if name == "goto" else 0.0)


@pytest.mark.parametrize(("text", "words"), [
    ("", "goto 8 3"), ("reboot", "--yes"), ("fly 1 2", "fly"), ("goto 1", "y_m"), ('goto "1', "quotation"),
])  # fmt: skip
def test_a_wrong_order_is_refused_with_what_to_do(text, words):
    with pytest.raises(ValueError, match=words):
        orders.parsed(text)


@pytest.mark.parametrize("place", [(None, 1.0), (1.0, None), (float("nan"), 0.0), (float("inf"), 0.0)])
def test_a_goal_that_is_no_place_is_refused(place):
    with pytest.raises(ValueError, match="goal"):
        orders.goto(*place)


def test_the_archive_gives_last_values_events_commands_and_the_trail(tmp_path):
    path = tmp_path / "archive.db"
    with Archive(path, UTC) as archive:
        for n in range(4):
            for name, value in (("x_m", n * 1.0), ("y_m", 2.0)):
                archive.add("items", n * 10**9, n * 10**9, name, value, 1)
        archive.add("events", 10**9, 10**9, 1, "warning", "EVIL", "\x1b[2J<script>", 1)
        archive.add("requests", 10**9, 7, 1, "goto", '{"x_m": 1.0, "y_m": 2.0}', b"", "shell")
        archive.add("reports", 2 * 10**9, 7, 1, 0, "COMPLETED", 0, "there", "[]", 1)
    past = read_past(str(path))
    assert past.values["x_m"] == (3.0, UTC + 3 * 10**9) and past.commands[0].state == "COMPLETED"
    assert past.events[0].name == "EVIL" and "\x1b" not in past.events[0].text
    assert trail(str(path)).tolist() == [[n * 1.0, 2.0] for n in range(4)]


@pytest.mark.parametrize("content", [None, b"", b"no archive at all" * 100])
def test_an_archive_that_is_missing_empty_or_damaged_ends_nothing(tmp_path, content):
    path = tmp_path / "archive.db"
    if content is not None:
        path.write_bytes(content)
    past = read_past(str(path))
    assert not past.values and not past.events and bool(past.trouble) == bool(content)
    assert len(trail(str(path))) == 0
    Maps(None, Path(path)).load()


def test_places_are_thinned_and_no_number_is_left_out():
    assert thinned(np.array([[0, 0], [0.01, 0], [np.nan, 1], [0.2, 0]], float)).tolist() == [[0, 0], [0.2, 0]]


def test_while_the_link_is_closed_only_a_stop_is_taken():
    live = Live(StationSettings(bench_seed=7), lambda *_: None)
    with pytest.raises(ValueError, match="not sent"):
        live.ask("goto", {"x_m": 1.0, "y_m": 2.0}, "test")
    taken = live.ask("stop", {}, "test")
    assert not taken.done()


def test_the_last_acknowledged_events_are_stored_whatever_their_boot(tmp_path):
    path = tmp_path / "seen.json"
    Acknowledged(path).add([f"9-{serial}" for serial in range(5000)])
    Acknowledged(path).add(["10-1", "9-0"])  # before all others by the alphabet
    keys = Acknowledged(path).keys
    assert len(keys) == 5000 and {"10-1", "9-0", "9-2"} <= keys and "9-1" not in keys


def test_acknowledged_events_outlive_the_server_and_a_damaged_file_counts_as_none(tmp_path):
    path = tmp_path / "seen.json"
    Acknowledged(path).add(["1-7"])
    assert Acknowledged(path).keys == {"1-7"} and path.stat().st_mode & 0o777 == 0o600
    path.write_text("{")
    assert not Acknowledged(path).keys
