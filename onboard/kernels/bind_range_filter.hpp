// Binding of the range image filter.
#pragma once

#include "bind.hpp"
#include "range_filter.hpp"

namespace eldorado {

static void keep_witnessed_into(Array<const float, 2> ranges_m, Array<const std::uint8_t, 2> seen, float tolerance_m,
                                Array<std::uint8_t, 2> kept) {
    const auto lines = static_cast<std::int64_t>(ranges_m.shape(0)), beams = static_cast<std::int64_t>(ranges_m.shape(1));
    std::vector<float> work(static_cast<std::size_t>(range_filter_needed(lines, beams)));
    nb::gil_scoped_release unlocked;
    keep_witnessed(ranges_m.data(), seen.data(), lines, beams, tolerance_m, work.data(), kept.data());
}

inline void bind_range_filter(nb::module_& m) { m.def("keep_witnessed_into", &keep_witnessed_into); }

}  // namespace eldorado
