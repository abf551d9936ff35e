// The soft cost near blocked poses (8, rows, columns). No Python types, no exceptions, no heap.
//
// Squared distances in cells are exact: along the columns first, then the least over a row (Meijster's two passes), both
// only as far as the falloff extends.
#pragma once

#include <algorithm>
#include <cstdint>

#include "pose_field.hpp"

namespace eldorado {

struct ClosenessProblem {
    std::int64_t rows, columns;
    const std::uint8_t* freedom;  // 0 blocked
    const float* falloff;         // ratio by squared distance in cells, 0 to reach * reach
    std::int64_t reach;           // >= 2; from reach + 1 cells on the ratio is 0
    float touching;               // added if a neighbour cell or the next orientation is blocked
};

// Owned by the caller: apart (rows * (columns + 2 reach)), nearest (columns).
struct ClosenessWork {
    std::uint16_t *apart, *nearest;
};

class Closeness {
   public:
    Closeness(const ClosenessProblem& problem, const ClosenessWork& work)
        : p_(problem), w_(work), stride_(problem.columns + 2 * problem.reach),
          far_(static_cast<std::uint16_t>((problem.reach + 1) * (problem.reach + 1))) {}

    void run(float* ratio) {
        const std::int64_t layer = p_.rows * p_.columns;
        for (int o = 0; o < kOrientations; ++o) {
            along_columns(p_.freedom + o * layer);
            for (std::int64_t j = 0; j < p_.rows; ++j) {
                along_row(j);
                const std::uint8_t* const next = p_.freedom + (o + 1) % kOrientations * layer + j * p_.columns;
                const std::uint8_t* const last =
                    p_.freedom + (o + kOrientations - 1) % kOrientations * layer + j * p_.columns;
                float* const out = ratio + o * layer + j * p_.columns;
                for (std::int64_t i = 0; i < p_.columns; ++i) {
                    const std::uint16_t d2 = w_.nearest[i];
                    const bool beside = d2 <= 2 || next[i] == 0 || last[i] == 0;
                    out[i] = (d2 < far_ ? p_.falloff[d2] : 0.0f) + (beside ? p_.touching : 0.0f);
                }
            }
        }
    }

   private:
    // Squared distance to the nearest blocked pose of the same column, far_ beyond the reach.
    void along_columns(const std::uint8_t* freedom) {
        const auto beyond = static_cast<std::uint16_t>(p_.reach + 1);
        std::fill(w_.apart, w_.apart + p_.rows * stride_, beyond);
        for (std::int64_t j = 0; j < p_.rows; ++j) {
            std::uint16_t* const own = w_.apart + j * stride_ + p_.reach;
            const std::uint8_t* const poses = freedom + j * p_.columns;
            for (std::int64_t i = 0; i < p_.columns; ++i) {
                const std::uint16_t before = j > 0 ? own[i - stride_] : beyond;
                own[i] = poses[i] == 0 ? std::uint16_t{0} : std::min<std::uint16_t>(before + 1, beyond);
            }
        }
        for (std::int64_t j = p_.rows - 2; j >= 0; --j) {
            std::uint16_t* const own = w_.apart + j * stride_ + p_.reach;
            for (std::int64_t i = 0; i < p_.columns; ++i) own[i] = std::min<std::uint16_t>(own[i], own[i + stride_] + 1);
        }
        for (std::int64_t at = 0; at < p_.rows * stride_; ++at)
            w_.apart[at] = static_cast<std::uint16_t>(w_.apart[at] * w_.apart[at]);
    }

    // The least of squared distance along the column plus squared steps along the row.
    void along_row(std::int64_t j) {
        std::fill(w_.nearest, w_.nearest + p_.columns, far_);
        for (std::int64_t k = -p_.reach; k <= p_.reach; ++k) {
            const std::uint16_t* const from = w_.apart + j * stride_ + p_.reach + k;
            const auto steps = static_cast<std::uint16_t>(k * k);
            for (std::int64_t i = 0; i < p_.columns; ++i)
                w_.nearest[i] = std::min<std::uint16_t>(w_.nearest[i], from[i] + steps);
        }
    }

    const ClosenessProblem p_;
    const ClosenessWork w_;
    const std::int64_t stride_;
    const std::uint16_t far_;
};

}  // namespace eldorado
