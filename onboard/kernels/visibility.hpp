// Visibility from the nodes of a map (Algorithm 1 and Eq. 6, corrected), one node at a time: the reference of
// visibility_total.hpp, and the view of a single node. No Python types, no exceptions, no heap.
//
// A beam is a list of cells (di, dj) away from the observer, the same list for every observer, |di| and |dj| never falling.
// Slope S = (z - z_s) * inverse distance; a cell is visible if S >= S_max - 1e-6, S_max the steepest before it, from -inf.
// Every sample counts a share of its cell, an integer; the shares of one cell sum to `whole`, so sums are exact.
#pragma once

#include <cstdint>
#include <limits>

namespace eldorado {

constexpr float kSlopeTolerance = 1e-6f;
constexpr float kLevel = std::numeric_limits<float>::lowest();  // S_max at the start; off-map cells at -inf are below

struct BeamTable {
    std::int64_t beams, steps;
    const std::int32_t *dj, *di;   // (beams, steps)
    const float* inverse_pm;       // (beams, steps): 1 / distance of the sampled cell
    const std::int32_t* share;     // (beams, steps)
};

// Row-major, one value for each cell.
struct SightMap {
    std::int64_t rows, columns;
    const float* height_m;         // finite
    const float* veil;             // added to S before it raises S_max: 0, -inf (never hides) or +inf (hides all); or null
    const std::int32_t* target;    // -1 where a visible cell counts as fresh, else 0; or null
};

// Requested nodes and their sectors.
struct SightQuestion {
    float eye_m;                   // above the node's own height
    const std::uint8_t* where;     // 0 = skip this node; or null
    const std::int32_t* first;     // first beam of each node's sector; or null: all beams
    std::int64_t width;            // beams in the sector
    std::int64_t heading_width;    // beams in the sector whose best heading is computed
};

// Sums of shares for each node; skipped nodes are not written. fresh and heading (a beam's number) need `target`.
struct SightSums {
    std::int32_t *seen, *in_range, *fresh, *heading;
};

// Owned by the caller: nodes done so far, and a flag that stops the run when it is not 0.
struct SightControl {
    std::int64_t* done;
    const std::uint8_t* cancel;

    void advance(std::int64_t nodes) const { __atomic_fetch_add(done, nodes, __ATOMIC_RELAXED); }
    bool cancelled() const { return __atomic_load_n(cancel, __ATOMIC_RELAXED) != 0; }
};

inline bool in_sector(std::int64_t beam, std::int64_t first, std::int64_t width, std::int64_t beams) {
    return (beam >= first ? beam - first : beam - first + beams) < width;
}

// Calls each(cell, share, visible) for the cells of one beam up to the border of the map.
template <bool kVeiled, typename Each>
void walk(const BeamTable& table, const SightMap& map, std::int64_t j0, std::int64_t i0, float eye_m, std::int64_t beam,
          Each each) {
    float steepest = kLevel;
    for (std::int64_t k = beam * table.steps; k < (beam + 1) * table.steps; ++k) {
        const std::int64_t j = j0 + table.dj[k], i = i0 + table.di[k];
        if (j < 0 || j >= map.rows || i < 0 || i >= map.columns) return;
        const std::int64_t cell = j * map.columns + i;
        const float slope = (map.height_m[cell] - eye_m) * table.inverse_pm[k];
        each(cell, table.share[k], slope >= steepest - kSlopeTolerance);
        const float hides = kVeiled ? slope + map.veil[cell] : slope;
        steepest = hides > steepest ? hides : steepest;
    }
}

// The window of `width` beams with the largest sum, the first of equal ones; `heading` is set to its middle beam.
inline std::int32_t best_window(const std::int32_t* fresh, std::int64_t beams, std::int64_t width, std::int32_t* heading) {
    const std::int64_t half = width / 2;
    std::int32_t sum = 0;
    for (std::int64_t t = -half; t < width - half; ++t) sum += fresh[t < 0 ? t + beams : t];
    std::int32_t best = sum;
    *heading = 0;
    for (std::int64_t t = 1; t < beams; ++t) {
        sum += fresh[(t + width - half - 1) % beams] - fresh[(t - half - 1 + beams) % beams];
        if (sum <= best) continue;
        best = sum;
        *heading = static_cast<std::int32_t>(t);
    }
    return best;
}

// Each node alone, beam by beam. fresh_of_beam: workspace (beams,). Returns false if cancelled.
template <bool kVeiled, bool kFresh>
bool visibility_scalar(const BeamTable& table, const SightMap& map, const SightQuestion& asked, std::int32_t* fresh_of_beam,
                       const SightControl& control, const SightSums& sums) {
    for (std::int64_t node = 0; node < map.rows * map.columns; ++node) {
        if (control.cancelled()) return false;
        control.advance(1);
        if (asked.where && !asked.where[node]) continue;
        const float eye_m = map.height_m[node] + asked.eye_m;
        std::int32_t seen = 0, in_range = 0;
        for (std::int64_t t = 0; t < table.beams; ++t) {
            std::int32_t fresh = 0;
            if (!asked.first || in_sector(t, asked.first[node], asked.width, table.beams))
                walk<kVeiled>(table, map, node / map.columns, node % map.columns, eye_m, t,
                              [&](std::int64_t cell, std::int32_t share, bool visible) {
                                  const std::int32_t sees = visible ? share : 0;
                                  in_range += share;
                                  seen += sees;
                                  if constexpr (kFresh) fresh += sees & map.target[cell];
                              });
            if constexpr (kFresh) fresh_of_beam[t] = fresh;
        }
        sums.seen[node] = seen;
        sums.in_range[node] = in_range;
        if constexpr (kFresh)
            sums.fresh[node] = best_window(fresh_of_beam, table.beams, asked.heading_width, sums.heading + node);
    }
    return true;
}

struct NodeSums {
    std::int32_t seen, in_range;
};

// One observer: sets 1 in `seen` (rows, columns; zeros before) for each cell of which a sample is visible.
template <bool kVeiled>
NodeSums view_from(const BeamTable& table, const SightMap& map, std::int64_t node, const SightQuestion& asked,
                   std::uint8_t* seen) {
    NodeSums sums{0, 0};
    const float eye_m = map.height_m[node] + asked.eye_m;
    for (std::int64_t t = 0; t < table.beams; ++t) {
        if (asked.first && !in_sector(t, asked.first[0], asked.width, table.beams)) continue;
        walk<kVeiled>(table, map, node / map.columns, node % map.columns, eye_m, t,
                      [&](std::int64_t cell, std::int32_t share, bool visible) {
                          sums.in_range += share;
                          if (!visible) return;
                          sums.seen += share;
                          seen[cell] = 1;
                      });
    }
    return sums;
}

}  // namespace eldorado
