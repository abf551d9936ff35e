// Least prices over poses (8 orientations, rows, columns) from a set of seeds. No Python types, no exceptions, no heap.
//
// The unit of work is a cell: its 8 orientations lie side by side in memory, as lanes of vector registers, so one visit moves
// all of them to a neighbour cell at once. A cell waits in the bucket of its cheapest lane that has not been passed on; a
// visit passes on the lanes of the open bucket and leaves the others for theirs. A lane that gets cheaper is passed on
// again, so the result is exact for any width of the buckets, and it does not depend on the order of visits. Prices are
// double: sums of float32 drift by more than 1e-6 on a long way.
//
// Cells have a rim of one closed cell around rows x columns; flat indices are of that padded field.
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
    double turn_m;                 // price of a turn to the next orientation
    const std::int64_t* seeds;     // states (o * rows + j) * columns + i, by rising cost
    const float* seed_costs_m;     // >= 0, what is left to go from each seed
    std::int64_t seed_count;
};

#if defined(__AVX512F__)
constexpr int kPoseLanes = 8;
#elif defined(__AVX2__)
constexpr int kPoseLanes = 4;
#else
constexpr int kPoseLanes = 2;
#endif
constexpr int kPoseParts = kOrientations / kPoseLanes;
typedef double PoseVector __attribute__((vector_size(kPoseLanes * sizeof(double))));
typedef std::int64_t PoseIndex __attribute__((vector_size(kPoseLanes * sizeof(std::int64_t))));

struct PoseLanes {
    PoseVector part[kPoseParts];

    double at(int o) const { return part[o / kPoseLanes][o % kPoseLanes]; }
    void set(int o, double value) { part[o / kPoseLanes][o % kPoseLanes] = value; }
};

// A cell's place in the list of its bucket.
struct PoseLink {
    std::int64_t bucket;
    std::int32_t next, previous;
};

// Owned by the caller: cells_needed() lanes and links (`halves` only with closeness); `heads` is a power of two and longer
// than dearest edge / width + 1.
struct PoseWork {
    PoseLanes* costs;
    PoseLanes* halves;  // of the closeness
    PoseLink* links;
    std::int32_t* heads;
    std::int64_t head_count;
    double width_m;
};

class PoseSearch {
   public:
    static std::int64_t cells_needed(std::int64_t rows, std::int64_t columns) { return (rows + 2) * (columns + 2); }

    PoseSearch(const PoseProblem& problem, const PoseWork& work)
        : p_(problem), w_(work), layer_(problem.rows * problem.columns), stride_(problem.columns + 2), per_width_(1.0 / work.width_m) {
        for (int o = 0; o < kOrientations; ++o)
            for (int k = 0; k < 8; ++k) moves_[k].set(o, p_.moves_m[8 * o + k]);
        for (int o = 0; o < kOrientations; ++o) turn_.set(o, p_.turn_m);
    }

    // Fills `cost` (8, rows, columns): metres to the nearest seed, +inf where there is no way.
    void run(float* cost) {
        begin();
        std::int64_t seed = 0;
        for (std::int64_t bucket = 0; open_ > 0 || seed < p_.seed_count; ++bucket) {
            if (open_ == 0) bucket = std::max(bucket, bucket_of(p_.seed_costs_m[seed]));
            for (; seed < p_.seed_count && bucket_of(p_.seed_costs_m[seed]) <= bucket; ++seed) plant(seed);
            std::int32_t& head = w_.heads[bucket & (w_.head_count - 1)];
            while (head != kNone) {
                const std::int32_t cell = head;
                unlink(cell);
                p_.closeness ? expand<true>(cell, bucket) : expand<false>(cell, bucket);
            }
        }
        for (std::int64_t j = 0; j < p_.rows; ++j)
            for (std::int64_t i = 0; i < p_.columns; ++i)
                for (int o = 0; o < kOrientations; ++o) {
                    const double least = w_.costs[padded(j, i)].at(o);
                    cost[o * layer_ + j * p_.columns + i] = static_cast<float>(least < 0.0 ? kFar : least);
                }
    }

   private:
    static constexpr double kFar = std::numeric_limits<double>::infinity();
    static constexpr double kClosed = -1.0;  // not passable: no price is lower
    static constexpr std::int32_t kNone = -1;
    static constexpr std::int64_t kAway = std::numeric_limits<std::int64_t>::max();  // in no bucket

    std::int64_t padded(std::int64_t j, std::int64_t i) const { return (j + 1) * stride_ + i + 1; }

    std::int64_t bucket_of(double cost) const { return static_cast<std::int64_t>(cost * per_width_); }

    void begin() {
        std::fill(w_.heads, w_.heads + w_.head_count, kNone);
        PoseLanes closed;
        for (int o = 0; o < kOrientations; ++o) closed.set(o, kClosed);
        for (std::int64_t cell = 0; cell < cells_needed(p_.rows, p_.columns); ++cell) {
            w_.costs[cell] = closed;
            w_.links[cell].bucket = kAway;
            if (p_.closeness) w_.halves[cell] = PoseLanes{};
        }
        for (std::int64_t j = 0; j < p_.rows; ++j)
            for (std::int64_t i = 0; i < p_.columns; ++i)
                for (int o = 0; o < kOrientations; ++o) {
                    const std::int64_t state = o * layer_ + j * p_.columns + i, cell = padded(j, i);
                    if (p_.freedom[state] >= p_.least_freedom) w_.costs[cell].set(o, kFar);
                    if (p_.closeness) w_.halves[cell].set(o, 0.5 * p_.closeness[state]);
                }
    }

    void plant(std::int64_t seed) {
        const std::int64_t state = p_.seeds[seed], place = state % layer_;
        const int o = static_cast<int>(state / layer_);
        const std::int64_t cell = padded(place / p_.columns, place % p_.columns);
        const double cost = p_.seed_costs_m[seed];
        if (!(cost < w_.costs[cell].at(o))) return;
        w_.costs[cell].set(o, cost);
        enter(cell, cost);
    }

    // Has the cell visited no later than in the bucket of `cost`.
    void enter(std::int64_t cell, double cost) {
        const std::int64_t bucket = bucket_of(cost);
        PoseLink& link = w_.links[cell];
        if (link.bucket <= bucket) return;
        if (link.bucket != kAway) unlink(cell);
        std::int32_t& head = w_.heads[bucket & (w_.head_count - 1)];
        link = {bucket, head, kNone};
        if (head != kNone) w_.links[head].previous = static_cast<std::int32_t>(cell);
        head = static_cast<std::int32_t>(cell);
        ++open_;
    }

    void unlink(std::int64_t cell) {
        const PoseLink link = w_.links[cell];
        (link.previous == kNone ? w_.heads[link.bucket & (w_.head_count - 1)] : w_.links[link.previous].next) = link.next;
        if (link.next != kNone) w_.links[link.next].previous = link.previous;
        w_.links[cell].bucket = kAway;
        --open_;
    }

    static PoseVector lower(PoseVector a, PoseVector b) { return a < b ? a : b; }

    // 0, 1, 2, ... + first.
    static constexpr PoseIndex counting(std::int64_t first) {
        PoseIndex index{};
        for (int n = 0; n < kPoseLanes; ++n) index[n] = first + n;
        return index;
    }

    static double least(PoseVector v) {
        for (int half = kPoseLanes / 2; half > 0; half /= 2) v = lower(v, __builtin_shuffle(v, counting(half)));
        return v[0];
    }

    // Offers `price` to every lane of a cell; the least of those that got cheaper, else +inf.
    static double offer(PoseLanes& cell, const PoseLanes& price) {
        const PoseVector far = PoseVector{} + kFar;
        PoseVector cheaper = far;
        for (int n = 0; n < kPoseParts; ++n) cheaper = lower(cheaper, price.part[n] < cell.part[n] ? price.part[n] : far);
        const double found = least(cheaper);
        if (found < kFar)
            for (int n = 0; n < kPoseParts; ++n) cell.part[n] = lower(price.part[n], cell.part[n]);
        return found;
    }

    // from + price of the way to lanes whose half closeness is `there`.
    template <bool kSoft>
    static PoseLanes sum(const PoseLanes& from, const PoseLanes& price, const PoseLanes* here, const PoseLanes* there) {
        PoseLanes out;
        for (int n = 0; n < kPoseParts; ++n)
            if constexpr (kSoft) out.part[n] = from.part[n] + price.part[n] * (1.0 + (here->part[n] + there->part[n]));
            else out.part[n] = from.part[n] + price.part[n];
        return out;
    }

    // Lane o of the result is lane o + 1 (o - 1 for kBack) of `lanes`, round the circle.
    template <bool kBack>
    static PoseLanes turned(const PoseLanes& lanes) {
        PoseLanes out;
        for (int n = 0; n < kPoseParts; ++n) {
            const PoseVector own = lanes.part[n];
            if constexpr (kBack) {
                const PoseVector before = lanes.part[(n + kPoseParts - 1) % kPoseParts];
                out.part[n] = __builtin_shuffle(before, own, counting(kPoseLanes - 1));
            } else {
                out.part[n] = __builtin_shuffle(own, lanes.part[(n + 1) % kPoseParts], counting(1));
            }
        }
        return out;
    }

    // The least prices after one turn, to either side.
    template <bool kSoft>
    PoseLanes turns(const PoseLanes& from, const PoseLanes* half) const {
        PoseLanes out = turned<false>(from), back = turned<true>(from);
        if constexpr (kSoft) {
            const PoseLanes ahead_half = turned<false>(*half), back_half = turned<true>(*half);
            out = sum<true>(out, turn_, &ahead_half, half);
            back = sum<true>(back, turn_, &back_half, half);
        } else {
            out = sum<false>(out, turn_, nullptr, nullptr);
            back = sum<false>(back, turn_, nullptr, nullptr);
        }
        for (int n = 0; n < kPoseParts; ++n) out.part[n] = lower(out.part[n], back.part[n]);
        return out;
    }

    template <bool kSoft>
    void expand(std::int32_t cell, std::int64_t bucket) {
        PoseLanes& own = w_.costs[cell];
        const PoseLanes* const half = kSoft ? w_.halves + cell : nullptr;
        const PoseVector far = PoseVector{} + kFar;
        const auto begins = static_cast<double>(bucket), ends = static_cast<double>(bucket + 1);
        PoseLanes from;
        for (int n = 0; n < kPoseParts; ++n) {
            const PoseVector place = own.part[n] * per_width_;
            from.part[n] = (place >= begins) & (place < ends) ? own.part[n] : far;
        }
        double next = offer(own, turns<kSoft>(from, half));
        if (!(next * per_width_ < ends)) {
            PoseVector later = far;
            for (int n = 0; n < kPoseParts; ++n)
                later = lower(later, own.part[n] * per_width_ >= ends ? own.part[n] : far);
            next = least(later);
        }
        if (next < kFar) enter(cell, next);
        const std::int64_t way[8] = {1, stride_ + 1, stride_, stride_ - 1, -1, -stride_ - 1, -stride_, -stride_ + 1};
#pragma GCC unroll 8
        for (int k = 0; k < 8; ++k) {
            const std::int64_t to = cell + way[k];
            const double found = offer(w_.costs[to], sum<kSoft>(from, moves_[k], half, kSoft ? w_.halves + to : nullptr));
            if (found < kFar) enter(to, found);
        }
    }

    const PoseProblem p_;
    const PoseWork w_;
    const std::int64_t layer_, stride_;
    const double per_width_;
    PoseLanes moves_[8], turn_;
    std::int64_t open_ = 0;
};

}  // namespace eldorado
