// Least costs over poses (8 orientations, rows, columns) from a set of seeds. No Python types, no exceptions, no heap.
//
// The unit of work is a cell: its 8 orientations are the lanes of one vector, so one visit moves all of them to a neighbour
// cell at once. Costs are processed in bands: a visit propagates the lanes of the open band and leaves the others for
// later bands. Cells wait in two lists, one for the next round of the open band and one for the bands after it; a cell
// is at most once in each. A lane that gets cheaper is propagated again, so the result is exact for any width of the
// bands, and it does not depend on the order of visits.
//
// Costs are integers of a small unit: sums are exact, only the cost of an edge is rounded. (Sums of float32 drift by
// more than 1e-6 on a long path, double fills twice the registers.) They count from `base_`: when a band ends beyond
// kLimit, the settled costs are written out and closed, and the rest is counted from there.
//
// Cells have a rim of one closed cell around rows x columns; flat indices are of that padded field.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "eight.hpp"

namespace eldorado {

constexpr int kOrientations = 8;

struct PoseProblem {
    std::int64_t rows, columns;
    const std::uint8_t* freedom;   // (8, rows, columns): 0 blocked, 1 unknown, 2 free
    std::uint8_t least_freedom;    // passable from this value on
    const float* closeness;        // (8, rows, columns) >= 0, or null
    const float* moves_m;          // (8 orientations, 8 directions): cost of a move, direction k is k * 45 degrees
    double turn_m;                 // cost of a turn to the next orientation
    const std::int64_t* seeds;     // states (o * rows + j) * columns + i, by rising cost
    const float* seed_costs_m;     // >= 0, remaining cost from each seed
    std::int64_t seed_count;
};

// Owned by the caller: cells_needed() of each but `halves`, which is null without closeness.
struct PoseWork {
    EightInts* costs;
    EightFloats* halves;     // of the closeness
    std::int32_t* lists[3];  // one place longer: a push writes first
    std::uint8_t* in[2];     // True for cells that wait for the open band, and for those after it
    double unit_m;           // no edge costs more than 2^28 of them
    std::int32_t width;      // of a band, in units, below 2^27
};

class PoseSearch {
   public:
    static std::int64_t cells_needed(std::int64_t rows, std::int64_t columns) { return (rows + 2) * (columns + 2); }

    PoseSearch(const PoseProblem& problem, const PoseWork& work, float* cost)
        : p_(problem), w_(work), cost_(cost), layer_(problem.rows * problem.columns), stride_(problem.columns + 2) {
        for (int o = 0; o < kOrientations; ++o)
            for (int k = 0; k < 8; ++k) moves_[k][o] = units(p_.moves_m[8 * o + k]);
        turn_ = eight_times(units(p_.turn_m));
        for (int k = 0; k < 8; ++k) edges_[k] = whole(moves_[k]);
    }

    // Fills `cost` (8, rows, columns): metres to the nearest seed, +inf if there is no path.
    void run() {
        begin();
        Waiting open{w_.lists[0], 0, w_.in[0]}, again{w_.lists[1], 0, w_.in[0]}, later{w_.lists[2], 0, w_.in[1]};
        for (std::int64_t seed = 0; later.count > 0 || seed < p_.seed_count; begins_ += w_.width) {
            if (later.count == 0) skip_to(std::floor(left(seed)));
            else if (begins_ > kLimit) rebase(begins_);
            std::swap(open, later);
            again.in = open.in;
            for (; seed < p_.seed_count && left(seed) < begins_ + w_.width; ++seed) plant(seed, open);
            for (; open.count > 0; std::swap(open, again)) {
                p_.closeness ? visit<true>(open, again, later) : visit<false>(open, again, later);
                open.count = 0;
            }
        }
        settle(kFar);
    }

   private:
    static constexpr std::int32_t kFar = 3 << 29;    // + the cost of an edge is within int32
    static constexpr std::int32_t kLimit = 1 << 30;  // + a band + the cost of an edge is below kFar
    static constexpr std::int32_t kClosed = -1;      // not passable: no cost is lower
    static constexpr int kTurns = 4;                 // per visit: the number of turns to the farthest orientation

    struct Waiting {
        std::int32_t* cells;
        std::int64_t count;
        std::uint8_t* in;
    };

    float units(double price_m) const { return static_cast<float>(std::floor(price_m / w_.unit_m + 0.5)); }

    // Remaining cost from a seed, in units from base_.
    double left(std::int64_t seed) const { return p_.seed_costs_m[seed] / w_.unit_m - base_; }

    void begin() {
        const std::int64_t cells = cells_needed(p_.rows, p_.columns), layer = layer_;
        for (std::uint8_t* in : w_.in) std::fill(in, in + cells, std::uint8_t{0});
        std::fill(w_.costs, w_.costs + cells, eight_times(kClosed));
        std::fill(cost_, cost_ + kOrientations * layer, std::numeric_limits<float>::infinity());
        const std::uint8_t least = p_.least_freedom;
        for (std::int64_t j = 0; j < p_.rows; ++j) {
            const std::uint8_t* const freedom = p_.freedom + j * p_.columns;
            EightInts* const row = w_.costs + (j + 1) * stride_ + 1;
            for (std::int64_t i = 0; i < p_.columns; ++i)
                for (int o = 0; o < kOrientations; ++o) row[i][o] = freedom[o * layer + i] >= least ? kFar : kClosed;
        }
        if (!p_.closeness) return;
        std::fill(w_.halves, w_.halves + cells, EightFloats{});
        for (std::int64_t j = 0; j < p_.rows; ++j) {
            const float* const closeness = p_.closeness + j * p_.columns;
            EightFloats* const row = w_.halves + (j + 1) * stride_ + 1;
            for (std::int64_t i = 0; i < p_.columns; ++i)
                for (int o = 0; o < kOrientations; ++o) row[i][o] = 0.5f * closeness[o * layer + i];
        }
    }

    // Writes out the costs below `end`.
    void settle(std::int32_t end) {
        const std::int64_t layer = layer_, columns = p_.columns;
        const double base = base_, unit_m = w_.unit_m;
        const EightInts closed = eight_times(kClosed), ends = eight_times(end);
        for (std::int64_t j = 0; j < p_.rows; ++j) {
            const EightInts* const row = w_.costs + (j + 1) * stride_ + 1;
            float* const cost = cost_ + j * p_.columns;
            for (std::int64_t i = 0; i < columns; ++i) {
                float metres[kOrientations];
                for (int o = 0; o < kOrientations; ++o) metres[o] = static_cast<float>((base + row[i][o]) * unit_m);
                const EightInts done = (closed < row[i]) & (row[i] < ends);
                for (int o = 0; o < kOrientations; ++o) cost[o * layer + i] = done[o] ? metres[o] : cost[o * layer + i];
            }
        }
    }

    // Opens a band that begins at `place` or after it; there are none before.
    void skip_to(double place) {
        const double begins = std::max<double>(begins_, place);
        if (begins > kLimit) rebase(begins);
        else begins_ = static_cast<std::int32_t>(begins);
    }

    // Counts costs from `by` units further on; costs below the open band are settled.
    void rebase(double by) {
        settle(begins_);
        for (std::int64_t cell = 0; cell < cells_needed(p_.rows, p_.columns); ++cell) {
            EightInts& own = w_.costs[cell];
            for (int o = 0; o < kOrientations; ++o)
                if (own[o] < kFar) own[o] = own[o] < begins_ ? kClosed : own[o] - begins_;
        }
        base_ += by;
        begins_ = 0;
    }

    void plant(std::int64_t seed, Waiting& open) {
        const std::int64_t state = p_.seeds[seed], place = state % layer_, o = state / layer_;
        const std::int64_t cell = (place / p_.columns + 1) * stride_ + place % p_.columns + 1;
        const auto cost = static_cast<std::int32_t>(std::max(0.0, left(seed)));
        if (cost >= w_.costs[cell][o]) return;
        w_.costs[cell][o] = cost;
        push(open, cell, true);
    }

    // Without a branch, because the processor cannot predict whether a cell waits already.
    static void push(Waiting& list, std::int64_t cell, bool wanted) {
        const std::uint8_t in = list.in[cell];
        list.cells[list.count] = static_cast<std::int32_t>(cell);
        list.count += wanted > in;
        list.in[cell] = in | wanted;
    }

    // The cost of an edge between lanes of which `near` is the sum of half closenesses.
    template <bool kSoft>
    static EightInts priced(const EightFloats& price, const EightFloats& near) {
        return whole(kSoft ? price * (eight_times(1.0f) + near) : price);
    }

    // Visits the cells of a list. Fills `again` for the open band, `later` for those after it.
    template <bool kSoft>
    void visit(const Waiting& open, Waiting& again, Waiting& later) const {
        const std::int64_t way[8] = {1, stride_ + 1, stride_, stride_ - 1, -1, -stride_ - 1, -stride_, -stride_ + 1};
        const EightInts far = eight_times(kFar), begins = eight_times(begins_), ends = eight_times(begins_ + w_.width);
        EightInts* const costs = w_.costs;
        const EightFloats* const halves = w_.halves;
        Waiting soon = again, then = later;  // local variables: no store can change them
        for (std::int64_t n = 0; n < open.count; ++n) {
            const std::int64_t cell = open.cells[n];
            open.in[cell] = 0;
            const EightFloats half = kSoft ? halves[cell] : EightFloats{};
            const EightInts ahead = priced<kSoft>(turn_, half + rolled<1>(half)), back = rolled<7>(ahead);
            EightInts own = costs[cell], from = far;
            for (int turns = 0; turns < kTurns; ++turns) {
                from = choose((own >= begins) & (own < ends), own, far);
                own = lower(own, lower(rolled<1>(from) + ahead, rolled<7>(from) + back));
            }
            costs[cell] = own;
            push(soon, cell, any((own < from) & (own < ends) & (own >= begins)));
            push(then, cell, any((own >= ends) & (own < far)));
#pragma GCC unroll 8
            for (int k = 0; k < 8; ++k) {
                const std::int64_t to = cell + way[k];
                const EightInts before = costs[to];
                const EightInts price = from + (kSoft ? priced<true>(moves_[k], half + halves[to]) : edges_[k]);
                const EightInts cheaper = price < before, near = price < ends;
                costs[to] = lower(price, before);
                push(soon, to, any(cheaper & near));
                push(then, to, any(cheaper & ~near));
            }
        }
        again.count = soon.count;
        later.count = then.count;
    }

    const PoseProblem p_;
    const PoseWork w_;
    float* const cost_;
    const std::int64_t layer_, stride_;
    EightFloats moves_[8], turn_;  // in units, integers
    EightInts edges_[8];           // moves_
    double base_ = 0.0;         // in units
    std::int32_t begins_ = 0;   // the open band, from base_
};

}  // namespace eldorado
