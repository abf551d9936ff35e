// Least costs over the cells of a grid from a set of goal cells (Jarvis' distance transform, exact), with closeness;
// without it plain_search.hpp is faster. No Python types, no exceptions, no heap: the caller owns every array.
//
// Costs are in cells, double: 1 or sqrt(2) for a step, times 1 + the mean closeness of its ends. Cells wait in buckets
// one cell wide, which is the cheapest step, so no step leads back into the open bucket and every cell is opened once
// (Dial 1969). A cell whose cost falls is entered again if that changes its bucket, and its old entry is skipped.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "grid_problem.hpp"

namespace eldorado {

// A block of waiting cells: one cache line.
struct GridBlock {
    static constexpr std::int32_t kSize = 15;
    std::int32_t cell[kSize];
    std::int32_t next;
};

struct GridBucket {
    std::int32_t block, filled;  // the block being filled, none: -1
};

// `bucket_count`: a power of two, above the most expensive step + 1. `blocks`: blocks_needed() of them.
struct GridWork {
    GridBlock* blocks;
    GridBucket* buckets;
    std::int64_t bucket_count;
    GridWatch watch;
};

class GridSearch {
   public:
    // A cell is entered at most once by each of its 8 neighbours and once in each of the buckets open at a time.
    static std::int64_t blocks_needed(const GridProblem& problem, std::int64_t bucket_count) {
        const std::int64_t entries = problem.rows * problem.columns * std::min<std::int64_t>(8, bucket_count);
        return entries / GridBlock::kSize + 1 + bucket_count;
    }

    // cost: (rows + 2, columns + 2).
    GridSearch(const GridProblem& problem, const GridWork& work, double* cost)
        : p_(problem), w_(work), cost_(cost), stride_(problem.columns + 2) {
        for (int k = 0, j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i)
                if (j != 0 && i != 0) steps_[k++] = {j * stride_ + i, j * stride_, i, kGridDiagonal};
                else if (j != 0 || i != 0) steps_[k++] = {j * stride_ + i, 0, 0, 1.0};
    }

    // Fills `cost`: metres to the nearest goal, +inf if there is no path and on the rim. Returns false if cancelled.
    bool run() {
        __atomic_store_n(w_.watch.progress, 0, __ATOMIC_RELAXED);
        begin();
        for (std::int64_t bucket = 0; open_ > 0; ++bucket) {
            if (__atomic_load_n(w_.watch.cancel, __ATOMIC_RELAXED) != 0) return false;
            empty(bucket);
            __atomic_store_n(w_.watch.progress, done_, __ATOMIC_RELAXED);
        }
        const double cell_m = p_.cell_m;
        double* const end = cost_ + (p_.rows + 2) * stride_;
        for (double* cost = cost_; cost != end; ++cost) {
            const double metres = *cost * cell_m;
            *cost = metres < 0.0 ? kFar : metres;
        }
        __atomic_store_n(w_.watch.progress, p_.rows * p_.columns, __ATOMIC_RELAXED);
        return true;
    }

   private:
    static constexpr double kFar = std::numeric_limits<double>::infinity();
    static constexpr double kClosed = -1.0;  // an obstacle: no cost is lower
    static constexpr std::int32_t kNone = -1;

    // To a neighbour at index offset `way`; a diagonal step passes between cells `beside` and `across` (0: the cell
    // itself).
    struct Step {
        std::int64_t way, beside, across;
        double price;
    };

    void begin() {
        std::fill(w_.buckets, w_.buckets + w_.bucket_count, GridBucket{kNone, GridBlock::kSize});
        std::fill(cost_, cost_ + stride_, kClosed);
        for (std::int64_t j = 0; j < p_.rows; ++j) {
            double* row = cost_ + (j + 1) * stride_;
            const std::uint8_t* free = p_.free + j * p_.columns;
            row[0] = row[stride_ - 1] = kClosed;
            const std::int64_t columns = p_.columns;
            for (std::int64_t i = 0; i < columns; ++i) row[i + 1] = free[i] ? kFar : kClosed;
        }
        std::fill(cost_ + (p_.rows + 1) * stride_, cost_ + (p_.rows + 2) * stride_, kClosed);
        for (std::int64_t j = 0; j < p_.rows; ++j)
            for (std::int64_t i = 0; i < p_.columns; ++i)
                if (p_.goals[j * p_.columns + i]) improve((j + 1) * stride_ + i + 1, 0.0);
    }

    void empty(std::int64_t bucket) {
        GridBucket& from = w_.buckets[bucket & (w_.bucket_count - 1)];
        std::int32_t block = from.block, filled = from.filled;
        from = {kNone, GridBlock::kSize};
        while (block != kNone) {
            GridBlock& waiting = w_.blocks[block];
            for (std::int32_t k = 0; k < filled; ++k) {
                const std::int32_t cell = waiting.cell[k];
                if (static_cast<std::int64_t>(cost_[cell]) != bucket) continue;
                ++done_;
                expand(cell);
            }
            open_ -= filled;
            filled = GridBlock::kSize;
            const std::int32_t next = waiting.next;
            waiting.next = spare_;
            spare_ = block;
            block = next;
        }
    }

    // The neighbours (of 8) that would get cheaper on open ground are found without a branch, which the processor could
    // not predict; these few are then examined one by one.
    void expand(std::int64_t cell) {
        const double from = cost_[cell], straight = from + 1.0, slant = from + kGridDiagonal;
        const double* const at = cost_ + cell;
        const double* const north = at - stride_;
        const double* const south = at + stride_;
        unsigned cheaper = static_cast<unsigned>(slant < north[-1]) | static_cast<unsigned>(straight < north[0]) << 1 |
                           static_cast<unsigned>(slant < north[1]) << 2 | static_cast<unsigned>(straight < at[-1]) << 3 |
                           static_cast<unsigned>(straight < at[1]) << 4 | static_cast<unsigned>(slant < south[-1]) << 5 |
                           static_cast<unsigned>(straight < south[0]) << 6 | static_cast<unsigned>(slant < south[1]) << 7;
        for (; cheaper != 0; cheaper &= cheaper - 1) {
            const Step& step = steps_[__builtin_ctz(cheaper)];
            if (at[step.beside] < 0.0 && at[step.across] < 0.0) continue;
            const double ratio = 1.0 + 0.5 * (closeness_at(cell) + closeness_at(cell + step.way));
            improve(cell + step.way, from + step.price * ratio);
        }
    }

    double closeness_at(std::int64_t cell) const {
        return p_.closeness[cell - stride_ - 1 - 2 * (cell / stride_ - 1)];
    }

    void improve(std::int64_t cell, double cost) {
        const double before = cost_[cell];
        if (!(cost < before)) return;
        cost_[cell] = cost;
        const auto bucket = static_cast<std::int64_t>(cost);
        if (before < static_cast<double>(bucket + 1)) return;
        GridBucket& into = w_.buckets[bucket & (w_.bucket_count - 1)];
        if (into.filled == GridBlock::kSize) into = {take(into.block), 0};
        w_.blocks[into.block].cell[into.filled++] = static_cast<std::int32_t>(cell);
        ++open_;
    }

    // An empty block in front of `next`.
    std::int32_t take(std::int32_t next) {
        std::int32_t block = spare_;
        if (block == kNone) block = taken_++;
        else spare_ = w_.blocks[block].next;
        w_.blocks[block].next = next;
        return block;
    }

    const GridProblem p_;
    const GridWork w_;
    double* const cost_;
    const std::int64_t stride_;
    Step steps_[8];
    std::int64_t open_ = 0, done_ = 0;
    std::int32_t spare_ = kNone, taken_ = 0;
};

}  // namespace eldorado
