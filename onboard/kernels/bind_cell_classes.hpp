// Binding of the cell classes.
#pragma once

#include "bind.hpp"
#include "cell_classes.hpp"

namespace eldorado {

static void classify_into(std::int64_t fill_cells, Array<const double, 1> rules_m,
                          Array<const double, 1> spread, Array<const std::int32_t, 2> n,
                          Array<const double, 2> sum_z, Array<const float, 2> z_hi, Array<const float, 2> z_lo,
                          Array<const float, 2> sum_sigma, Array<const float, 2> z_ray, Array<const float, 2> assumed_z,
                          Array<std::uint8_t, 2> cell_class, Array<float, 2> z_mean, Array<float, 2> z_top,
                          Array<float, 2> z_bot) {
    const double* const r = rules_m.data();
    const CellRules rules{fill_cells,    r[0], r[1], r[2], r[3], r[4], spread.data(),
                          static_cast<std::int64_t>(spread.shape(0))};
    const CellStatistics cells{static_cast<std::int64_t>(n.shape(0)), static_cast<std::int64_t>(n.shape(1)),
                               n.data(), sum_z.data(), z_hi.data(), z_lo.data(), sum_sigma.data(), z_ray.data(),
                               assumed_z.data()};
    nb::gil_scoped_release unlocked;
    std::vector<double> mean(n.size());
    CellClassifier(cells, rules, mean.data()).run({cell_class.data(), z_mean.data(), z_top.data(), z_bot.data()});
}

inline void bind_cell_classes(nb::module_& m) {
    m.def("classify_into", &classify_into, "fill_cells"_a, "rules_m"_a, "spread"_a, "n"_a, "sum_z"_a, "z_hi"_a, "z_lo"_a,
          "sum_sigma"_a, "z_ray"_a, "assumed_z"_a, "cell_class"_a, "z_mean"_a, "z_top"_a, "z_bot"_a);
}

}  // namespace eldorado
