// Binding of the rasteriser.
#pragma once

#include "bind.hpp"
#include "cells.hpp"
#include "rasterise.hpp"

namespace eldorado {

static void rasterise_into(double x0_m, double y0_m, double cell_m, Array<const double, 1> origin_m,
                           Array<const float, 2> ends_m, Array<const std::uint8_t, 1> hit, double sigma_range_m,
                           Array<std::int32_t, 2> n, Array<double, 2> sum_z, Array<double, 2> sum_z2, Array<float, 2> z_hi,
                           Array<float, 2> z_lo, Array<float, 2> z_hi2, Array<float, 2> z_lo2, Array<float, 2> sum_sigma,
                           Array<float, 2> z_ray, Array<float, 2> view_m) {
    const RasterGrid grid{x0_m, y0_m, cell_m, static_cast<std::int64_t>(n.shape(0)), static_cast<std::int64_t>(n.shape(1))};
    const Beams beams{origin_m.data(), ends_m.data(), hit.data(), static_cast<std::int64_t>(ends_m.shape(0)), sigma_range_m};
    const RasterCells cells{n.data(),     sum_z.data(), sum_z2.data(),    z_hi.data(),  z_lo.data(),
                            z_hi2.data(), z_lo2.data(), sum_sigma.data(), z_ray.data(), view_m.data()};
    nb::gil_scoped_release unlocked;
    rasterise(grid, beams, cells);
}

// (rows, columns, 32): records as bytes; the Python interface ensures their layout.
static Cell* records(const Array<std::uint8_t, 3>& cells) { return reinterpret_cast<Cell*>(cells.data()); }

static RasterGrid grid_of(double x0_m, double y0_m, double cell_m, const Array<std::uint8_t, 3>& cells) {
    return {x0_m, y0_m, cell_m, static_cast<std::int64_t>(cells.shape(0)), static_cast<std::int64_t>(cells.shape(1))};
}

static void no_hits_into(Array<std::uint8_t, 3> cells) {
    nb::gil_scoped_release unlocked;
    std::fill_n(records(cells), cells.shape(0) * cells.shape(1), kNoHit);
}

static void points_into(double x0_m, double y0_m, double cell_m, Array<const float, 2> points_m,
                        Array<std::uint8_t, 3> cells) {
    const RasterGrid grid = grid_of(x0_m, y0_m, cell_m, cells);
    nb::gil_scoped_release unlocked;
    add_points(grid, points_m.data(), static_cast<std::int64_t>(points_m.shape(0)), records(cells));
}

static void turn_into(double x0_m, double y0_m, double cell_m, Array<const float, 1> ranges_m,
                        Array<const double, 2> azimuths, Array<const double, 2> tilts, double longest_m,
                        Array<const double, 1> scanner_m, Array<const double, 3> hull_m, Array<const double, 2> T_map_base,
                        Array<std::uint8_t, 3> cells) {
    const RasterGrid grid = grid_of(x0_m, y0_m, cell_m, cells);
    const Turn turn{ranges_m.data(), azimuths.data(), tilts.data(), static_cast<std::int64_t>(ranges_m.shape(0)), longest_m};
    const Mount mount{scanner_m.data(), hull_m.data(), static_cast<std::int64_t>(hull_m.shape(0)), T_map_base.data()};
    nb::gil_scoped_release unlocked;
    add_turn(grid, turn, mount, records(cells));
}

inline void bind_raster(nb::module_& m) {
    m.def("rasterise_into", &rasterise_into);
    m.def("no_hits_into", &no_hits_into);
    m.def("points_into", &points_into);
    m.def("turn_into", &turn_into);
}

}  // namespace eldorado
