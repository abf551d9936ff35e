// Visibility from all nodes of a map: the sums of visibility_scalar, bit by bit, many nodes at a time.
//
//      block: kLanes observers of a row ride in a vector,      The cells of step k of a beam are the same for every
//      kRows rows of them, S_max and sums in registers         observer, so those of a block's rows are loads of
//        o o o o o o o o                                       neighbours: no gather. Maps have a margin as wide as a
//        o o o o o o o o   ->  one load for each row and step  block, at -inf, where nothing is ever seen: no test in
//        o o o o o o o o                                       the loop, and a beam of a block ends where it leaves
//        o o o o o o o o                                       the map for its last observer.
//
// Work is done in tiles of kTile x kRows nodes, beam by beam over a tile's blocks: a beam's table stays in the L1
// cache.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <utility>

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
    std::int32_t* area;            // (2 steps + 2, 2 steps + 2)
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
        find_area();
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

    // The arithmetic alone: the first block's first beam, repeated. Returns the number of samples and the sum of
    // visible shares, so that the compiler removes nothing.
    std::pair<std::int64_t, std::int64_t> repeat_first_beam(std::int64_t times) {
        Block b;
        if (!open(b, 0, 0)) return {0, 0};
        const std::int64_t steps = steps_within(0, b.columns - 1, m_.columns - b.columns, b.rows - 1, m_.rows - b.rows);
        std::int64_t seen = 0;
        for (std::int64_t n = 0; n < times; ++n) {
            Row r0 = row(b, 0), r1 = row(b, 1), r2 = row(b, 2), r3 = row(b, 3);
            trace(0, steps, b.at, r0, r1, r2, r3);
            seen += (r0.seen + r1.seen + r2.seen + r3.seen)[n % kLanes];
        }
        return {times * steps * kRows * kLanes, seen};
    }

   private:
    static constexpr int kBlocks = kTile / kLanes;

    // kRows x kLanes observers; (rows, columns) of them are on the map.
    struct Block {
        std::int64_t j, i, rows, columns, at;  // `at`: of its first observer in padded maps
        Floats eye_m[kRows];
        Ints seen[kRows], first[kRows], looks[kRows];
    };

    // Result of one beam for the observers of one row of a block.
    struct Row {
        Floats eye_m, steepest;
        Ints seen, fresh;
    };

    template <typename T>
    void pad(const T* from, T* to, T margin) const {
        std::fill(to, to + size_.cells, margin);
        for (std::int64_t j = 0; j < m_.rows; ++j)
            std::copy(from + j * m_.columns, from + (j + 1) * m_.columns, to + size_.origin + j * size_.stride);
    }

    // reach[m, t]: number of steps of beam t within m cells of the observer along one axis.
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

    // Returns false if no node of the block is requested.
    bool open(Block& b, std::int64_t j, std::int64_t i) const {
        bool asked = false;
        for (int r = 0; r < kRows; ++r)
            for (int lane = 0; lane < kLanes; ++lane) asked |= wanted(j + r, i + lane);
        if (!asked) return false;
        b = {j, i, std::min<std::int64_t>(kRows, m_.rows - j), std::min<std::int64_t>(kLanes, m_.columns - i),
             size_.origin + j * size_.stride + i, {}, {}, {}, {}};
        for (int r = 0; r < kRows; ++r) {
            b.eye_m[r] = load(w_.height_m + b.at + r * size_.stride) + q_.eye_m;
            b.looks[r] = all(-1);
            for (int lane = 0; q_.first && lane < kLanes; ++lane)
                b.first[r][lane] = wanted(j + r, i + lane) ? q_.first[(j + r) * m_.columns + i + lane] : 0;
        }
        return true;
    }

    // Steps on the map for an observer with this space to its left, right, below and above.
    std::int64_t steps_within(std::int64_t t, std::int64_t left, std::int64_t right, std::int64_t below,
                              std::int64_t above) const {
        const std::int64_t last = (t + 1) * t_.steps - 1;
        const std::int64_t i = std::min(t_.di[last] < 0 ? left : right, t_.steps);
        const std::int64_t j = std::min(t_.dj[last] < 0 ? below : above, t_.steps);
        return std::min(w_.reach_i[i * t_.beams + t], w_.reach_j[j * t_.beams + t]);
    }

    static Row row(const Block& b, int r) { return {b.eye_m[r], all(kLevel), Ints{}, Ints{}}; }

    __attribute__((always_inline)) void step(Row& row, std::int64_t at, float inverse_pm, std::int32_t share) const {
        const Floats z = load(w_.height_m + at);
        const Floats slope = (z - row.eye_m) * inverse_pm;
        const Ints seen = (slope >= row.steepest - kSlopeTolerance) & share;
        row.seen += seen;
        if constexpr (kFresh) row.fresh += seen & load(w_.target + at);
        row.steepest = larger(row.steepest, kVeiled ? slope + load(w_.veil + at) : slope);
    }

    __attribute__((always_inline)) void trace(std::int64_t t, std::int64_t steps, std::int64_t at, Row& a, Row& b,
                                              Row& c, Row& d) const {
        const std::int32_t *offset = w_.offset + t * t_.steps, *share = t_.share + t * t_.steps;
        const float* inverse_pm = t_.inverse_pm + t * t_.steps;
        const std::int64_t stride = size_.stride;
        for (std::int64_t k = 0; k < steps; ++k) {
            const std::int64_t cell = at + offset[k];
            step(a, cell, inverse_pm[k], share[k]);
            step(b, cell + stride, inverse_pm[k], share[k]);
            step(c, cell + 2 * stride, inverse_pm[k], share[k]);
            step(d, cell + 3 * stride, inverse_pm[k], share[k]);
        }
    }

    // Marks the observers that have beam t in their sector; returns false if there is none.
    __attribute__((noinline)) bool looks_along(std::int64_t t, Block& b) const {
        const auto beam = static_cast<std::int32_t>(t), beams = static_cast<std::int32_t>(t_.beams);
        Ints some{};
        for (int r = 0; r < kRows; ++r) {
            const Ints past = beam - b.first[r];
            b.looks[r] = past + ((past < 0) & beams) < static_cast<std::int32_t>(q_.width);
            some |= b.looks[r];
        }
        return any(some);
    }

    void beam(std::int64_t t, Block& b, std::int32_t* fresh) const {
        if (q_.first && !looks_along(t, b)) return;
        static_assert(kRows == 4);  // named, not indexed: gcc 12 keeps an array that a loop indexes in memory
        Row r0 = row(b, 0), r1 = row(b, 1), r2 = row(b, 2), r3 = row(b, 3);
        const std::int64_t left = b.i + b.columns - 1, below = b.j + b.rows - 1;  // the most space that an observer has
        trace(t, steps_within(t, left, m_.columns - 1 - b.i, below, m_.rows - 1 - b.j), b.at, r0, r1, r2, r3);
        const auto add = [&](int r, const Row& found) {
            b.seen[r] += found.seen & b.looks[r];
            if constexpr (kFresh) store(fresh + r * kLanes, found.fresh & b.looks[r]);
        };
        add(0, r0), add(1, r1), add(2, r2), add(3, r3);
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

    // Shares of the cells of a node's beams that are on the map.
    std::int32_t in_range(std::int64_t j, std::int64_t i) const {
        const std::int64_t right = m_.columns - 1 - i, above = m_.rows - 1 - j;
        if (!q_.first) {
            const auto within = [this](std::int64_t room) { return std::min(room, t_.steps); };
            return area(within(j), within(above), within(i), within(right));
        }
        std::int32_t sum = 0;
        std::int64_t t = q_.first[j * m_.columns + i];
        for (std::int64_t n = 0; n < q_.width; ++n, t = t + 1 < t_.beams ? t + 1 : 0)
            sum += w_.share_before[t * (t_.steps + 1) + steps_within(t, i, right, j, above)];
        return sum;
    }

    // Shares of all samples at most this many cells below, above, left and right of the observer.
    std::int32_t area(std::int64_t below, std::int64_t above, std::int64_t left, std::int64_t right) const {
        const std::int64_t s = t_.steps, side = 2 * s + 2;
        const std::int32_t *low = w_.area + (s - below) * side, *high = w_.area + (s + above + 1) * side;
        return high[s + right + 1] - high[s - left] - (low[s + right + 1] - low[s - left]);
    }

    // area[j, i]: shares of all samples with dj < j - steps and di < i - steps.
    void find_area() const {
        const std::int64_t s = t_.steps, side = 2 * s + 2;
        std::fill(w_.area, w_.area + side * side, 0);
        for (std::int64_t k = 0; k < t_.beams * s; ++k)
            w_.area[(t_.dj[k] + s + 1) * side + t_.di[k] + s + 1] += t_.share[k];
        for (std::int64_t j = 1; j < side; ++j) {
            std::int32_t row = 0;
            for (std::int64_t i = 1; i < side; ++i) {
                row += w_.area[j * side + i];
                w_.area[j * side + i] = w_.area[(j - 1) * side + i] + row;
            }
        }
    }

    void close(const Block& b, int block) const {
        for (int r = 0; r < kRows; ++r) {
            Ints heading{}, best{};
            if constexpr (kFresh) best = best_windows(block, r, heading);
            for (int lane = 0; lane < kLanes; ++lane) {
                if (!wanted(b.j + r, b.i + lane)) continue;
                const std::int64_t node = (b.j + r) * m_.columns + b.i + lane;
                s_.seen[node] = b.seen[r][lane];
                s_.in_range[node] = in_range(b.j + r, b.i + lane);
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
