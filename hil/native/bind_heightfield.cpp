// Python bindings for rays on a raster of heights, and on one with rocks: unpack arrays, release the lock. The checks
// are in hil/terrain/heightfield.py and hil/plant/ground_bodies.py.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <vector>

#include "heightfield.hpp"
#include "rocks.hpp"

namespace nb = nanobind;
template <typename T, int N>
using Array = nb::ndarray<T, nb::ndim<N>, nb::c_contig, nb::device::cpu>;

static void cast_into(Array<const float, 2> z, Array<const float, 2> top, Array<const float, 2> tile_top, double x0_m,
                      double y0_m, double cell_m, Array<const double, 1> origin_m, Array<const double, 2> directions,
                      double range_m, Array<double, 1> ranges_m) {
    const heightfield::Raster raster{z.data(), top.data(), tile_top.data(), static_cast<std::int64_t>(z.shape(0)),
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

static void cast_ground_into(Array<const float, 2> z, Array<const float, 2> top, Array<const float, 2> tile_top,
                             double x0_m, double y0_m, double cell_m, Array<const double, 3> triangles, Array<const std::int32_t, 1> first,
                             Array<const double, 3> boxes, Array<const std::int32_t, 1> of,
                             Array<const std::int32_t, 1> of_from, Array<const std::int32_t, 1> rim,
                             Array<const float, 1> reach, Array<const float, 2> tile_reach, double low_m,
                             double high_m, Array<const double, 2> origins_m, Array<const double, 2> directions,
                             double range_m, Array<double, 1> ranges_m) {
    const heightfield::Raster soil{z.data(), top.data(), tile_top.data(), static_cast<std::int64_t>(z.shape(0)),
                                   static_cast<std::int64_t>(z.shape(1)), x0_m, y0_m, cell_m};
    const rocks::Rocks all{triangles.data(), first.data(), boxes.data(), of.data(), of_from.data(), rim.data(),
                           static_cast<std::int64_t>(rim.shape(0)), reach.data(), tile_reach.data(), low_m,
                           high_m};
    const double *from = origins_m.data(), *way = directions.data();
    double* range = ranges_m.data();
    const std::size_t count = directions.shape(0);
    nb::gil_scoped_release unlocked;
    std::vector<std::int32_t> asked(boxes.shape(0), -1);
    for (std::size_t k = 0; k < count; ++k, from += 3, way += 3)
        range[k] = rocks::cast(soil, all, {from[0], from[1], from[2]}, {way[0], way[1], way[2]}, range_m,
                               static_cast<std::int32_t>(k), asked.data());
}

NB_MODULE(_heightfield, m) {
    m.attr("TILE") = heightfield::kTile;
    m.def("cast_into", &cast_into);
    m.def("cast_ground_into", &cast_ground_into);
}
