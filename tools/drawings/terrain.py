"""Draw the pictures of docs/terrain.md: python -m tools.drawings.terrain [FOLDER]."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from hil.terrain.craters import CraterLaw, depth_m, profile_m
from hil.terrain.field import truth_height
from hil.terrain.recipe import Course, Recipe, compose
from hil.terrain.rock_sizes import Golombek, PowerLaw
from onboard.records import Grid
from pictures.ground_kinds import Profile, Sizes, craters, fractals, rock_sizes
from pictures.style import png
from pictures.terrain import Ground

FOLDER = Path(__file__).parents[2] / "docs" / "pictures"
AREA_M2, SLOPE_DEG, CRATER_M = 400.0, 5.0, 5.0


def ground(recipe: Recipe, name: str) -> Ground:
    """The field of a recipe, always with the same seed, as ground of a picture."""
    field = compose(recipe, Course(), np.random.default_rng(7))
    rocks = np.array([(rock.x_m, rock.y_m, rock.diameter_m) for rock in field.rocks]).reshape(-1, 3)
    return Ground(field.grid, truth_height(field), rocks, name)


def middle(whole: Ground) -> Ground:
    """The middle part, half as wide and as high."""
    grid, rows, columns = whole.grid, whole.grid.rows // 2, whole.grid.columns // 2
    x0_m, y0_m = grid.x0_m + columns // 2 * grid.cell_m, grid.y0_m + rows // 2 * grid.cell_m
    part = whole.heights_m[rows // 2 :, columns // 2 :][:rows, :columns]
    return replace(whole, grid=Grid(x0_m, y0_m, grid.cell_m, rows, columns), heights_m=part)


def profiles() -> list[Profile]:
    """A fresh crater and two worn ones."""
    x = np.linspace(-3 * CRATER_M / 2, 3 * CRATER_M / 2, 1201)
    share = depth_m(CRATER_M) / CRATER_M
    return [
        Profile(f"wear {wear:g}, depth {(1 - wear) * share:.2f} D", x, profile_m(CRATER_M, np.abs(x), wear))
        for wear in (0.0, 0.4, 0.8)
    ]


def sizes() -> list[Sizes]:
    """Both laws, and one sample of each, limited to the same diameters."""
    golombek, power = Golombek(0.07), PowerLaw(0.04)
    d = np.geomspace(golombek.smallest_m, golombek.largest_m * 0.999, 300)
    low, high = golombek.smallest_m, golombek.largest_m
    density = power.area_ratio / (math.pi / 2 * math.log(high / low))  # n(D) = 2 density D^-3
    rows = (
        (
            "Golombek k = 0.07",
            golombek,
            golombek.area_ratio(d) - golombek.area_ratio(high),
            golombek.number_per_m2(d) - golombek.number_per_m2(high),
        ),
        ("power law, 4 %", power, density * math.pi / 2 * np.log(high / d), density * (d**-2 - high**-2)),
    )
    return [
        Sizes(name, law.diameters_m(AREA_M2, np.random.default_rng(7)), AREA_M2, d, share, number)
        for name, law, share, number in rows
    ]


def main(folder: Path) -> None:
    """Write the three pictures."""
    rough = [
        middle(ground(Recipe(hurst, median_slope_deg=SLOPE_DEG), f"H = {hurst:g}, median slope {SLOPE_DEG:g}°"))
        for hurst in (0.3, 0.6, 0.9)
    ]
    cratered = Recipe(0.8, median_slope_deg=4.5, craters=CraterLaw(), rocks=Golombek(0.07))
    made = {
        "terrain-fbm.png": fractals(rough),
        "terrain-craters.png": craters(profiles(), ground(cratered, "craters and rocks (k = 0.07)")),
        "terrain-rocks.png": rock_sizes(sizes()),
    }
    for name, drawing in made.items():
        (folder / name).write_bytes(png(drawing))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
