// Filter of the range image: returns of a sweep that have a witness next to them. The rule and its reasons are in
// onboard/perception/scan/range_image.py. No Python types, no exceptions, no heap.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace eldorado {

// ranges, seen, kept: (lines, beams). `work`: range_filter_needed floats. A return is kept if one of its 8 neighbours
// is within `tolerance_m` of its range, or if it is that near to the mean of two opposite neighbours.
inline std::int64_t range_filter_needed(std::int64_t lines, std::int64_t beams) { return (lines + 2) * (beams + 2); }

inline void keep_witnessed(const float* ranges, const std::uint8_t* seen, std::int64_t lines, std::int64_t beams,
                           float tolerance_m, float* work, std::uint8_t* kept) {
    const std::int64_t stride = beams + 2;
    std::fill(work, work + range_filter_needed(lines, beams), std::numeric_limits<float>::quiet_NaN());
    for (std::int64_t k = 0; k < lines; ++k)
        for (std::int64_t i = 0; i < beams; ++i)
            if (seen[k * beams + i]) work[(k + 1) * stride + i + 1] = ranges[k * beams + i];
    for (std::int64_t k = 0; k < lines; ++k) {
        const float* const row = work + (k + 1) * stride + 1;
        std::uint8_t* const out = kept + k * beams;
        for (std::int64_t i = 0; i < beams; ++i) {
            const float own = row[i];
            int found = 0;
            for (const std::int64_t by : {std::int64_t{1}, stride - 1, stride, stride + 1}) {  // NaN is near to nothing
                const float one = row[i - by], other = row[i + by];
                found |= std::abs(own - one) <= tolerance_m;
                found |= std::abs(own - other) <= tolerance_m;
                found |= std::abs(own - 0.5f * (one + other)) <= tolerance_m;
            }
            out[i] = static_cast<std::uint8_t>(found);
        }
    }
}

}  // namespace eldorado
