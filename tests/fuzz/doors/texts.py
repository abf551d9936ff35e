"""Doors of the files that people write or load: orbiter's maps, elevation files, configurations, scenarios."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from rasterio import Affine
from rasterio.io import MemoryFile

from hil.scenarios.model import load_scenario
from onboard.bringup.maps.dem_file import Reading, open_dem
from onboard.bringup.maps.dem_words import DemError
from onboard.config import ConfigError, load
from onboard.config_text import to_toml
from onboard.maps.gdem_file import GdemError, from_npz, to_npz
from onboard.records import Gdem, Grid
from tests.fuzz.damage import Rng
from tests.fuzz.door import Door

MOST_LINE = 2000
SCENARIOS = tuple(sorted((Path(__file__).parents[3] / "hil" / "scenarios" / "data").glob("*.toml")))
SUFFIXES = (".tif", ".asc", ".img", ".npy")


def one_line(error: Exception) -> None:
    """Assert that an error is one line of readable length."""
    text = str(error)
    assert text and "\n" not in text and len(text) < MOST_LINE, f"{len(text)} characters: {text[:200]!r}"


# -- the orbiter's map: a zip, its first byte says which member the rest replaces ------------------------------------


@cache
def _members() -> tuple[tuple[str, bytes], ...]:
    heights = np.linspace(-9, 9, 12, dtype=np.float32).reshape(3, 4)
    with zipfile.ZipFile(io.BytesIO(to_npz(Gdem(Grid(-5.0, -5.0, 0.5, 3, 4), heights, "made")))) as sound:
        return tuple((name, sound.read(name)) for name in sound.namelist())


def _made_gdem(rng: Rng) -> bytes:
    rows, columns = (int(n) for n in rng.integers(2, 12, 2))
    heights = rng.uniform(-9, 9, (rows, columns)).astype(np.float32)
    whole = to_npz(Gdem(Grid(-5.0, -5.0, float(rng.choice((0.5, 10.0))), rows, columns), heights, "made"))
    which = int(rng.integers(0, len(_members()) + 1))
    return bytes([which]) + (_members()[which][1] if which < len(_members()) else whole)


def _feed_gdem(data: bytes) -> None:
    which, rest = data[:1], data[1:]
    number = which[0] if which else 255
    if number < len(_members()):
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as made:
            for k, (name, sound) in enumerate(_members()):
                made.writestr(name, rest if k == number else sound)
        rest = buffer.getvalue()
    try:
        found = from_npz(rest)
    except GdemError as error:
        one_line(error)
        return
    known = found.heights_m[np.isfinite(found.heights_m)]
    assert found.heights_m.dtype == np.float32 and known.size and np.abs(known).max() <= 1e7
    assert np.isfinite([found.grid.x0_m, found.grid.y0_m, found.grid.cell_m]).all()


# -- elevation files: the first byte says how the file is named --------------------------------------------------------


@cache
def _elevations() -> tuple[bytes, ...]:
    heights = np.linspace(0, 5, 30, dtype=np.float32).reshape(5, 6)
    with MemoryFile() as memory:
        with memory.open(
            driver="GTiff",
            height=5,
            width=6,
            count=1,
            dtype="float32",
            crs="EPSG:32654",
            transform=Affine(10.0, 0.0, 5e5, 0.0, -10.0, 4.2e6),
        ) as file:
            file.write(heights, 1)
        geotiff = memory.read()
    rows = "\n".join(" ".join(f"{height:.2f}" for height in row) for row in heights)
    text = f"ncols 6\nnrows 5\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n{rows}\n".encode()
    array = io.BytesIO()
    np.save(array, heights)
    label = (
        b"PDS_VERSION_ID = PDS3\r\nRECORD_TYPE = FIXED_LENGTH\r\nRECORD_BYTES = 24\r\nFILE_RECORDS = 25\r\n"
        b"^IMAGE = 21\r\nOBJECT = IMAGE\r\n LINES = 5\r\n LINE_SAMPLES = 6\r\n SAMPLE_TYPE = PC_REAL\r\n"
        b" SAMPLE_BITS = 32\r\nEND_OBJECT = IMAGE\r\nEND\r\n"
    )
    return geotiff, text, label.ljust(20 * 24) + heights.tobytes(), array.getvalue()


def _made_dem(rng: Rng) -> bytes:
    which = int(rng.integers(0, len(SUFFIXES)))
    return bytes([which]) + _elevations()[which]


def _feed_dem(data: bytes) -> None:
    suffix = SUFFIXES[data[0] % len(SUFFIXES)] if data else ".tif"

    def read(path: Path) -> None:
        with open_dem(path, Reading(cell_m=5.0)) as dem:
            assert dem.projection and dem.rows > 0 and dem.columns > 0
            height, width = min(dem.rows, 64), min(dem.columns, 64)
            heights = dem.read(0, 0, height, width)
            assert heights.shape == (height, width) and heights.dtype == np.float64

    _as_file(f"dem{suffix}", data[1:], read, DemError)


# -- texts ---------------------------------------------------------------------------------------------------------


def _as_file(name: str, data: bytes, read: Callable[[Path], None], refused: type[Exception]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(data)
        try:
            read(path)
        except refused as error:
            one_line(error)


def _made_config(rng: Rng) -> bytes:
    lines = to_toml(load()).splitlines(keepends=True)
    first = int(rng.integers(0, len(lines)))
    return "".join(lines[first : first + int(rng.integers(1, 61))]).encode()


def _load_scenario(path: Path) -> None:
    found = load_scenario(path)
    assert "/" not in found.name and ".." not in str(found.set.get("record.path", ""))


GDEM = Door(_made_gdem, _feed_gdem)
DEM = Door(_made_dem, _feed_dem)
CONFIG = Door(_made_config, lambda data: _as_file("rover.toml", data, lambda path: void(load(path)), ConfigError))
SCENARIO = Door(
    lambda rng: SCENARIOS[int(rng.integers(0, len(SCENARIOS)))].read_bytes(),
    lambda data: _as_file("s.toml", data, _load_scenario, ConfigError),
)


def void(_answer: object) -> None:
    """Discard an answer."""
