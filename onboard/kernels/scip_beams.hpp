// Values of a SCIP scan as metres and status of each beam (onboard/devices/lidar/beams.py).
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace eldorado {

// Beam k has the value values[k * stride] in mm; status_of[value] is the status of a value of 0 to codes - 1, and its
// last entry applies to all above. Ranges are NaN where the status is not 0 (OK). codes, stride > 0.
inline void scip_beams(const std::int64_t* values, std::int64_t stride, const std::uint8_t* status_of,
                       std::int64_t codes, float* ranges_m, std::uint8_t* status, std::int64_t beams) {
    for (std::int64_t k = 0; k < beams; ++k) {
        const std::int64_t value = values[k * stride];
        status[k] = status_of[std::clamp<std::int64_t>(value, 0, codes - 1)];
        ranges_m[k] = status[k] ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(value) * 1e-3f;
    }
}

}  // namespace eldorado
