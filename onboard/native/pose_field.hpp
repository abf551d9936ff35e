// Least prices over poses (8 orientations, rows, columns) from a set of seeds. No Python types, no exceptions, no heap.
//
// Buckets of equal width hold the open states in linked lists; a state that gets cheaper moves to its new bucket. Where the
// width is at most the cheapest edge no state is opened twice (Dinitz 1978, Dial 1969); where it is wider the result is the
// same, found with repeats: the least prices do not depend on the order.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace eldorado {

constexpr int kOrientations = 8;

struct PoseProblem {
    std::int64_t rows, columns;
    const std::uint8_t* freedom;   // (8, rows, columns): 0 blocked, 1 unknown, 2 free
    std::uint8_t least_freedom;    // passable from this value on
    const float* closeness;        // (8, rows, columns) >= 0, or null
    const float* moves_m;          // (8 orientations, 8 directions): price of a move, direction k is k * 45 degrees
    float turn_m;                  // price of a turn to the next orientation
    const std::int64_t* seeds;     // states (o * rows + j) * columns + i, by rising cost
    const float* seed_costs_m;     // >= 0, what is left to go from each seed
    std::int64_t seed_count;
};

struct PoseLink {
    std::int32_t next, previous;
};

// Owned by the caller: one link per state; `heads` is a power of two and longer than dearest edge / width + 1.
struct PoseWork {
    PoseLink* links;
    std::int32_t* heads;
    std::int64_t head_count;
    float width_m;
};

class PoseSearch {
   public:
    PoseSearch(const PoseProblem& problem, const PoseWork& work, float* cost)
        : p_(problem), w_(work), cost_(cost), layer_(problem.rows * problem.columns), per_width_(1.0f / work.width_m) {}

    // Fills `cost` (8, rows, columns): metres to the nearest seed, +inf where there is no way.
    void run() {
        constexpr float far = std::numeric_limits<float>::infinity();
        for (std::int64_t s = 0; s < kOrientations * layer_; ++s) cost_[s] = p_.freedom[s] >= p_.least_freedom ? far : kClosed;
        std::fill(w_.heads, w_.heads + w_.head_count, kNone);
        std::int64_t seed = 0;
        for (std::int64_t bucket = 0; open_ > 0 || seed < p_.seed_count; ++bucket) {
            if (open_ == 0) bucket = std::max(bucket, bucket_of(p_.seed_costs_m[seed]));
            for (; seed < p_.seed_count && bucket_of(p_.seed_costs_m[seed]) <= bucket; ++seed)
                improve(p_.seeds[seed], p_.seed_costs_m[seed]);
            std::int32_t& head = w_.heads[bucket & (w_.head_count - 1)];
            while (head != kNone) {
                const std::int32_t state = head;
                unlink(state);
                p_.closeness ? expand<true>(state) : expand<false>(state);
            }
        }
        for (std::int64_t s = 0; s < kOrientations * layer_; ++s)
            if (cost_[s] == kClosed) cost_[s] = far;
    }

   private:
    static constexpr std::int32_t kNone = -1;
    static constexpr float kClosed = -1.0f;  // not passable: no price is lower

    std::int64_t bucket_of(float cost) const { return static_cast<std::int64_t>(cost * per_width_); }

    std::int32_t& head_of(float cost) { return w_.heads[bucket_of(cost) & (w_.head_count - 1)]; }

    void unlink(std::int64_t state) {
        const std::int32_t next = w_.links[state].next, previous = w_.links[state].previous;
        (previous == kNone ? head_of(cost_[state]) : w_.links[previous].next) = next;
        if (next != kNone) w_.links[next].previous = previous;
        w_.links[state].previous = kAway;
        --open_;
    }

    void improve(std::int64_t state, float cost) {
        if (!(cost < cost_[state])) return;
        if (cost_[state] != std::numeric_limits<float>::infinity() && w_.links[state].previous != kAway) unlink(state);
        cost_[state] = cost;
        std::int32_t& head = head_of(cost);
        w_.links[state].next = head;
        w_.links[state].previous = kNone;
        if (head != kNone) w_.links[head].previous = static_cast<std::int32_t>(state);
        head = static_cast<std::int32_t>(state);
        ++open_;
    }

    template <bool kSoft>
    void edge(float from, std::int64_t state, std::int64_t to, float price) {
        if constexpr (kSoft) price *= 1.0f + 0.5f * (p_.closeness[state] + p_.closeness[to]);
        improve(to, from + price);
    }

    template <bool kSoft>
    void expand(std::int32_t state) {
        static constexpr std::int32_t kColumn[8] = {1, 1, 0, -1, -1, -1, 0, 1}, kRow[8] = {0, 1, 1, 1, 0, -1, -1, -1};
        const auto layer = static_cast<std::int32_t>(layer_), columns = static_cast<std::int32_t>(p_.columns);
        const std::int32_t o = state / layer, cell = state - o * layer, j = cell / columns, i = cell - j * columns;
        const float from = cost_[state];
        const float* moves_m = p_.moves_m + 8 * o;
        if (i > 0 && i < columns - 1 && j > 0 && j < p_.rows - 1) {
            for (int k = 0; k < 8; ++k) edge<kSoft>(from, state, state + kRow[k] * columns + kColumn[k], moves_m[k]);
        } else {
            for (int k = 0; k < 8; ++k) {
                const std::int32_t row = j + kRow[k], column = i + kColumn[k];
                if (row < 0 || row >= p_.rows || column < 0 || column >= columns) continue;
                edge<kSoft>(from, state, state + kRow[k] * columns + kColumn[k], moves_m[k]);
            }
        }
        edge<kSoft>(from, state, o == kOrientations - 1 ? cell : state + layer, p_.turn_m);
        edge<kSoft>(from, state, o == 0 ? cell + (kOrientations - 1) * layer : state - layer, p_.turn_m);
    }

    static constexpr std::int32_t kAway = -2;  // in no bucket

    const PoseProblem p_;
    const PoseWork w_;
    float* const cost_;
    const std::int64_t layer_;
    const float per_width_;
    std::int64_t open_ = 0;
};

}  // namespace eldorado
