// The rasteriser for Python.
#pragma once

#include "bind.hpp"
#include "rasterise.hpp"

namespace eldorado {

static void rasterise_into(double x0_m, double y0_m, double cell_m, Array<const double, 1> origin_m,
                           Array<const float, 2> ends_m, Array<const std::uint8_t, 1> hit, double sigma_range_m,
                           Array<std::int32_t, 2> n, Array<double, 2> sum_z, Array<double, 2> sum_z2, Array<float, 2> z_hi,
                           Array<float, 2> z_lo, Array<float, 2> sum_sigma, Array<float, 2> z_ray, Array<float, 2> view_m) {
    const RasterGrid grid{x0_m, y0_m, cell_m, static_cast<std::int64_t>(n.shape(0)), static_cast<std::int64_t>(n.shape(1))};
    const Beams beams{origin_m.data(), ends_m.data(), hit.data(), static_cast<std::int64_t>(ends_m.shape(0)), sigma_range_m};
    const RasterCells cells{n.data(),         sum_z.data(), sum_z2.data(), z_hi.data(), z_lo.data(),
                            sum_sigma.data(), z_ray.data(), view_m.data()};
    nb::gil_scoped_release unlocked;
    rasterise(grid, beams, cells);
}

inline void bind_raster(nb::module_& m) { m.def("rasterise_into", &rasterise_into); }

}  // namespace eldorado
