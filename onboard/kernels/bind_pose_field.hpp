// Binding of the pose field.
#pragma once

#include <memory>

#include "bind.hpp"
#include "pose_field.hpp"

namespace eldorado {

static void cost_to_go_into(Array<const std::uint8_t, 3> freedom, int least_freedom, nb::object closeness,
                            Array<const float, 2> moves_m, double turn_m, double unit_m, std::int32_t width,
                            Array<const std::int64_t, 1> seeds, Array<const float, 1> seed_costs_m,
                            Array<float, 3> cost) {
    const bool soft = !closeness.is_none();
    Array<const float, 3> ratios;
    if (soft) ratios = nb::cast<Array<const float, 3>>(closeness);
    const auto rows = static_cast<std::int64_t>(freedom.shape(1)), columns = static_cast<std::int64_t>(freedom.shape(2));
    const PoseProblem problem{rows,
                              columns,
                              freedom.data(),
                              static_cast<std::uint8_t>(least_freedom),
                              soft ? ratios.data() : nullptr,
                              moves_m.data(),
                              turn_m,
                              seeds.data(),
                              seed_costs_m.data(),
                              static_cast<std::int64_t>(seeds.size())};
    nb::gil_scoped_release unlocked;
    const auto cells = static_cast<std::size_t>(PoseSearch::cells_needed(rows, columns));
    const std::unique_ptr<EightInts[]> costs(new EightInts[cells]);
    const std::unique_ptr<EightFloats[]> halves(soft ? new EightFloats[cells] : nullptr);
    const std::unique_ptr<std::int32_t[]> lists(new std::int32_t[3 * (cells + 1)]);
    const std::unique_ptr<std::uint8_t[]> in(new std::uint8_t[2 * cells]);
    const PoseWork work{costs.get(),
                        halves.get(),
                        {lists.get(), lists.get() + cells + 1, lists.get() + 2 * (cells + 1)},
                        {in.get(), in.get() + cells},
                        unit_m,
                        width};
    PoseSearch(problem, work, cost.data()).run();
}

inline void bind_pose_field(nb::module_& m) {
    m.def("cost_to_go_into", &cost_to_go_into, "freedom"_a, "least_freedom"_a, "closeness"_a.none(), "moves_m"_a, "turn_m"_a,
          "unit_m"_a, "width"_a, "seeds"_a, "seed_costs_m"_a, "cost"_a);
}

}  // namespace eldorado
