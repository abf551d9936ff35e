// Least costs over the nodes of a map from a set of seeds: the whole cost-to-go field and each node's next (Eq. 26). No
// Python types, no exceptions, no heap.
//
// Buckets of equal width hold the open nodes. No edge is shorter than the width, so what leaves a bucket enters later ones
// and each node is expanded once, with its final cost (Dial 1969, Dinitz 1978). The buckets cover kBuckets widths from
// `base`; what is farther waits in one more and is dealt out when they are empty: edges may be as dear as they like. A node
// that gets cheaper leaves its old entry behind, to be dropped when found. Costs are summed in double precision: in single
// precision a way of a thousand edges is off by more than one in a million.
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
    const float* edges_m;  // (rows, columns, kAxes) and before it columns + 1 nodes more, all +inf
    float shortest_m;      // no edge is shorter
    const std::int64_t* seeds;
    const double* seed_costs_m;  // >= 0, what is left to go from each seed
    std::int64_t seed_count;
};

// Owned by the caller. cost_m: (rows, columns) with columns + 1 nodes more on either side. came: direction to the next
// node. chunks: room for an entry of each of the 8 edges into a node and of each seed, and kBuckets + 4 open chunks; few
// are ever touched.
struct GlobalWork {
    double* cost_m;
    std::uint8_t* came;
    Chunk* chunks;
};

class GlobalSearch {
   public:
    GlobalSearch(const GlobalProblem& problem, const GlobalWork& work, const Watch& watch)
        : p_(problem), w_(work), watch_(watch), nodes_(problem.rows * problem.columns), width_m_(0.999 * problem.shortest_m) {
        for (int k = 0; k < kAxes; ++k) {
            step_[k] = static_cast<std::int32_t>(kAxisRow[k] * p_.columns + kAxisColumn[k]);
            step_[k + kAxes] = -step_[k];
        }
    }

    // Fills cost_m and next_node (rows, columns): metres to the goal, +inf where there is no way; flat index of the next
    // node, itself where a seed's cost is the least, -1 without a way. False where it was cancelled: then neither is filled.
    bool run(float* cost_m, std::int32_t* next_node) {
        std::fill(w_.cost_m - p_.columns - 1, w_.cost_m + nodes_ + p_.columns + 1, kFar);
        for (std::int32_t& head : heads_) head = take_chunk(kNone);
        for (std::int64_t s = 0; s < p_.seed_count; ++s) base_m_ = std::min(base_m_, p_.seed_costs_m[s]);
        for (std::int64_t s = 0; s < p_.seed_count; ++s)
            if (p_.seed_costs_m[s] < w_.cost_m[p_.seeds[s]])
                improve(static_cast<std::int32_t>(p_.seeds[s]), p_.seed_costs_m[s], kSeed);
        do {
            for (std::int32_t bucket = 0; bucket < kBuckets; ++bucket)
                if (!settle(bucket)) return false;
        } while (deal_out());
        watch_.add(nodes_ - settled_);
        hand_over(cost_m, next_node);
        return true;
    }

   private:
    typedef double Sums __attribute__((vector_size(32)));
    typedef std::int64_t Bits __attribute__((vector_size(32)));
    static constexpr double kFar = std::numeric_limits<double>::infinity();
    static constexpr std::int32_t kNone = -1;
    static constexpr std::uint8_t kSeed = 2 * kAxes;

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

    // Returns the chunk after it.
    std::int32_t give_back(std::int32_t chunk) {
        const std::int32_t next = w_.chunks[chunk].next;
        w_.chunks[chunk].next = spare_;
        spare_ = chunk;
        return next;
    }

    // All chunks of a bucket, which is empty then.
    std::int32_t take_all(std::int32_t bucket) {
        const std::int32_t all = heads_[bucket];
        heads_[bucket] = take_chunk(kNone);
        return all;
    }

    // Keeps the node where `really`. Without a jump: whether a node changes its bucket cannot be foreseen.
    void enter(std::int32_t bucket, std::int32_t node, bool really) {
        std::int32_t& head = heads_[bucket];
        Chunk& chunk = w_.chunks[head];
        chunk.nodes[chunk.count] = node;
        chunk.count += really;
        if (chunk.count == kChunkNodes) head = take_chunk(head);
    }

    void improve(std::int32_t node, double cost_m, std::uint8_t came) {
        const std::int32_t bucket = bucket_of(cost_m), before = bucket_of(w_.cost_m[node]);
        w_.cost_m[node] = cost_m;
        w_.came[node] = came;
        enter(bucket, node, bucket != before);
    }

    // Which of the eight neighbours get cheaper is found without a jump too, four at a time.
    void expand(std::int32_t node) {
        const double *own = w_.cost_m + node, *north = own + p_.columns, *south = own - p_.columns;
        const float* ahead_m = p_.edges_m + kAxes * static_cast<std::int64_t>(node);
        const float* south_m = ahead_m - kAxes * p_.columns;
        const Sums ahead = {ahead_m[0], ahead_m[1], ahead_m[2], ahead_m[3]};
        const Sums back = {ahead_m[-kAxes], south_m[1 - kAxes], south_m[2], south_m[3 + kAxes]};
        const Sums through_m[2] = {own[0] + ahead, own[0] + back};
        const Bits better = ((through_m[0] < Sums{own[1], north[1], north[0], north[-1]}) & Bits{1, 2, 4, 8}) |
                            ((through_m[1] < Sums{own[-1], south[-1], south[0], south[1]}) & Bits{16, 32, 64, 128});
        auto left = static_cast<unsigned>((better[0] | better[1]) | (better[2] | better[3]));
        for (; left; left &= left - 1) {
            const int k = __builtin_ctz(left);
            improve(node + step_[k], through_m[k / kAxes][k % kAxes], static_cast<std::uint8_t>(k ^ kAxes));
        }
    }

    // False where it was cancelled.
    bool settle(std::int32_t bucket) {
        for (std::int32_t at = take_all(bucket); at != kNone; at = give_back(at)) {
            if (watch_.cancelled()) return false;
            const Chunk& chunk = w_.chunks[at];
            std::int64_t fresh = 0;
            for (std::int32_t e = 0; e < chunk.count; ++e) {
                if (bucket_of(w_.cost_m[chunk.nodes[e]]) != bucket) continue;
                expand(chunk.nodes[e]);
                ++fresh;
            }
            settled_ += fresh;
            watch_.add(fresh);
        }
        return true;
    }

    // Moves the base to the cheapest node that waits beyond the last bucket. False where none does.
    bool deal_out() {
        double next_m = kFar;
        for (std::int32_t at = heads_[kBuckets]; at != kNone; at = w_.chunks[at].next)
            for (std::int32_t e = 0; e < w_.chunks[at].count; ++e) {
                const double cost_m = w_.cost_m[w_.chunks[at].nodes[e]];
                if (bucket_of(cost_m) == kBuckets) next_m = std::min(next_m, cost_m);
            }
        base_m_ = next_m;
        for (std::int32_t at = take_all(kBuckets); at != kNone; at = give_back(at))
            for (std::int32_t e = 0; e < w_.chunks[at].count; ++e) {
                const double cost_m = w_.cost_m[w_.chunks[at].nodes[e]];
                if (cost_m >= base_m_) enter(bucket_of(cost_m), w_.chunks[at].nodes[e], true);
            }
        return next_m != kFar;
    }

    void hand_over(float* cost_m, std::int32_t* next_node) const {
        for (std::int64_t n = 0; n < nodes_; ++n) {
            const auto node = static_cast<std::int32_t>(n);
            const std::uint8_t came = w_.came[n];
            cost_m[n] = static_cast<float>(w_.cost_m[n]);
            next_node[n] = w_.cost_m[n] == kFar ? kNone : (came == kSeed ? node : node + step_[came]);
        }
    }

    const GlobalProblem p_;
    const GlobalWork w_;
    const Watch watch_;
    const std::int64_t nodes_;
    const double width_m_;  // a little under the shortest edge, so that rounding cannot undo the rule
    const double per_width_ = 1.0 / width_m_;
    double base_m_ = kFar;
    std::int32_t step_[2 * kAxes];
    std::int32_t heads_[kBuckets + 1];
    std::int32_t spare_ = kNone, fresh_ = 0;
    std::int64_t settled_ = 0;
};

}  // namespace eldorado
