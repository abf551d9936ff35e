// Python's way to the kernels: unpacks arrays, owns the workspaces, releases the lock. Checks are in __init__.py.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pose_field.hpp"
#include "rasterise.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace eldorado;

template <typename T, int N>
using Array = nb::ndarray<T, nb::ndim<N>, nb::c_contig, nb::device::cpu>;

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

static void cost_to_go_into(Array<const std::uint8_t, 3> freedom, int least_freedom, nb::object closeness,
                            Array<const float, 2> moves_m, float turn_m, float width_m, float dearest_m,
                            Array<const std::int64_t, 1> seeds, Array<const float, 1> seed_costs_m,
                            Array<float, 3> cost) {
    const bool soft = !closeness.is_none();
    Array<const float, 3> ratios;
    if (soft) ratios = nb::cast<Array<const float, 3>>(closeness);
    const std::size_t states = freedom.size();
    std::size_t heads = 4;
    while (static_cast<float>(heads) < dearest_m / width_m + 3.0f) heads *= 2;
    const PoseProblem problem{static_cast<std::int64_t>(freedom.shape(1)),
                              static_cast<std::int64_t>(freedom.shape(2)),
                              freedom.data(),
                              static_cast<std::uint8_t>(least_freedom),
                              soft ? ratios.data() : nullptr,
                              moves_m.data(),
                              turn_m,
                              seeds.data(),
                              seed_costs_m.data(),
                              static_cast<std::int64_t>(seeds.size())};
    nb::gil_scoped_release unlocked;
    std::vector<PoseLink> links(states);
    std::vector<std::int32_t> buckets(heads);
    const PoseWork work{links.data(), buckets.data(), static_cast<std::int64_t>(heads), width_m};
    PoseSearch(problem, work, cost.data()).run();
}

NB_MODULE(_kernels, m) {
    m.def("rasterise_into", &rasterise_into);
    m.def("cost_to_go_into", &cost_to_go_into, "freedom"_a, "least_freedom"_a, "closeness"_a.none(), "moves_m"_a, "turn_m"_a,
          "width_m"_a, "dearest_m"_a, "seeds"_a, "seed_costs_m"_a, "cost"_a);
}
