// The values of a SCIP scan as metres and what each beam said (onboard/devices/lidar_beams.py).
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace eldorado {

// Beam k has the value values[k * stride] in mm; status_of[value] says what a value of 0 to codes - 1 means, and its
// last entry stands for all above. Ranges are NaN where that is not 0 (OK). codes, stride > 0.
inline void scip_beams(const std::int64_t* values, std::int64_t stride, const std::uint8_t* status_of,
                       std::int64_t codes, float* ranges_m, std::uint8_t* status, std::int64_t beams) {
    for (std::int64_t k = 0; k < beams; ++k) {
        const std::int64_t value = values[k * stride];
        status[k] = status_of[std::clamp<std::int64_t>(value, 0, codes - 1)];
        ranges_m[k] = status[k] ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(value) * 1e-3f;
    }
}

}  // namespace eldorado
