// The plane fitted to the known cells around each cell. No Python types, no exceptions, no heap.
//
// Sums over the window go along the rows first, then along the columns.
#pragma once

#include <algorithm>
#include <cstdint>

#include "cell_classes.hpp"
#include "simd.hpp"

namespace eldorado {

struct PlaneProblem {
    std::int64_t rows, columns;
    const std::uint8_t* cell_class;  // (rows, columns), known from kHit on
    const float* z_mean;             // (rows, columns)
    std::int64_t half;               // the window is 2 half + 1 cells wide
    double least_cells;              // known cells that a plane needs
    double level_m;                  // a height near those of the ground: sums relative to it lose no digits
};

class PlaneFit {
   public:
    // Size of the workspace, doubles.
    static std::int64_t needed(const PlaneProblem& p) {
        return kAlongRow * (p.rows + 2 * p.half) * width(p) + 2 * (width(p) + 2 * p.half) + 2 * width(p);
    }

    PlaneFit(const PlaneProblem& problem, double* work) : p_(problem), width_(width(problem)) {
        std::fill(work, work + needed(p_), 0.0);
        for (double*& layer : along_row_) layer = work, work += (p_.rows + 2 * p_.half) * width_;
        known_ = work;
        height_ = known_ + width_ + 2 * p_.half;
        slope_x_ = height_ + width_ + 2 * p_.half;
        slope_y_ = slope_x_ + width_;
        for (std::int64_t j = 0; j < p_.rows; ++j) sum_row(j);
    }

    // Least squares at each cell of row j.
    void fit_row(std::int64_t j) {
        for (std::int64_t i = 0; i < p_.columns; i += kPairs) {
            const std::int64_t at = (p_.half + j) * width_ + i;
            const Sums of_1 = sums(along_row_[0] + at, width_), of_x = sums(along_row_[1] + at, width_);
            const Sums of_xx = sums(along_row_[2] + at, width_);
            const Sums of_z = sums(along_row_[3] + at, width_), of_xz = sums(along_row_[4] + at, width_);
            const Doubles n = of_1.flat > 1.0 ? of_1.flat : Doubles{} + 1.0;
            const Doubles x = of_x.flat / n, y = of_1.ramp / n, z = of_z.flat / n;
            const Doubles xx = of_xx.flat / n - x * x, yy = of_1.square / n - y * y, xy = of_x.ramp / n - x * y;
            const Doubles xz = of_xz.flat / n - x * z, yz = of_z.ramp / n - y * z;
            const Doubles area = xx * yy - xy * xy;
            const Longs fits = (n >= p_.least_cells) & (area > 0.1);
            store(slope_x_ + i, fits ? (xz * yy - yz * xy) / area : Doubles{});
            store(slope_y_ + i, fits ? (yz * xx - xz * xy) / area : Doubles{});
        }
    }

    // Metres per cell along +x and +y at a cell of the row fitted last, 0 without a fit.
    double slope_x(std::int64_t i) const { return slope_x_[i]; }
    double slope_y(std::int64_t i) const { return slope_y_[i]; }

   private:
    static constexpr int kAlongRow = 5;

    // Sums over a window: of its numbers, of them times k, of them times k^2, with k from the middle.
    struct Sums {
        Doubles flat, ramp, square;
    };

    // A row has space for complete vectors.
    static std::int64_t width(const PlaneProblem& p) { return (p.columns + kPairs - 1) / kPairs * kPairs; }

    // k is the number of steps from in[0], from -half to half, added in the order of scipy's correlate1d.
    __attribute__((always_inline)) Sums sums(const double* in, std::int64_t step) const {
        Sums sum{load(in), load(in) * 0.0, load(in) * 0.0};  // an infinite height gives no plane
        for (std::int64_t k = p_.half; k > 0; --k) {
            const Doubles before = load(in - k * step), after = load(in + k * step);
            const auto steps = static_cast<double>(k);
            sum.flat += before + after;
            sum.ramp += (before - after) * -steps;
            sum.square += (before + after) * (steps * steps);
        }
        return sum;
    }

    // Sums along row j: of known cells times 1, x, x^2, of heights times 1, x.
    void sum_row(std::int64_t j) {
        for (std::int64_t i = 0; i < p_.columns; ++i) {
            const std::int64_t at = j * p_.columns + i;
            const bool known = p_.cell_class[at] >= kHit;
            known_[p_.half + i] = known ? 1.0 : 0.0;
            height_[p_.half + i] = ((known ? p_.z_mean[at] : 0.0f) - p_.level_m) * known_[p_.half + i];
        }
        for (std::int64_t i = 0; i < p_.columns; i += kPairs) {
            const std::int64_t to = (p_.half + j) * width_ + i;
            const Sums of_1 = sums(known_ + p_.half + i, 1), of_z = sums(height_ + p_.half + i, 1);
            store(along_row_[0] + to, of_1.flat);
            store(along_row_[1] + to, of_1.ramp);
            store(along_row_[2] + to, of_1.square);
            store(along_row_[3] + to, of_z.flat);
            store(along_row_[4] + to, of_z.ramp);
        }
    }

    const PlaneProblem p_;
    const std::int64_t width_;
    double *known_, *height_, *along_row_[kAlongRow], *slope_x_, *slope_y_;
};

}  // namespace eldorado
