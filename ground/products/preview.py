"""Preview of a goto: the rover's own planner on the newest fetched map, with the settings that the rover flies.

The map is the product `ldem`. It contains the poses that the rover's planner found free, the rover's place, and a
digest of its settings. Path, length and time are therefore those that the rover itself would answer on that map.
"""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ground.archive.read import Span, newest_product, reading, rows
from ground.archive.schema import ArchiveError
from onboard.config import Config, ConfigError, load
from onboard.maps.gdem_file import read_gdem
from onboard.maps.npz_arrays import check_size
from onboard.parameters import TABLE as PARAMETERS
from onboard.planning.prediction import Prediction, digest, predict
from onboard.records import Gdem
from onboard.toml_text import TomlError, parse_toml
from protocol import WireError
from protocol.products import LdemProduct, MapGrid, decode_ldem, poses_of
from protocol.products.pose_map import PoseMap

_FAR_M = 0.3
_MOST_BYTES = 1 << 29  # of a map file, unpacked
# config sections covered by `digest`
READ = ("rover", "mapping", "planning", "mission", "scanning", "drive_guard", "motion", "jobs")


class NoMapError(ValueError):
    """No map to plan on, or it cannot be read. One line that states what to do.

    code: exit code of sysexits.h.
    """

    def __init__(self, text: str, code: int = 66) -> None:
        super().__init__(text)
        self.code = code


class Map(NamedTuple):
    """Map with its poses.

    product: the elevation map.
    poses: free poses, the rover's pose, digest of the settings.
    where: origin of the map, for people.
    at_utc_ns: UTC of its arrival; 0: not known.
    """

    product: LdemProduct
    poses: PoseMap
    where: str
    at_utc_ns: int = 0


def map_file(path: Path) -> Map:
    """Read a map that `ground get ldem` wrote, as .npz or raw. Raises NoMapError."""
    try:
        data = path.read_bytes()
        if data[:4] == b"LDM1":
            return _map(data, str(path))
        check_size(data, _MOST_BYTES)
        with np.load(io.BytesIO(data)) as file:
            heights = file["heights_m"]
            if "freedom" not in file:
                raise NoMapError(f"{path}: has no poses, it was fetched by an older program: `ground get ldem`", 65)
            grid = MapGrid(float(file["x0_m"]), float(file["y0_m"]), float(file["cell_m"]), *heights.shape)
            x_m, y_m, yaw_rad = (float(number) for number in file["pose"])
            slippery = tuple((x, y) for x, y in file["slippery_m"].tolist())
            poses = PoseMap(
                file["freedom"], (x_m, y_m, yaw_rad), slippery, bool(file["known"]), file["settings"].tobytes()
            )
            return _standing(Map(LdemProduct(grid, heights, file["node_sets"]), poses, str(path)))
    except OSError as error:
        raise NoMapError(f"{path}: {error.strerror or error}") from error
    except (LookupError, ValueError, TypeError, EOFError, MemoryError, zipfile.BadZipFile, zlib.error) as error:
        if isinstance(error, NoMapError):
            raise
        raise NoMapError(f"{path}: no map of `ground get ldem`: {error}", 65) from error


def newest_map(archive: Path) -> Map:
    """Return the newest map of an archive. Raises NoMapError or ArchiveError."""
    with reading(archive) as db:
        found = newest_product(db, "ldem")
    if found is None:
        raise NoMapError(f"{archive}: no map yet; `ground scan`, then `ground get ldem`")
    return _map(found[2], f"the newest map in {archive}")._replace(at_utc_ns=found[0])


def _map(data: bytes, where: str) -> Map:
    try:
        product, poses = decode_ldem(data), poses_of(data)
    except WireError as error:
        raise NoMapError(f"{where}: damaged: {error}", 65) from error
    if poses is None or poses.freedom.shape[1:] != product.heights_m.shape:
        raise NoMapError(f"{where}: without poses, from an older program: `ground get ldem` fetches one with them", 65)
    return _standing(Map(product, poses, where))


def _standing(seen: Map) -> Map:
    """Return the map if the rover stands on it. Raises NoMapError."""
    grid, (x_m, y_m, _) = seen.product.grid, seen.poses.pose
    column, row = (x_m - grid.x0_m) / grid.cell_m, (y_m - grid.y0_m) / grid.cell_m
    if not (-0.5 <= column < grid.columns - 0.5 and -0.5 <= row < grid.rows - 0.5):
        raise NoMapError(f"{seen.where}: the rover stands at {x_m:.2f}, {y_m:.2f}, beside this map", 65)
    return seen


class PreviewSettings(NamedTuple):
    """Settings for the preview.

    config: the settings.
    whose: their origin, for people.
    same: True if their digest equals that of the map: the rover flies them.
    """

    config: Config
    whose: str
    same: bool

    @property
    def warning(self) -> str:
        """Warning that the rover flies other settings; "" if it does not."""
        return (
            ""
            if self.same
            else (
                f"the rover flies other settings than {self.whose}: the real way may differ; "
                "`ground param list` fetches them, or name its file with --config"
            )
        )


def settings_for(seen: Map, config: Path | None, archive: Path | None) -> PreviewSettings:
    """Return the rover's settings.

    Sources: `config`; else the defaults if the map was made with them; else the settings fetched last. Raises
        ConfigError or NoMapError.
    """
    if config is not None:
        try:
            return _flown(seen, load(config), str(config))
        except OSError as error:
            raise NoMapError(f"{config}: {error.strerror}") from error
    default = _flown(seen, load(), "the default settings")
    listed = None if default.same or archive is None else _listed(archive)
    return default if listed is None else fetched(seen, listed) or default


def fetched(seen: Map, listed: bytes) -> PreviewSettings | None:
    """Return the settings from the rover's list of parameters; None if it cannot be read."""
    lines = (
        line[2:].partition("  # ")[0]
        for line in listed.decode(errors="replace").splitlines()
        if line[:2] in ("* ", "  ")
    )
    try:
        named = {
            name.strip(): parse_toml(f"v = {text}")["v"] for name, _, text in (line.partition(" = ") for line in lines)
        }
        config = load(None, named, "the parameters that were fetched")
    except (ConfigError, TomlError):
        return None
    assumed = [name for name in PARAMETERS if name not in named and name.partition(".")[0] in READ]
    more = f" with defaults assumed for {', '.join(assumed)}" if assumed else ""
    return _flown(seen, config, f"the parameters that were fetched last{more}")


def assumed_words() -> str:
    """Return the text that names the assumed defaults, for unknown parameters of the rover."""
    return f"assumed are the defaults of {', '.join(READ)}: `onboard --print-config` shows them"


def _flown(seen: Map, config: Config, whose: str) -> PreviewSettings:
    return PreviewSettings(config, whose, digest(config) == seen.poses.settings)


def _listed(archive: Path) -> bytes | None:
    with reading(archive) as db:
        found = newest_product(db, "parameters")
    return None if found is None else found[2]


def gdem_file(path: Path | None) -> Gdem | None:
    """Read the orbiter's map; None if no path is given. Raises NoMapError."""
    try:
        return None if path is None else read_gdem(path)
    except OSError as error:
        raise NoMapError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise NoMapError(f"{path}: {error}", 65) from error


def look_ahead(seen: Map, goal_m: tuple[float, float], gdem: Gdem | None, config: Config) -> Prediction:
    """Return the prediction on a map.

    It equals the rover's own bit by bit if settings and orbiter's map are the same.
    """
    return predict(seen.product, seen.poses, goal_m, gdem, config)


def warnings(seen: Map, goal_m: tuple[float, float], gdem: Gdem | None, archive: Path | None) -> list[str]:
    """Return what reduces the accuracy of the preview: a goal outside the map, a rover that has moved since."""
    grid, told = seen.product.grid, []
    i, j = (goal_m[0] - grid.x0_m) / grid.cell_m, (goal_m[1] - grid.y0_m) / grid.cell_m
    if gdem is None and not (-0.5 <= i < grid.columns - 0.5 and -0.5 <= j < grid.rows - 0.5):
        told.append("the goal lies beyond the map: what is left is taken for straight; --gdem names the orbiter's map")
    if not seen.poses.known:
        told.append("the ground under the rover is not in the map: it will look behind as well")
    here = None if archive is None else _newest_place(archive)
    if here is not None and math.dist(here, seen.poses.pose[:2]) > _FAR_M:
        told.append(
            f"the rover stands {math.dist(here, seen.poses.pose[:2]):.1f} m from where this map was made: "
            "`ground get ldem`"
        )
    return told


def _newest_place(archive: Path) -> tuple[float, float] | None:
    try:
        with reading(archive) as db:
            x, y = (next(rows(db, "items", Span(names=(name,), last=1)), None) for name in ("x_m", "y_m"))
    except ArchiveError:
        return None
    return None if x is None or y is None else (float(x["value"]), float(y["value"]))
