"""The true ground goes into a file as it is, tops of rocks included, and always as the same bytes."""

import io

import numpy as np

from hil.terrain import field_file
from hil.terrain.field import Field, truth_height
from hil.terrain.rock_sizes import PowerLaw
from hil.terrain.rocks import scatter_rocks
from onboard.records import Gdem, Grid, Pose


def field():
    grid, soil = Grid(-1.95, -1.95, 0.1, 40, 50), np.zeros((40, 50), np.float32)
    rocks = scatter_rocks(grid, soil, PowerLaw(0.04), ((0.0, 0.0, 0.5),), np.random.default_rng(4))
    return Field(grid, soil, rocks, Pose(0.0, 0.0, yaw_rad=0.3), (2.0, 1.0), Gdem(grid, soil), 4, {})


def test_every_key_holds_what_its_name_says():
    made = field()
    with np.load(io.BytesIO(field_file.to_npz(made))) as file:
        np.testing.assert_array_equal(file["truth_heights_m"], truth_height(made))
        assert file["truth_heights_m"].max() > 0.02
        assert (float(file["x0_m"]), float(file["y0_m"]), float(file["cell_m"])) == (-1.95, -1.95, 0.1)
        assert file["start"].tolist() == [0.0, 0.0, 0.3]
        assert file["goal"].tolist() == [2.0, 1.0]
        assert file["rocks"].tolist() == [[rock.x_m, rock.y_m, rock.diameter_m] for rock in made.rocks]


def test_the_same_ground_gives_the_same_bytes():
    assert field_file.to_npz(field()) == field_file.to_npz(field())
