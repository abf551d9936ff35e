// How fast the arithmetic of visibility_total.hpp can be on this machine: its inner loop on data of the first cache.
#pragma once

#include <vector>

#include "visibility_total.hpp"

namespace eldorado {

inline std::int64_t visibility_ceiling(std::int64_t) { return 0; }

}  // namespace eldorado
