// Binding of the visibility kernels.
#pragma once

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include <optional>

#include "bind.hpp"
#include "visibility_total.hpp"

namespace eldorado {

template <typename T>
using Layer = Array<T, 2>;
template <typename T>
using MaybeLayer = std::optional<Layer<T>>;

template <typename T>
T* data_of(const MaybeLayer<T>& layer) {
    return layer ? layer->data() : nullptr;
}

static BeamTable beam_table(const Layer<const std::int32_t>& dj, const Layer<const std::int32_t>& di,
                            const Layer<const float>& inverse_pm, const Layer<const std::int32_t>& share) {
    return {static_cast<std::int64_t>(dj.shape(0)),
            static_cast<std::int64_t>(dj.shape(1)),
            dj.data(),
            di.data(),
            inverse_pm.data(),
            share.data()};
}

template <bool kVeiled, bool kFresh>
struct TotalSpace {
    std::vector<float> height_m, veil;
    std::vector<std::int32_t> target, offset, before, reach_i, reach_j, area, fresh;

    TotalSpace(const BeamTable& table, const SightMap& map) {
        const std::size_t cells = PaddedSize(map.rows, map.columns).cells, starts = table.beams * (table.steps + 1);
        height_m.resize(cells), veil.resize(kVeiled ? cells : 0), target.resize(kFresh ? cells : 0);
        offset.resize(table.beams * table.steps), before.resize(starts), reach_i.resize(starts), reach_j.resize(starts);
        area.resize((2 * table.steps + 2) * (2 * table.steps + 2));
        fresh.resize(kFresh ? table.beams * kTile * kRows : 0);
    }

    SightWork work() {
        return {height_m.data(), veil.data(),    target.data(), offset.data(), before.data(),
                reach_i.data(),  reach_j.data(), area.data(),   fresh.data()};
    }
};

struct RunTotal {
    template <bool kVeiled, bool kFresh>
    static bool run(const BeamTable& table, const SightMap& map, const SightQuestion& asked, const SightControl& control,
                    const SightSums& sums) {
        TotalSpace<kVeiled, kFresh> space(table, map);
        return TotalVisibility<kVeiled, kFresh>(table, map, asked, space.work(), sums).run(control);
    }
};

struct RunScalar {
    template <bool kVeiled, bool kFresh>
    static bool run(const BeamTable& table, const SightMap& map, const SightQuestion& asked, const SightControl& control,
                    const SightSums& sums) {
        std::vector<std::int32_t> fresh_of_beam(table.beams);
        return visibility_scalar<kVeiled, kFresh>(table, map, asked, fresh_of_beam.data(), control, sums);
    }
};

template <typename Run>
static bool visibility_into(Layer<const std::int32_t> dj, Layer<const std::int32_t> di, Layer<const float> inverse_pm,
                            Layer<const std::int32_t> share, Layer<const float> height_m, MaybeLayer<const float> veil,
                            MaybeLayer<const std::int32_t> target, float eye_m, MaybeLayer<const std::uint8_t> where,
                            MaybeLayer<const std::int32_t> first, std::int64_t width, std::int64_t heading_width,
                            Layer<std::int32_t> seen, Layer<std::int32_t> in_range, MaybeLayer<std::int32_t> fresh,
                            MaybeLayer<std::int32_t> heading, Array<std::int64_t, 1> done,
                            Array<const std::uint8_t, 1> cancel) {
    const BeamTable table = beam_table(dj, di, inverse_pm, share);
    const SightMap map{static_cast<std::int64_t>(height_m.shape(0)), static_cast<std::int64_t>(height_m.shape(1)),
                       height_m.data(), data_of(veil), data_of(target)};
    const SightQuestion asked{eye_m, data_of(where), data_of(first), width, heading_width};
    const SightControl control{done.data(), cancel.data()};
    const SightSums sums{seen.data(), in_range.data(), data_of(fresh), data_of(heading)};
    nb::gil_scoped_release unlocked;
    if (map.target)
        return map.veil ? Run::template run<true, true>(table, map, asked, control, sums)
                        : Run::template run<false, true>(table, map, asked, control, sums);
    return map.veil ? Run::template run<true, false>(table, map, asked, control, sums)
                    : Run::template run<false, false>(table, map, asked, control, sums);
}

static std::pair<std::int32_t, std::int32_t> view_from_into(Layer<const std::int32_t> dj, Layer<const std::int32_t> di,
                                                            Layer<const float> inverse_pm, Layer<const std::int32_t> share,
                                                            Layer<const float> height_m, MaybeLayer<const float> veil,
                                                            std::int64_t node, float eye_m, std::int32_t first,
                                                            std::int64_t width, Layer<std::uint8_t> seen) {
    const BeamTable table = beam_table(dj, di, inverse_pm, share);
    const SightMap map{static_cast<std::int64_t>(height_m.shape(0)), static_cast<std::int64_t>(height_m.shape(1)),
                       height_m.data(), data_of(veil), nullptr};
    const SightQuestion asked{eye_m, nullptr, &first, width, 0};
    nb::gil_scoped_release unlocked;
    const NodeSums sums = map.veil ? view_from<true>(table, map, node, asked, seen.data())
                                   : view_from<false>(table, map, node, asked, seen.data());
    return {sums.seen, sums.in_range};
}

static std::pair<std::int64_t, std::int64_t> repeat_first_beam(Layer<const std::int32_t> dj, Layer<const std::int32_t> di,
                                                               Layer<const float> inverse_pm,
                                                               Layer<const std::int32_t> share, Layer<const float> height_m,
                                                               float eye_m, std::int64_t times) {
    const BeamTable table = beam_table(dj, di, inverse_pm, share);
    const SightMap map{static_cast<std::int64_t>(height_m.shape(0)), static_cast<std::int64_t>(height_m.shape(1)),
                       height_m.data(), nullptr, nullptr};
    nb::gil_scoped_release unlocked;
    TotalSpace<false, false> space(table, map);
    const SightQuestion asked{eye_m, nullptr, nullptr, table.beams, 1};
    return TotalVisibility<false, false>(table, map, asked, space.work(), SightSums{}).repeat_first_beam(times);
}

inline void bind_visibility(nb::module_& m) {
    const auto bind = [&m](const char* name, auto function) {
        m.def(name, function, "dj"_a, "di"_a, "inverse_pm"_a, "share"_a, "height_m"_a, "veil"_a.none(), "target"_a.none(),
              "eye_m"_a, "where"_a.none(), "first"_a.none(), "width"_a, "heading_width"_a, "seen"_a, "in_range"_a,
              "fresh"_a.none(), "heading"_a.none(), "done"_a, "cancel"_a);
    };
    bind("visibility_total_into", &visibility_into<RunTotal>);
    bind("visibility_scalar_into", &visibility_into<RunScalar>);
    m.def("view_from_into", &view_from_into, "dj"_a, "di"_a, "inverse_pm"_a, "share"_a, "height_m"_a, "veil"_a.none(),
          "node"_a, "eye_m"_a, "first"_a, "width"_a, "seen"_a);
    m.def("repeat_first_beam", &repeat_first_beam, "dj"_a, "di"_a, "inverse_pm"_a, "share"_a, "height_m"_a, "eye_m"_a,
          "times"_a);
}

}  // namespace eldorado
