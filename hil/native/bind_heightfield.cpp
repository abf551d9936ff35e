// Rays on a raster of heights for Python: unpacks arrays, releases the lock. Checks are in hil/heightfield.py.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "heightfield.hpp"

namespace nb = nanobind;
template <typename T, int N>
using Array = nb::ndarray<T, nb::ndim<N>, nb::c_contig, nb::device::cpu>;

static void cast_into(Array<const float, 2> z, Array<const float, 2> top, double x0_m, double y0_m, double cell_m,
                      Array<const double, 1> origin_m, Array<const double, 2> directions, double range_m,
                      Array<double, 1> ranges_m) {
    const heightfield::Raster raster{z.data(), top.data(), static_cast<std::int64_t>(z.shape(0)),
                                     static_cast<std::int64_t>(z.shape(1)), x0_m, y0_m, cell_m};
    const double u = (origin_m.data()[0] - x0_m) / cell_m, v = (origin_m.data()[1] - y0_m) / cell_m;
    const double height_m = origin_m.data()[2];
    const double* way = directions.data();
    double* range = ranges_m.data();
    const std::size_t count = directions.shape(0);
    nb::gil_scoped_release unlocked;
    for (std::size_t k = 0; k < count; ++k, way += 3)
        range[k] = heightfield::cast(raster, {u, v, height_m, way[0] / cell_m, way[1] / cell_m, way[2]}, range_m);
}

NB_MODULE(_heightfield, m) { m.def("cast_into", &cast_into); }
