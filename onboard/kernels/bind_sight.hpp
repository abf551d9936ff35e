// Binding of the line of sight.
#pragma once

#include "bind.hpp"
#include "sight.hpp"

namespace eldorado {

static double sight_price_m(Array<const std::uint8_t, 3> free, nb::object closeness, double x0_m, double y0_m,
                            double cell_m, double ax_m, double ay_m, double bx_m, double by_m, double spacing_m,
                            std::int64_t orientation) {
    const bool soft = !closeness.is_none();
    Array<const float, 3> ratios;
    if (soft) ratios = nb::cast<Array<const float, 3>>(closeness);
    const SightGround ground{static_cast<std::int64_t>(free.shape(0)), static_cast<std::int64_t>(free.shape(1)),
                             static_cast<std::int64_t>(free.shape(2)), free.data(), soft ? ratios.data() : nullptr,
                             x0_m, y0_m, cell_m};
    const SightLine line{ax_m, ay_m, bx_m, by_m, spacing_m, orientation};
    nb::gil_scoped_release unlocked;
    return sight_price(ground, line);
}

inline void bind_sight(nb::module_& m) {
    m.def("sight_price_m", &sight_price_m, "free"_a, "closeness"_a.none(), "x0_m"_a, "y0_m"_a, "cell_m"_a, "ax_m"_a,
          "ay_m"_a, "bx_m"_a, "by_m"_a, "spacing_m"_a, "orientation"_a);
}

}  // namespace eldorado
