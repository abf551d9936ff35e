// Binding of the distance transform.
#pragma once

#include <memory>

#include "bind.hpp"
#include "grid_search.hpp"
#include "plain_search.hpp"

namespace eldorado {

using Cost = Array<double, 2>;

static bool search_plain(const GridProblem& problem, const GridWatch& watch, Cost& cost) {
    const auto cells = static_cast<std::size_t>(PlainSearch::cells_needed(problem));
    const std::unique_ptr<std::uint8_t[]> free(new std::uint8_t[cells]), around(new std::uint8_t[cells]);
    // Three lists of all cells: memory is untouched until it is used.
    const std::unique_ptr<std::int32_t[]> lists(new std::int32_t[3 * cells]);
    const PlainWork work{reinterpret_cast<std::uint64_t*>(cost.data()), free.get(), around.get(),
                         {lists.get(), lists.get() + cells, lists.get() + 2 * cells}, watch};
    return PlainSearch(problem, work).run();
}

static bool search_soft(const GridProblem& problem, double dearest, const GridWatch& watch, Cost& cost) {
    std::int64_t count = 4;
    while (static_cast<double>(count) < dearest + 2.0) count *= 2;
    const auto blocks_needed = static_cast<std::size_t>(GridSearch::blocks_needed(problem, count));
    const std::unique_ptr<GridBlock[]> blocks(new GridBlock[blocks_needed]);
    std::vector<GridBucket> buckets(static_cast<std::size_t>(count));
    return GridSearch(problem, {blocks.get(), buckets.data(), count, watch}, cost.data()).run();
}

static bool distance_into(Array<const std::uint8_t, 2> free, Array<const std::uint8_t, 2> goals, nb::object closeness,
                          double cell_m, double dearest, Array<std::int64_t, 1> progress,
                          Array<const std::uint8_t, 1> cancel, Cost cost) {
    const bool soft = !closeness.is_none();
    Array<const float, 2> ratios;
    if (soft) ratios = nb::cast<Array<const float, 2>>(closeness);
    const GridProblem problem{static_cast<std::int64_t>(free.shape(0)), static_cast<std::int64_t>(free.shape(1)),
                              free.data(), goals.data(), soft ? ratios.data() : nullptr, cell_m};
    const GridWatch watch{progress.data(), cancel.data()};
    nb::gil_scoped_release unlocked;
    return soft ? search_soft(problem, dearest, watch, cost) : search_plain(problem, watch, cost);
}

inline void bind_grid_search(nb::module_& m) {
    m.def("distance_into", &distance_into, "free"_a, "goals"_a, "closeness"_a.none(), "cell_m"_a, "dearest"_a,
          "progress"_a, "cancel"_a, "cost"_a);
}

}  // namespace eldorado
