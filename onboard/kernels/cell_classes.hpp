// Class of each cell from its beams, and de-biased bounds of its height. The rules and their reasons are in
// onboard/perception/map/cell_classes.py. No Python types, no exceptions, no heap.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace eldorado {

enum CellClass : std::uint8_t { kOutside, kOccluded, kHit, kFilled, kHole, kAssumed };  // records.CellClass

struct CellRules {
    std::int64_t fill_cells;
    double ray_margin_m, fill_above_m, hole_depth_m, fill_step_m, fill_step_per_cell_m;
    // Distance of the bounds of n hits from their mean by noise alone, in sigmas, n = 0 ... counts - 1; the last for
    // more.
    const double* spread;
    std::int64_t counts;
};

// Layers of records.Ldem, (rows, columns).
struct CellStatistics {
    std::int64_t rows, columns;
    const std::int32_t* n;
    const double* sum_z;
    const float *z_hi, *z_lo, *sum_sigma, *z_ray, *assumed_z;
};

// Layers of records.Surface, (rows, columns).
struct CellSurface {
    std::uint8_t* cell_class;
    float *z_mean, *z_top, *z_bot;
};

// The larger and the smaller of two, NaN if one is.
template <typename T>
T larger_or_nan(T a, T b) { return a >= b || a != a ? a : b; }
template <typename T>
T smaller_or_nan(T a, T b) { return a <= b || a != a ? a : b; }

class CellClassifier {
   public:
    // `mean`: workspace of rows * columns.
    CellClassifier(const CellStatistics& cells, const CellRules& rules, double* mean) : c_(cells), r_(rules), mean_(mean) {}

    void run(const CellSurface& out) {
        const std::int64_t count = c_.rows * c_.columns;
        for (std::int64_t at = 0; at < count; ++at)
            mean_[at] = c_.n[at] > 0 ? c_.sum_z[at] / c_.n[at] : std::numeric_limits<double>::quiet_NaN();
        for (std::int64_t j = 0, at = 0; j < c_.rows; ++j)
            for (std::int64_t i = 0; i < c_.columns; ++i, ++at) {
                if (c_.n[at] > 0) bound(at, out);
                else guess(j, i, out);
            }
    }

   private:
    void bound(std::int64_t at, const CellSurface& out) const {
        const std::int32_t n = c_.n[at];
        const double bias = c_.sum_sigma[at] / static_cast<double>(n) * r_.spread[std::min<std::int64_t>(n, r_.counts - 1)];
        const float low = smaller_or_nan(c_.z_lo[at], c_.z_ray[at] + static_cast<float>(r_.ray_margin_m));
        out.cell_class[at] = kHit;
        out.z_mean[at] = static_cast<float>(mean_[at]);
        out.z_top[at] = static_cast<float>(larger_or_nan(mean_[at], c_.z_hi[at] - bias));
        out.z_bot[at] = static_cast<float>(smaller_or_nan(mean_[at], low + bias));
    }

    // Sets a cell without a hit.
    void guess(std::int64_t j, std::int64_t i, const CellSurface& out) const {
        const std::int64_t at = j * c_.columns + i;
        const float ray = c_.z_ray[at];
        double height = std::numeric_limits<double>::quiet_NaN();
        CellClass kind = ray < std::numeric_limits<float>::infinity() ? between_hits(j, i, &height) : kOutside;
        if (kind == kOutside && std::isfinite(c_.assumed_z[at])) {
            kind = kAssumed;
            height = c_.assumed_z[at];
        } else if (kind == kOutside && std::isfinite(ray)) {
            kind = kOccluded;
        }
        out.cell_class[at] = kind;
        out.z_mean[at] = out.z_top[at] = out.z_bot[at] = static_cast<float>(height);
    }

    // kHole or kFilled with the height there, else kOutside. A hole found along one line overrides a fill along
    // another.
    CellClass between_hits(std::int64_t j, std::int64_t i, double* height) const {
        static constexpr std::int64_t kWays[4][2] = {{0, 1}, {1, 0}, {1, 1}, {1, -1}};
        const double ray = c_.z_ray[j * c_.columns + i];
        double total = 0.0;
        int count = 0;
        for (const auto& way : kWays) {
            const double middle = ground_between(j, i, way[0], way[1]);
            if (ray < middle - r_.hole_depth_m) {
                *height = ray;
                return kHole;
            }
            if (ray >= middle - r_.ray_margin_m && ray <= middle + r_.fill_above_m) {
                total += middle;
                ++count;
            }
        }
        if (count == 0) return kOutside;
        *height = total / count;
        return kFilled;
    }

    // Height at the cell on the line between the nearest hits on both sides; NaN if they are too far apart.
    double ground_between(std::int64_t j, std::int64_t i, std::int64_t dj, std::int64_t di) const {
        const std::int64_t at = j * c_.columns + i, step = dj * c_.columns + di;
        const std::int64_t before = nearest(at, -step, std::min(r_.fill_cells, room(j, i, -dj, -di)));
        if (before == 0) return std::numeric_limits<double>::quiet_NaN();
        const std::int64_t after = nearest(at, step, std::min(r_.fill_cells + 1 - before, room(j, i, dj, di)));
        if (after == 0) return std::numeric_limits<double>::quiet_NaN();
        const double low = mean_[at - before * step], high = mean_[at + after * step];
        const std::int64_t missing = before + after - 1;
        if (!(std::abs(high - low) <= r_.fill_step_m + r_.fill_step_per_cell_m * static_cast<double>(missing)))
            return std::numeric_limits<double>::quiet_NaN();
        return low + (high - low) * (static_cast<double>(before) / static_cast<double>(missing + 1));
    }

    // Steps to the nearest hit, at most `most`; 0 if there is none.
    std::int64_t nearest(std::int64_t at, std::int64_t step, std::int64_t most) const {
        for (std::int64_t k = 1; k <= most; ++k)
            if (std::isfinite(mean_[at + k * step])) return k;
        return 0;
    }

    // Steps to the border.
    std::int64_t room(std::int64_t j, std::int64_t i, std::int64_t dj, std::int64_t di) const {
        const std::int64_t rows = dj > 0 ? c_.rows - 1 - j : j, columns = di > 0 ? c_.columns - 1 - i : i;
        if (dj == 0) return columns;
        return di == 0 ? rows : std::min(rows, columns);
    }

    const CellStatistics c_;
    const CellRules r_;
    double* const mean_;
};

}  // namespace eldorado
