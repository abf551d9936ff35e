// Least lengths over the cells of a grid from a set of goal cells (Jarvis' distance transform, exact), without closeness: a
// step costs 1 or sqrt(2). No Python types, no exceptions, no heap: the caller owns every array.
//
//
// Cells wait in lists by the integer part of their cost. Every step costs at least 1 and less than 2, so a cell of the
// open list is settled, is opened once, and leads to the next list or the one after (Dial 1969). It is expanded only
// where its best paths must continue (grid_ways.hpp): one neighbour for most cells, not eight.
//
// A cell is one number: its cost in fixed point, and below it the set of neighbours to continue to. Equal costs merge
// their sets, so equality must be exact: fixed point sums are exact, and only the cost of a diagonal step is rounded.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#include "grid_problem.hpp"
#include "grid_ways.hpp"

namespace eldorado {

// cells_needed() of each.
struct PlainWork {
    std::uint64_t* cells;  // cost << 8 | neighbours to continue to; in the end the bits of a double, the cost in metres
    std::uint8_t* free;    // with the rim
    std::uint8_t* around;  // the free neighbours of a cell
    std::int32_t* lists[3];
    GridWatch watch;
};

class PlainSearch {
   public:
    static std::int64_t cells_needed(const GridProblem& problem) { return (problem.rows + 2) * (problem.columns + 2); }

    PlainSearch(const GridProblem& problem, const PlainWork& work)
        : p_(problem), w_(work), cells_(cells_needed(problem)), stride_(problem.columns + 2), shift_(kSetBits + fraction_bits(cells_)) {
        for (int k = 0; k < 8; ++k) {
            const double price = (kGridSteps[k].diagonal() ? kGridDiagonal : 1.0) * one();
            steps_[k] = {kGridSteps[k].down * stride_ + kGridSteps[k].right, static_cast<std::uint64_t>(price + 0.5) << kSetBits,
                         kGridWays.onward[k]};
        }
    }

    // Fills the cells with doubles: metres to the nearest goal, +inf if there is no path and on the rim. False:
    // cancelled.
    bool run() {
        __atomic_store_n(w_.watch.progress, 0, __ATOMIC_RELAXED);
        std::fill(w_.cells, w_.cells + cells_, kFar);
        look_around();
        Waiting open{w_.lists[0], plant()}, next{w_.lists[1], 0}, after{w_.lists[2], 0};
        std::int64_t done = 0;
        for (std::uint64_t list = 0; open.count + next.count > 0; ++list) {
            if (__atomic_load_n(w_.watch.cancel, __ATOMIC_RELAXED) != 0) return false;
            done += follow(list, open, next, after);
            __atomic_store_n(w_.watch.progress, done, __ATOMIC_RELAXED);
            const Waiting spare{open.cells, 0};
            open = next, next = after, after = spare;
        }
        to_metres();
        __atomic_store_n(w_.watch.progress, p_.rows * p_.columns, __ATOMIC_RELAXED);
        return true;
    }

   private:
    static constexpr int kSetBits = 8;
    static constexpr std::uint64_t kSet = (1u << kSetBits) - 1;
    static constexpr int kPriceBits = 52;  // as many as a double stores exactly
    static constexpr std::uint64_t kFar = (std::uint64_t{1} << (kPriceBits + kSetBits)) - 1;

    struct alignas(32) Step {
        std::int64_t way;
        std::uint64_t price;
        const std::uint8_t* onward;  // of kGridWays
    };

    struct Waiting {
        std::int32_t* cells;
        std::int64_t count;
    };

    // No path is as long as 2 x `cells`, and kFar is beyond all of them.
    static int fraction_bits(std::int64_t cells) {
        int bits = kPriceBits - 1;
        while ((std::int64_t{1} << (kPriceBits - 1 - bits)) < 2 * cells) --bits;
        return bits;
    }

    // The cost of a straight step.
    double one() const { return static_cast<double>(std::uint64_t{1} << (shift_ - kSetBits)); }

    void look_around() {
        const std::int64_t columns = p_.columns;
        std::fill(w_.free, w_.free + stride_, std::uint8_t{0});
        for (std::int64_t j = 0; j < p_.rows; ++j) {
            std::uint8_t* const row = w_.free + (j + 1) * stride_;
            row[0] = row[stride_ - 1] = 0;
            const std::uint8_t* const given = p_.free + j * p_.columns;
            for (std::int64_t i = 0; i < columns; ++i) row[i + 1] = given[i] != 0;  // the sets consist of these bits
        }
        std::fill(w_.free + cells_ - stride_, w_.free + cells_, std::uint8_t{0});
        const std::uint8_t* const north = w_.free;
        const std::uint8_t* const here = north + stride_;
        const std::uint8_t* const south = here + stride_;
        std::uint8_t* const around = w_.around + stride_;
        const std::int64_t last = cells_ - 2 * stride_ - 1;
        for (std::int64_t n = 1; n < last; ++n) {
            const unsigned above = north[n - 1] | north[n] << 1 | north[n + 1] << 2;
            const unsigned below = south[n - 1] | south[n] << 1 | south[n + 1] << 2;
            around[n] = static_cast<std::uint8_t>(above | here[n - 1] << 3 | here[n + 1] << 4 | below << 5);
        }
    }

    // The first byte that is not 0 from `at` on, eight at a time; `end` if there is none.
    static const std::uint8_t* next_set(const std::uint8_t* at, const std::uint8_t* end) {
        for (std::uint64_t eight = 0; end - at >= 8; at += 8) {
            std::memcpy(&eight, at, 8);
            if (eight != 0) break;
        }
        while (at < end && *at == 0) ++at;
        return at;
    }

    // Enters the goals in the first list; returns their count.
    std::int64_t plant() {
        std::int64_t count = 0;
        const std::uint8_t* const end = p_.goals + p_.rows * p_.columns;
        for (const std::uint8_t* goal = next_set(p_.goals, end); goal < end; goal = next_set(goal + 1, end)) {
            const std::int64_t place = goal - p_.goals, cell = (place / p_.columns + 1) * stride_ + place % p_.columns + 1;
            if (!w_.free[cell]) continue;
            w_.cells[cell] = kGridWays.open[w_.around[cell]];
            w_.lists[0][count++] = static_cast<std::int32_t>(cell);
        }
        return count;
    }

    // Opens the cells of a list; returns their number. Has no branch on cell data: the processor could not predict it.
    std::int64_t follow(std::uint64_t list, const Waiting& open, Waiting& next, Waiting& after) const {
        std::uint64_t* const cells = w_.cells;
        const std::uint8_t* const around = w_.around;
        const int shift = shift_;
        std::int32_t* ends[2] = {next.cells + next.count, after.cells + after.count};
        std::int64_t done = open.count;
        for (const std::int32_t *at = open.cells, *end = at + open.count; at != end; ++at) {
            const std::int64_t cell = *at;
            const std::uint64_t own = cells[cell];
            if (own >> shift < list) {  // it got cheaper and was opened with an earlier list
                --done;
                continue;
            }
            for (auto ways = static_cast<unsigned>(own & kSet); ways != 0; ways &= ways - 1) {
                const Step& step = steps_[__builtin_ctz(ways)];
                const std::int64_t to = cell + step.way;
                const std::uint64_t price = (own & ~kSet) + step.price, before = cells[to];
                const std::uint64_t equal = before - price <= kSet ? before : 0;
                const std::uint64_t better = price | step.onward[around[to]] | equal;
                cells[to] = price > before ? before : better;
                __builtin_prefetch(cells + to + step.way, 1);
                __builtin_prefetch(around + to + step.way);
                std::int32_t*& place = ends[(price >> shift) - list - 1];
                *place = static_cast<std::int32_t>(to);
                place += before >> shift > price >> shift;
            }
        }
        next.count = ends[0] - next.cells;
        after.count = ends[1] - after.cells;
        return done;
    }

    // An integer below 2^52 in the fraction of a double is that double less 2^52; only kFar has the topmost bit.
    void to_metres() const {
        constexpr std::uint64_t kExponent = 0x4330000000000000, kInfinity = 0x7ff0000000000000;
        const double unit_m = p_.cell_m / one();
        std::uint64_t* const cells = w_.cells;
        const std::int64_t count = cells_;
        for (std::int64_t n = 0; n < count; ++n) {
            const std::uint64_t no_way = (0 - (cells[n] >> (kPriceBits + kSetBits - 1))) & kInfinity;
            const double price = __builtin_bit_cast(double, cells[n] >> kSetBits | kExponent) - 0x1p52;
            cells[n] = __builtin_bit_cast(std::uint64_t, price * unit_m + __builtin_bit_cast(double, no_way));
        }
    }

    const GridProblem p_;
    const PlainWork w_;
    const std::int64_t cells_, stride_;
    const int shift_;  // bits of a state below the integer part of its cost: fraction and set
    Step steps_[8];
};

}  // namespace eldorado
