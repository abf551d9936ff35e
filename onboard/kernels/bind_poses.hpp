// Binding of pose freedom, closeness and reachable poses.
#pragma once

#include <memory>

#include "bind.hpp"
#include "closeness.hpp"
#include "pose_freedom.hpp"
#include "reachable.hpp"

namespace eldorado {

static void pose_freedom_into(Array<const std::uint8_t, 2> cell_class, Array<const float, 2> z_mean,
                              Array<const float, 2> z_top, Array<const float, 2> z_bot, Array<const float, 2> z_ray,
                              Array<const std::int32_t, 3> wheels, Array<const std::int32_t, 2> body, std::int64_t reach,
                              std::int64_t half, double least_cells, double level_m, double step_m,
                              double steepest_per_cell_m, double tilt_ratio, double slope_ratio, double belly_m,
                              double cell_m, Array<std::uint8_t, 3> freedom) {
    const auto rows = static_cast<std::int64_t>(z_mean.shape(0)), columns = static_cast<std::int64_t>(z_mean.shape(1));
    const PlaneProblem plane{rows, columns, cell_class.data(), z_mean.data(), half, least_cells, level_m};
    const GroundProblem problem{plane, z_top.data(), z_bot.data(), z_ray.data(), step_m, steepest_per_cell_m};
    const Footprint print{wheels.data(), body.data(), static_cast<std::int64_t>(body.shape(0))};
    const PoseLimits limits{static_cast<float>(tilt_ratio), static_cast<float>(slope_ratio),
                            static_cast<float>(belly_m), static_cast<float>(cell_m)};
    nb::gil_scoped_release unlocked;
    const auto padded = static_cast<std::size_t>(Ground::padded(rows, columns, reach));
    const std::unique_ptr<float[]> layers(new float[5 * padded]);
    const std::unique_ptr<std::int32_t[]> flags(new std::int32_t[padded]);
    const std::unique_ptr<double[]> sums(new double[static_cast<std::size_t>(PlaneFit::needed(plane))]);
    float* const z = layers.get();
    float *const top = z + padded, *const bot = top + padded, *const ray = bot + padded, *const over = ray + padded;
    const Ground ground{rows, columns, reach, z, top, bot, ray, over, flags.get()};
    GroundRules(problem, ground).run(sums.get());
    const std::unique_ptr<CellUnder[]> under(new CellUnder[static_cast<std::size_t>(PoseFreedom::needed(print))]);
    PoseFreedom(ground, print, limits, under.get()).run(freedom.data());
}

static void closeness_into(Array<const std::uint8_t, 3> freedom, Array<const float, 1> falloff, std::int64_t reach,
                           double touching, Array<float, 3> ratio) {
    const ClosenessProblem problem{static_cast<std::int64_t>(freedom.shape(1)),
                                   static_cast<std::int64_t>(freedom.shape(2)),
                                   freedom.data(), falloff.data(), reach, static_cast<float>(touching)};
    nb::gil_scoped_release unlocked;
    std::vector<std::uint16_t> apart(freedom.shape(1) * (freedom.shape(2) + 2 * static_cast<std::size_t>(reach)));
    std::vector<std::uint16_t> nearest(freedom.shape(2));
    Closeness(problem, {apart.data(), nearest.data()}).run(ratio.data());
}

static void reachable_into(Array<const std::uint8_t, 3> freedom, int free, std::int64_t j, std::int64_t i, int o,
                           Array<std::uint8_t, 3> reached) {
    const auto rows = static_cast<std::int64_t>(freedom.shape(1)), columns = static_cast<std::int64_t>(freedom.shape(2));
    nb::gil_scoped_release unlocked;
    const auto cells = static_cast<std::size_t>(Reachable::cells_needed(rows, columns));
    std::vector<std::uint8_t> bytes(3 * cells);
    const std::unique_ptr<std::int32_t[]> stack(new std::int32_t[cells]);
    const ReachableWork work{bytes.data(), bytes.data() + cells, bytes.data() + 2 * cells, stack.get()};
    Reachable(rows, columns, work).run(freedom.data(), static_cast<std::uint8_t>(free), j, i, o, reached.data());
}

inline void bind_poses(nb::module_& m) {
    m.def("pose_freedom_into", &pose_freedom_into, "cell_class"_a, "z_mean"_a, "z_top"_a, "z_bot"_a, "z_ray"_a,
          "wheels"_a, "body"_a, "reach"_a, "half"_a, "least_cells"_a, "level_m"_a, "step_m"_a, "steepest_per_cell_m"_a,
          "tilt_ratio"_a, "slope_ratio"_a, "belly_m"_a, "cell_m"_a, "freedom"_a);
    m.def("closeness_into", &closeness_into, "freedom"_a, "falloff"_a, "reach"_a, "touching"_a, "ratio"_a);
    m.def("reachable_into", &reachable_into, "freedom"_a, "free"_a, "j"_a, "i"_a, "o"_a, "reached"_a);
}

}  // namespace eldorado
