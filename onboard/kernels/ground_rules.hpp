// Layers of each cell for the pose rules: heights, steps, slope, known or not. The rules and their reasons are in
// onboard/planning/local/poses.py. No Python types, no exceptions, no heap.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "cell_classes.hpp"
#include "elementary.hpp"
#include "plane_fit.hpp"
#include "simd.hpp"

namespace eldorado {

// Layers of records.Surface, (rows, columns), and the limits.
struct GroundProblem {
    PlaneProblem plane;
    const float *z_top, *z_bot, *z_ray;
    double step_m, steepest_per_cell_m;
};

// Flags of a cell.
constexpr std::int32_t kKnown = 1;
constexpr std::int32_t kWhole = 2;   // the cell and its 8 neighbours are known
constexpr std::int32_t kSmooth = 4;  // the step over the known ones of them is within the limit
constexpr std::int32_t kGentle = 8;  // the fitted plane is within the limit

// Layers padded by `reach` >= 1 cells on all sides, unknown beyond the grid; a row has space for one vector more. The
// caller owns the memory, `padded` numbers each.
struct Ground {
    std::int64_t rows, columns, reach;
    float *z;          // height on which a wheel stands, NaN where unknown
    float *top, *bot;  // of known cells, -inf and +inf where unknown
    float* ray;        // lowest beam over an unknown cell, -inf where known
    float* over;       // the higher of `top` and `ray`
    std::int32_t* flags;

    static std::int64_t padded(std::int64_t rows, std::int64_t columns, std::int64_t reach) {
        return (rows + 2 * reach) * (columns + 2 * reach + kLanes);
    }
    std::int64_t stride() const { return columns + 2 * reach + kLanes; }
    std::int64_t at(std::int64_t j, std::int64_t i) const { return (j + reach) * stride() + i + reach; }
};

class GroundRules {
   public:
    GroundRules(const GroundProblem& problem, const Ground& ground) : p_(problem), g_(ground) {}

    // Fills the layers; `work`: PlaneFit::needed doubles.
    void run(double* work) const {
        spread();
        PlaneFit plane(p_.plane, work);
        for (std::int64_t j = 0; j < g_.rows; ++j) {
            plane.fit_row(j);
            for (std::int64_t i = 0; i < g_.columns; i += kLanes) mark(plane, j, i);
        }
    }

   private:
    void spread() const {
        const std::int64_t size = Ground::padded(g_.rows, g_.columns, g_.reach);
        constexpr float kHigh = std::numeric_limits<float>::infinity(), kNone = std::numeric_limits<float>::quiet_NaN();
        std::fill(g_.z, g_.z + size, kNone);
        std::fill(g_.top, g_.top + size, -kHigh);
        std::fill(g_.bot, g_.bot + size, kHigh);
        std::fill(g_.ray, g_.ray + size, kHigh);
        std::fill(g_.over, g_.over + size, kHigh);
        std::fill(g_.flags, g_.flags + size, kSmooth | kGentle);
        for (std::int64_t j = 0; j < g_.rows; ++j)
            for (std::int64_t i = 0; i < g_.columns; ++i) {
                const std::int64_t from = j * g_.columns + i, to = g_.at(j, i);
                const bool known = p_.plane.cell_class[from] >= kHit;
                g_.z[to] = known ? p_.plane.z_mean[from] : kNone;
                g_.top[to] = known ? p_.z_top[from] : -kHigh;
                g_.bot[to] = known ? p_.z_bot[from] : kHigh;
                g_.ray[to] = known ? -kHigh : p_.z_ray[from];
                g_.over[to] = known ? std::max(-kHigh, p_.z_top[from]) : std::min(kHigh, p_.z_ray[from]);  // not NaN
                g_.flags[to] |= known ? kKnown : 0;
            }
    }

    // Flags of kLanes cells of row j from column i on.
    void mark(const PlaneFit& plane, std::int64_t j, std::int64_t i) const {
        const std::int64_t at = g_.at(j, i), stride = g_.stride();
        Floats high = load(g_.top + at), low = load(g_.bot + at);
        Ints known = load(g_.flags + at);
        for (const std::int64_t row : {-stride, std::int64_t{0}, stride})
            for (const std::int64_t by : {row - 1, row, row + 1}) {
                high = larger(load(g_.top + at + by), high);
                low = smaller(load(g_.bot + at + by), low);
                known &= load(g_.flags + at + by);
            }
        const Ints stepped = high - low > static_cast<float>(0.999 * p_.step_m);  // in float: cells to examine further
        for (int lane = 0; lane < kLanes && i + lane < g_.columns; ++lane) {
            const double x = plane.slope_x(i + lane), y = plane.slope_y(i + lane), limit = p_.steepest_per_cell_m;
            std::int32_t& flags = g_.flags[at + lane];
            if (known[lane] & kKnown) flags |= kWhole;
            if (stepped[lane] && step(at + lane, 0.0, 0.0) > p_.step_m && step(at + lane, x, y) > p_.step_m)
                flags &= ~kSmooth;
            if (std::abs(x) + std::abs(y) > limit && elementary::hypot(x, y) > limit) flags &= ~kGentle;
        }
    }

    // Difference of highest and lowest known height of a cell and its 8 neighbours, a plane of these slopes subtracted.
    double step(std::int64_t at, double slope_x, double slope_y) const {
        const std::int64_t stride = g_.stride();
        double high = -std::numeric_limits<double>::infinity(), low = -high;
        for (int dj = -1; dj <= 1; ++dj)
            for (int di = -1; di <= 1; ++di) {
                const double plane = dj * slope_y + di * slope_x;
                high = std::max(high, g_.top[at + dj * stride + di] - plane);
                low = std::min(low, g_.bot[at + dj * stride + di] - plane);
            }
        return high - low;
    }

    const GroundProblem p_;
    const Ground g_;
};

}  // namespace eldorado
