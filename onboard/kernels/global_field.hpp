// Least costs over the nodes of a map from a set of seeds: the whole cost-to-go field and each node's next node (Eq.
// 26). No Python types, no exceptions, no heap.
//
// Buckets of equal width contain the open nodes. No edge is shorter than the width, so a node that leaves a bucket
// enters later ones, and each node is expanded once, with its final cost (Dial 1969, Dinitz 1978). The buckets cover
// kBuckets widths from `base`; farther nodes wait in one extra bucket and are distributed when the others are empty, so
// edges may have any cost. A node that gets cheaper leaves its old entry behind, which is dropped when found.
//
// The nodes of a bucket are independent of each other. So they are processed in chunks, in three loops without a branch
// on data, which the processor could not predict: nodes that are due, nodes that their edges make cheaper, insertion of
// these. The first loop prefetches the memory of the second.
//
// A node is one word, a double: the cost in metres, and in place of its last 4 bits the direction to the next node.
//
//      63      52                              4    0
//      | 0 exp  |  fraction of the cost        | way |     way: direction 0 to 7, kHere for a seed
//
// In single precision a path of a thousand edges would be off by more than one in a million, in these 48 bits a path of
// a hundred million is not. The smaller word wins: of equal paths the one of the lower direction, in any order of
// visits.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "global_layers.hpp"

namespace eldorado {

constexpr std::int32_t kBuckets = 64;
constexpr std::int32_t kChunkNodes = 62;

// A piece of a bucket: 256 bytes.
struct Chunk {
    std::int32_t next, count, nodes[kChunkNodes];
};

struct GlobalProblem {
    std::int64_t rows, columns;
    const float* edges_m;  // (rows, columns, kAxes) and before it columns + 1 more nodes, all +inf
    float shortest_m;      // no edge is shorter
    const std::int64_t* seeds;
    const double* seed_costs_m;  // >= 0, remaining cost from each seed
    std::int64_t seed_count;
};

// Owned by the caller. words: (rows, columns) with columns + 1 more nodes on either side. chunks: space for an entry of
// each of the 8 edges into a node and of each seed, and kBuckets + 4 open chunks; few are ever touched.
struct GlobalWork {
    double* words;
    Chunk* chunks;
};

// The directions in each set, one bit per direction, in order.
struct DirectionsOf {
    std::uint16_t in[256][8];
    std::uint8_t count[256];
};

constexpr DirectionsOf directions_of_sets() {
    DirectionsOf of{};
    for (unsigned set = 0; set < 256; ++set)
        for (std::uint16_t k = 0; k < 8; ++k)
            if (set >> k & 1) of.in[set][of.count[set]++] = k;
    return of;
}

inline constexpr DirectionsOf kDirectionsOf = directions_of_sets();

class GlobalSearch {
   public:
    GlobalSearch(const GlobalProblem& problem, const GlobalWork& work, const Watch& watch)
        : p_(problem), w_(work), watch_(watch), nodes_(problem.rows * problem.columns), width_m_(0.999 * problem.shortest_m) {
        for (int k = 0; k < kAxes; ++k) {
            step_[k] = static_cast<std::int32_t>(kAxisRow[k] * p_.columns + kAxisColumn[k]);
            step_[k + kAxes] = -step_[k];
        }
        step_[kHere] = 0;
    }

    // Fills cost_m and next_node (rows, columns): metres to the goal, +inf if there is no path; flat index of the next
    // node, itself if a seed's cost is the least, -1 without a path. Returns false if cancelled: then neither is
    // filled.
    bool run(float* cost_m, std::int32_t* next_node) {
        std::fill(w_.words - p_.columns - 1, w_.words + nodes_ + p_.columns + 1, kFar);
        for (std::int32_t& head : heads_) head = take_chunk(kNone);
        for (std::int64_t s = 0; s < p_.seed_count; ++s) base_m_ = std::min(base_m_, p_.seed_costs_m[s]);
        for (std::int64_t s = 0; s < p_.seed_count; ++s) {
            const std::int64_t cost = __builtin_bit_cast(std::int64_t, p_.seed_costs_m[s]);
            improve(static_cast<std::int32_t>(p_.seeds[s]), __builtin_bit_cast(double, (cost & ~kWay) | kHere));
        }
        do {
            for (std::int32_t bucket = 0; bucket < kBuckets; ++bucket)
                if (!settle(bucket)) return false;
        } while (deal_out());
        watch_.add(nodes_ - settled_);
        hand_over(cost_m, next_node);
        return true;
    }

   private:
    typedef float Edges __attribute__((vector_size(16)));
    typedef double Words __attribute__((vector_size(32)));
    typedef std::int64_t Bits __attribute__((vector_size(32)));
    static constexpr double kFar = std::numeric_limits<double>::infinity();
    static constexpr std::int32_t kNone = -1;
    static constexpr std::int64_t kWay = 15, kHere = 2 * kAxes;

    // 0 to kBuckets; kBuckets + 1 for a node that was not reached yet.
    std::int32_t bucket_of(double cost_m) const {
        const double widths = (cost_m - base_m_) * per_width_;
        return static_cast<std::int32_t>(std::min(widths, static_cast<double>(kBuckets))) + (cost_m == kFar);
    }

    std::int32_t take_chunk(std::int32_t next) {
        const std::int32_t chunk = spare_ == kNone ? fresh_++ : spare_;
        if (chunk == spare_) spare_ = w_.chunks[chunk].next;
        w_.chunks[chunk].next = next;
        w_.chunks[chunk].count = 0;
        return chunk;
    }

    // Returns the chunk that follows it.
    std::int32_t give_back(std::int32_t chunk) {
        const std::int32_t next = w_.chunks[chunk].next;
        w_.chunks[chunk].next = spare_;
        spare_ = chunk;
        return next;
    }

    // Takes all chunks of a bucket and leaves it empty.
    std::int32_t take_all(std::int32_t bucket) {
        const std::int32_t all = heads_[bucket];
        heads_[bucket] = take_chunk(kNone);
        return all;
    }

    // Stores the node if `really`.
    void enter(std::int32_t bucket, std::int32_t node, bool really) {
        std::int32_t& head = heads_[bucket];
        Chunk& chunk = w_.chunks[head];
        chunk.nodes[chunk.count] = node;
        chunk.count += really;
        if (chunk.count == kChunkNodes) head = take_chunk(head);
    }

    // If the bucket of a node's cost stays the same, the node waits there already.
    void improve(std::int32_t node, double word) {
        const double before = w_.words[node];
        const std::int32_t bucket = bucket_of(word);
        w_.words[node] = std::min(word, before);
        enter(bucket, node, bucket < bucket_of(before));
    }

    // Prefetches the ends of all data that `look` reads. Always inline: gcc drops calls of a function that only
    // prefetches.
    __attribute__((always_inline)) void fetch(std::int32_t node) const {
        const double* own = w_.words + node;
        const float* ahead_m = p_.edges_m + kAxes * static_cast<std::int64_t>(node);
        const float* south_m = ahead_m - kAxes * p_.columns;
        for (int end = -1; end <= 1; end += 2) {
            __builtin_prefetch(own + p_.columns + end, 1);
            __builtin_prefetch(own - p_.columns + end, 1);
        }
        __builtin_prefetch(ahead_m);
        __builtin_prefetch(ahead_m - kAxes);
        __builtin_prefetch(south_m - kAxes);
        __builtin_prefetch(south_m + 2 * kAxes - 1);
    }

    // Computes the words that the eight neighbours could have by this node, in order of direction; returns a bit for
    // each that gets cheaper. Beyond an impassable edge the word is not a number and nothing is cheaper.
    unsigned look(std::int32_t node, Words* words) const {
        const double *own = w_.words + node, *north = own + p_.columns, *south = own - p_.columns;
        const float* ahead_m = p_.edges_m + kAxes * static_cast<std::int64_t>(node);
        const float* south_m = ahead_m - kAxes * p_.columns;
        const Edges ahead = {ahead_m[0], ahead_m[1], ahead_m[2], ahead_m[3]};
        const Edges back = {ahead_m[-kAxes], south_m[1 - kAxes], south_m[2], south_m[3 + kAxes]};
        const Words on = own[0] + __builtin_convertvector(ahead, Words), off = own[0] + __builtin_convertvector(back, Words);
        words[0] = (Words)(((Bits)on & ~kWay) | Bits{4, 5, 6, 7});
        words[1] = (Words)(((Bits)off & ~kWay) | Bits{0, 1, 2, 3});
        const Bits better = ((words[0] < Words{own[1], north[1], north[0], north[-1]}) & Bits{1, 2, 4, 8}) |
                            ((words[1] < Words{own[-1], south[-1], south[0], south[1]}) & Bits{16, 32, 64, 128});
        return static_cast<unsigned>((better[0] | better[1]) | (better[2] | better[3]));
    }

    // Expands the nodes of a chunk that still belong to the bucket; returns their number. Never inline: within other
    // functions its loops do not get the registers that they need.
    __attribute__((noinline)) std::int32_t expand(const Chunk& chunk, std::int32_t bucket) {
        std::int32_t due[kChunkNodes], count = 0, found_count = 0;
        Words words[2 * kChunkNodes];
        std::uint16_t found[8 * kChunkNodes + 8];  // 8 x place in `due` + direction; the last store may write 8 too many
        for (std::int32_t e = 0; e < chunk.count; ++e) {
            due[count] = chunk.nodes[e];
            count += bucket_of(w_.words[chunk.nodes[e]]) == bucket;
            fetch(chunk.nodes[e]);
        }
        for (std::int32_t e = 0; e < count; ++e) {
            const unsigned better = look(due[e], words + 2 * e);
            for (int n = 0; n < 8; ++n)
                found[found_count + n] = static_cast<std::uint16_t>(kDirectionsOf.in[better][n] + 8 * e);
            found_count += kDirectionsOf.count[better];
        }
        for (std::int32_t f = 0; f < found_count; ++f)
            improve(due[found[f] / 8] + step_[found[f] % 8], words[found[f] / kAxes][found[f] % kAxes]);
        return count;
    }

    // Returns false if it was cancelled.
    bool settle(std::int32_t bucket) {
        for (std::int32_t at = take_all(bucket); at != kNone; at = give_back(at)) {
            if (watch_.cancelled()) return false;
            const std::int32_t fresh = expand(w_.chunks[at], bucket);
            settled_ += fresh;
            watch_.add(fresh);
        }
        return true;
    }

    // Moves the base to the cheapest node that waits beyond the last bucket. Returns false if there is none.
    bool deal_out() {
        double next_m = kFar;
        for (std::int32_t at = heads_[kBuckets]; at != kNone; at = w_.chunks[at].next)
            for (std::int32_t e = 0; e < w_.chunks[at].count; ++e) {
                const double cost_m = w_.words[w_.chunks[at].nodes[e]];
                if (bucket_of(cost_m) == kBuckets) next_m = std::min(next_m, cost_m);
            }
        base_m_ = next_m;
        for (std::int32_t at = take_all(kBuckets); at != kNone; at = give_back(at))
            for (std::int32_t e = 0; e < w_.chunks[at].count; ++e) {
                const double cost_m = w_.words[w_.chunks[at].nodes[e]];
                if (cost_m >= base_m_) enter(bucket_of(cost_m), w_.chunks[at].nodes[e], true);
            }
        return next_m != kFar;
    }

    void hand_over(float* cost_m, std::int32_t* next_node) const {
        for (std::int64_t n = 0; n < nodes_; ++n) {
            const double word = w_.words[n];
            const std::int32_t step = step_[__builtin_bit_cast(std::int64_t, word) & kWay];
            cost_m[n] = static_cast<float>(word);
            next_node[n] = word == kFar ? kNone : static_cast<std::int32_t>(n) + step;
        }
    }

    const GlobalProblem p_;
    const GlobalWork w_;
    const Watch watch_;
    const std::int64_t nodes_;
    const double width_m_;  // slightly less than the shortest edge, so that rounding cannot break the rule
    const double per_width_ = 1.0 / width_m_;
    double base_m_ = kFar;
    std::int32_t step_[2 * kAxes + 1];  // to the neighbour in each direction, and kHere
    std::int32_t heads_[kBuckets + 1];
    std::int32_t spare_ = kNone, fresh_ = 0;
    std::int64_t settled_ = 0;
};

}  // namespace eldorado
