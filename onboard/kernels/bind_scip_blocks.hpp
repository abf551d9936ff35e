// Binding of SCIP's data blocks and beams.
#pragma once

#include "bind.hpp"
#include "scip_beams.hpp"
#include "scip_blocks.hpp"

namespace eldorado {

static bool scip_values_into(Array<const std::uint8_t, 1> frame, std::int64_t at, std::int64_t characters,
                             Array<std::int64_t, 1> values) {
    const auto size = static_cast<std::int64_t>(frame.shape(0)) - at;
    return size > 0 && scip_values(frame.data() + at, size, characters, values.data(),
                                   static_cast<std::int64_t>(values.shape(0)));
}

static void scip_beams_into(Array<const std::int64_t, 1> values, std::int64_t stride,
                            Array<const std::uint8_t, 1> status_of, Array<float, 1> ranges_m,
                            Array<std::uint8_t, 1> status) {
    scip_beams(values.data(), stride, status_of.data(), static_cast<std::int64_t>(status_of.shape(0)), ranges_m.data(),
               status.data(), static_cast<std::int64_t>(status.shape(0)));
}

inline void bind_scip_blocks(nb::module_& m) {
    m.def("scip_values_into", &scip_values_into, "frame"_a, "at"_a, "characters"_a, "values"_a);
    m.def("scip_beams_into", &scip_beams_into, "values"_a, "stride"_a, "status_of"_a, "ranges_m"_a, "status"_a);
}

}  // namespace eldorado
