// The distance transform for Python.
#pragma once

#include <memory>

#include "bind.hpp"
#include "grid_search.hpp"

namespace eldorado {

static bool distance_into(Array<const std::uint8_t, 2> free, Array<const std::uint8_t, 2> goals, nb::object closeness,
                          double cell_m, double dearest, Array<std::int64_t, 1> progress,
                          Array<const std::uint8_t, 1> cancel, Array<double, 2> cost) {
    const bool soft = !closeness.is_none();
    Array<const float, 2> ratios;
    if (soft) ratios = nb::cast<Array<const float, 2>>(closeness);
    std::int64_t count = 4;
    while (static_cast<double>(count) < dearest + 2.0) count *= 2;
    const GridProblem problem{static_cast<std::int64_t>(free.shape(0)), static_cast<std::int64_t>(free.shape(1)),
                              free.data(), goals.data(), soft ? ratios.data() : nullptr, cell_m};
    nb::gil_scoped_release unlocked;
    const auto blocks_needed = static_cast<std::size_t>(GridSearch::blocks_needed(problem, count));
    const std::unique_ptr<GridBlock[]> blocks(new GridBlock[blocks_needed]);  // memory untouched until it is used
    std::vector<GridBucket> buckets(static_cast<std::size_t>(count));
    const GridWork work{blocks.get(), buckets.data(), count, progress.data(), cancel.data()};
    return GridSearch(problem, work, cost.data()).run();
}

inline void bind_grid_search(nb::module_& m) {
    m.def("distance_into", &distance_into, "free"_a, "goals"_a, "closeness"_a.none(), "cell_m"_a, "dearest"_a,
          "progress"_a, "cancel"_a, "cost"_a);
}

}  // namespace eldorado
