// SCIP's data blocks for Python.
#pragma once

#include "bind.hpp"
#include "scip_blocks.hpp"

namespace eldorado {

static bool scip_values_into(Array<const std::uint8_t, 1> frame, std::int64_t at, std::int64_t characters,
                             Array<std::int64_t, 1> values) {
    const auto size = static_cast<std::int64_t>(frame.shape(0)) - at;
    return size > 0 && scip_values(frame.data() + at, size, characters, values.data(),
                                   static_cast<std::int64_t>(values.shape(0)));
}

inline void bind_scip_blocks(nb::module_& m) {
    m.def("scip_values_into", &scip_values_into, "frame"_a, "at"_a, "characters"_a, "values"_a);
}

}  // namespace eldorado
