// What observers on all nodes of a map see: the sums of visibility_scalar, bit by bit, many nodes at a time.
//
//      block: kLanes observers of a row ride in a vector,      The cells of step k of a beam are the same for every
//      kRows rows of them, S_max and sums in registers         observer, so those of a block's rows are loads of
//        o o o o o o o o                                       neighbours: no gather. Maps have a margin as wide as a
//        o o o o o o o o   ->  one load for each row and step  block, at -inf, so loads need no test: a beam of a
//        o o o o o o o o                                       block ends where it leaves the map for its last
//        o o o o o o o o                                       observer; from where it leaves it for the first on,
//                                                              cells of the margin must not count: the "border" part.
//
// Work goes by tiles of kTile x kRows nodes, beam by beam over a tile's blocks, so a beam's table stays in the first cache.
#pragma once

#include <algorithm>

#include "simd.hpp"
#include "visibility.hpp"

namespace eldorado {

constexpr int kRows = 4, kTile = 64;
constexpr float kOffMap = -std::numeric_limits<float>::infinity();

// A map with its margin. `origin` is the index of cell (0, 0).
struct PaddedSize {
    std::int64_t stride, origin, cells;

    PaddedSize(std::int64_t rows, std::int64_t columns)
        : stride(columns + 2 * kLanes), origin(kRows * stride + kLanes), cells((rows + 2 * kRows) * stride) {}
};

// Owned by the caller; sizes in elements.
struct SightWork {
    float *height_m, *veil;        // (cells,) of PaddedSize; veil may be null with the map's
    std::int32_t* target;          // (cells,), or null with the map's
    std::int32_t* offset;          // (beams, steps)
    std::int32_t* share_before;    // (beams, steps + 1)
    std::int32_t *reach_i, *reach_j;  // (steps + 1, beams)
    std::int32_t* fresh;           // (beams, kTile * kRows), or null
};

template <bool kVeiled, bool kFresh>
class TotalVisibility {
   public:
    TotalVisibility(const BeamTable& table, const SightMap& map, const SightQuestion& asked, const SightWork& work,
                    const SightSums& sums)
        : t_(table), m_(map), q_(asked), w_(work), s_(sums), size_(map.rows, map.columns) {
        pad(m_.height_m, w_.height_m, kOffMap);
        if constexpr (kVeiled) pad(m_.veil, w_.veil, 0.0f);
        if constexpr (kFresh) pad(m_.target, w_.target, 0);
        for (std::int64_t k = 0; k < t_.beams * t_.steps; ++k)
            w_.offset[k] = static_cast<std::int32_t>(t_.dj[k] * size_.stride + t_.di[k]);
        for (std::int64_t t = 0; t < t_.beams; ++t) {
            std::int32_t* before = w_.share_before + t * (t_.steps + 1);
            before[0] = 0;
            for (std::int64_t k = 0; k < t_.steps; ++k) before[k + 1] = before[k] + t_.share[t * t_.steps + k];
            find_reach(t, t_.di, w_.reach_i);
            find_reach(t, t_.dj, w_.reach_j);
        }
    }

    // False if cancelled.
    bool run(const SightControl& control) {
        for (std::int64_t j = 0; j < m_.rows; j += kRows)
            for (std::int64_t i = 0; i < m_.columns; i += kTile) {
                if (control.cancelled()) return false;
                tile(j, i);
                control.advance(std::min<std::int64_t>(kRows, m_.rows - j) * std::min<std::int64_t>(kTile, m_.columns - i));
            }
        return true;
    }

   private:
    static constexpr int kBlocks = kTile / kLanes;

    // kRows x kLanes observers; nodes (rows, columns) of them are on the map.
    struct Block {
        std::int64_t j, i, rows, columns, at;  // `at`: of its first observer in padded maps
        Floats eye_m[kRows];
        Ints seen[kRows], in_range[kRows], first[kRows];
    };

    // What one beam adds to a block.
    struct Sums {
        Floats steepest[kRows];
        Ints seen[kRows], in_range[kRows], fresh[kRows];
    };

    template <typename T>
    void pad(const T* from, T* to, T margin) const {
        std::fill(to, to + size_.cells, margin);
        for (std::int64_t j = 0; j < m_.rows; ++j)
            std::copy(from + j * m_.columns, from + (j + 1) * m_.columns, to + size_.origin + j * size_.stride);
    }

    // reach[m, t]: how many steps of beam t stay within m cells of the observer along one axis.
    void find_reach(std::int64_t t, const std::int32_t* along, std::int32_t* reach) const {
        std::int64_t k = 0;
        for (std::int64_t m = 0; m <= t_.steps; ++m) {
            while (k < t_.steps && std::abs(along[t * t_.steps + k]) <= m) ++k;
            reach[m * t_.beams + t] = static_cast<std::int32_t>(k);
        }
    }

    bool wanted(std::int64_t j, std::int64_t i) const {
        return j < m_.rows && i < m_.columns && (!q_.where || q_.where[j * m_.columns + i]);
    }

    // False where no node of the block is asked.
    bool open(Block& b, std::int64_t j, std::int64_t i) const {
        bool asked = false;
        for (int r = 0; r < kRows; ++r)
            for (int lane = 0; lane < kLanes; ++lane) asked |= wanted(j + r, i + lane);
        if (!asked) return false;
        b = {j, i, std::min<std::int64_t>(kRows, m_.rows - j), std::min<std::int64_t>(kLanes, m_.columns - i),
             size_.origin + j * size_.stride + i, {}, {}, {}, {}};
        for (int r = 0; r < kRows; ++r) {
            b.eye_m[r] = load(w_.height_m + b.at + r * size_.stride) + q_.eye_m;
            for (int lane = 0; q_.first && lane < kLanes; ++lane)
                b.first[r][lane] = wanted(j + r, i + lane) ? q_.first[(j + r) * m_.columns + i + lane] : 0;
        }
        return true;
    }

    // Steps that are on the map for an observer with this room to its left, right, below and above.
    std::int64_t steps_within(std::int64_t t, std::int64_t left, std::int64_t right, std::int64_t below,
                              std::int64_t above) const {
        const std::int64_t last = (t + 1) * t_.steps - 1;
        const std::int64_t i = std::min(t_.di[last] < 0 ? left : right, t_.steps);
        const std::int64_t j = std::min(t_.dj[last] < 0 ? below : above, t_.steps);
        return std::min(w_.reach_i[i * t_.beams + t], w_.reach_j[j * t_.beams + t]);
    }

    template <bool kBorder>
    void trace(std::int64_t t, std::int64_t from, std::int64_t to, const Block& b, Sums& sums) const {
        const std::int32_t *offset = w_.offset + t * t_.steps, *share = t_.share + t * t_.steps;
        const float* inverse = t_.inverse_pm + t * t_.steps;
        Sums s = sums;
        for (std::int64_t k = from; k < to; ++k) {
            const std::int64_t cell = b.at + offset[k];
            for (int r = 0; r < kRows; ++r) {
                const std::int64_t at = cell + r * size_.stride;
                const Floats z = load(w_.height_m + at);
                const Floats slope = (z - b.eye_m[r]) * inverse[k];
                const Ints seen = (slope >= s.steepest[r] - kSlopeTolerance) & share[k];
                s.seen[r] += seen;
                if constexpr (kFresh) s.fresh[r] += seen & load(w_.target + at);
                if constexpr (kBorder) s.in_range[r] += (z > kOffMap) & share[k];
                s.steepest[r] = larger(s.steepest[r], kVeiled ? slope + load(w_.veil + at) : slope);
            }
        }
        sums = s;
    }

    void beam(std::int64_t t, Block& b, std::int32_t* fresh) const {
        Ints looks[kRows], looks_at_all{};
        for (int r = 0; r < kRows; ++r) {
            const Ints past = static_cast<std::int32_t>(t) - b.first[r];
            const auto beams = static_cast<std::int32_t>(t_.beams), width = static_cast<std::int32_t>(q_.width);
            looks[r] = q_.first ? past + ((past < 0) & beams) < width : all(-1);
            looks_at_all |= looks[r];
        }
        if (!any(looks_at_all)) return;
        const std::int64_t i = b.i, j = b.j, i1 = i + b.columns - 1, j1 = j + b.rows - 1;
        const std::int64_t right = m_.columns - 1, top = m_.rows - 1;
        const std::int64_t inside = steps_within(t, i, right - i1, j, top - j1);
        const std::int64_t end = steps_within(t, i1, right - i, j1, top - j);
        Sums s{};
        for (int r = 0; r < kRows; ++r) {
            s.steepest[r] = all(kLevel);
            s.in_range[r] = all(w_.share_before[t * (t_.steps + 1) + inside]);
        }
        trace<false>(t, 0, inside, b, s);
        trace<true>(t, inside, end, b, s);
        for (int r = 0; r < kRows; ++r) {
            b.seen[r] += s.seen[r] & looks[r];
            b.in_range[r] += s.in_range[r] & looks[r];
            if constexpr (kFresh) store(fresh + r * kLanes, s.fresh[r] & looks[r]);
        }
    }

    void tile(std::int64_t j, std::int64_t i0) {
        Block blocks[kBlocks];
        int count = 0;
        for (std::int64_t i = i0; i < std::min(i0 + kTile, m_.columns); i += kLanes) count += open(blocks[count], j, i);
        if (count == 0) return;
        if constexpr (kFresh) std::fill(w_.fresh, w_.fresh + t_.beams * kTile * kRows, 0);
        for (std::int64_t t = 0; t < t_.beams; ++t)
            for (int n = 0; n < count; ++n) beam(t, blocks[n], kFresh ? fresh_of(t, n) : nullptr);
        for (int n = 0; n < count; ++n) close(blocks[n], n);
    }

    std::int32_t* fresh_of(std::int64_t t, int block) const { return w_.fresh + (t * kBlocks + block) * kRows * kLanes; }

    void close(const Block& b, int block) const {
        for (int r = 0; r < kRows; ++r) {
            Ints heading{}, best{};
            if constexpr (kFresh) best = best_windows(block, r, heading);
            for (int lane = 0; lane < kLanes; ++lane) {
                if (!wanted(b.j + r, b.i + lane)) continue;
                const std::int64_t node = (b.j + r) * m_.columns + b.i + lane;
                s_.seen[node] = b.seen[r][lane];
                s_.in_range[node] = b.in_range[r][lane];
                if constexpr (kFresh) s_.fresh[node] = best[lane], s_.heading[node] = heading[lane];
            }
        }
    }

    // best_window of visibility.hpp for the observers of one row of a block.
    Ints best_windows(int block, int row, Ints& heading) const {
        const std::int64_t half = q_.heading_width / 2;
        const auto fresh = [&](std::int64_t t) {
            return load(fresh_of(t < 0 ? t + t_.beams : t < t_.beams ? t : t - t_.beams, block) + row * kLanes);
        };
        Ints sum{};
        for (std::int64_t t = -half; t < q_.heading_width - half; ++t) sum += fresh(t);
        Ints best = sum;
        heading = Ints{};
        for (std::int64_t t = 1; t < t_.beams; ++t) {
            sum += fresh(t + q_.heading_width - half - 1) - fresh(t - half - 1);
            const Ints better = sum > best;
            best = better ? sum : best;
            heading = better ? all(static_cast<std::int32_t>(t)) : heading;
        }
        return best;
    }

    const BeamTable t_;
    const SightMap m_;
    const SightQuestion q_;
    const SightWork w_;
    const SightSums s_;
    const PaddedSize size_;
};

}  // namespace eldorado
