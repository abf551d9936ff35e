// Binding of the global planner: each step works in the arrays of one workspace (global_field.py).
#pragma once

#include "bind.hpp"
#include "global_field.hpp"

namespace eldorado {

using Done = Array<std::int64_t, 1>;
using Cancel = Array<const std::uint8_t, 1>;

static GlobalMap map_of(const Array<const float, 2>& heights_m, float cell_m) {
    return {static_cast<std::int64_t>(heights_m.shape(0)), static_cast<std::int64_t>(heights_m.shape(1)), cell_m,
            heights_m.data()};
}

// The edges of the first node follow those of columns + 1 impassable nodes.
static std::int64_t first_edge(std::int64_t columns) { return kAxes * (columns + 1); }

static float layers_of(const GlobalMap& map, bool raw, float* edges_m, const Watch& watch) {
    std::vector<double> rows(3 * (map.columns + 2));
    std::vector<float> roughest(map.columns);
    return global_layers(map, raw, edges_m, rows.data(), roughest.data(), watch);
}

// Returns false if it was cancelled, as the functions below do.
static bool global_layers_into(Array<const float, 2> heights_m, float cell_m, bool raw, Array<float, 2> edges_m, Done done,
                               Cancel cancel) {
    const GlobalMap map = map_of(heights_m, cell_m);
    nb::gil_scoped_release unlocked;
    return layers_of(map, raw, edges_m.data() + first_edge(map.columns), {done.data(), cancel.data()}) >= 0.0f;
}

// prices: on the roughest ground, the least roughness that counts as the roughest, per roll, per pitch, limit.
static bool global_edges_into(Array<const float, 2> heights_m, float cell_m, Array<const float, 1> prices,
                              Array<float, 2> edges_m, Done done, Cancel cancel) {
    const GlobalMap map = map_of(heights_m, cell_m);
    const Watch watch{done.data(), cancel.data()};
    const float* const given = prices.data();
    float* const first = edges_m.data() + first_edge(map.columns);
    nb::gil_scoped_release unlocked;
    const float roughest_m = layers_of(map, false, first, watch);
    if (roughest_m < 0.0f) return false;
    const GlobalPrices per{given[0] / std::max(roughest_m, given[1]), given[2], given[3], given[4]};
    std::vector<float> rows(10 * (map.columns + 2), 0.0f);
    return global_edges(map, per, first, rows.data(), watch);
}

// True if there are no more seeds than nodes, every seed is a node and every cost is finite and >= 0.
static bool global_seeds_fit(Array<const std::int64_t, 1> seeds, Array<const double, 1> seed_costs_m, std::int64_t nodes) {
    const auto count = static_cast<std::int64_t>(seeds.size());
    bool fit = count <= nodes;
    for (std::int64_t s = 0; s < count; ++s)
        fit &= seeds.data()[s] >= 0 && seeds.data()[s] < nodes && seed_costs_m.data()[s] >= 0.0 &&
               seed_costs_m.data()[s] <= std::numeric_limits<double>::max();
    return fit;
}

static bool global_cost_to_go_into(Array<const float, 2> edges_m, float shortest_m, Array<const std::int64_t, 1> seeds,
                                   Array<const double, 1> seed_costs_m, Array<double, 1> words,
                                   Array<std::int32_t, 2> chunks, Done done, Cancel cancel, Array<float, 2> cost_m,
                                   Array<std::int32_t, 2> next_node) {
    const auto rows = static_cast<std::int64_t>(cost_m.shape(0)), columns = static_cast<std::int64_t>(cost_m.shape(1));
    const GlobalProblem problem{rows,         columns,           edges_m.data() + first_edge(columns),
                                shortest_m,   seeds.data(),      seed_costs_m.data(),
                                static_cast<std::int64_t>(seeds.size())};
    const GlobalWork work{words.data() + columns + 1, reinterpret_cast<Chunk*>(chunks.data())};
    nb::gil_scoped_release unlocked;
    return GlobalSearch(problem, work, {done.data(), cancel.data()}).run(cost_m.data(), next_node.data());
}

inline void bind_global(nb::module_& m) {
    m.def("global_layers_into", &global_layers_into);
    m.def("global_edges_into", &global_edges_into);
    m.def("global_seeds_fit", &global_seeds_fit);
    m.def("global_cost_to_go_into", &global_cost_to_go_into);
    m.attr("GLOBAL_CHUNK_NODES") = kChunkNodes;
    m.attr("GLOBAL_BUCKETS") = kBuckets;
}

}  // namespace eldorado
