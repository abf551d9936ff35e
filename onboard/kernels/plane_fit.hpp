// The plane fitted to the known cells around each cell. No Python types, no exceptions, no heap.
//
// Sums over the window go along the rows first, then along the columns.
#pragma once

#include <algorithm>
#include <cstdint>

#include "cell_classes.hpp"

namespace eldorado {

struct PlaneProblem {
    std::int64_t rows, columns;
    const std::uint8_t* cell_class;  // (rows, columns), known from kHit on
    const float* z_mean;             // (rows, columns)
    std::int64_t half;               // the window is 2 half + 1 cells wide
    double least_cells;              // a plane needs so many known ones
    double level_m;                  // a height near those of the ground: sums of what is over it lose no digits
};

class PlaneFit {
   public:
    // Doubles of the workspace.
    static std::int64_t needed(const PlaneProblem& p) {
        const std::int64_t padded = (p.rows + 2 * p.half) * p.columns;
        return 2 * (p.columns + 2 * p.half) + kAlongRow * padded + (kMoments + 2) * p.columns;
    }

    PlaneFit(const PlaneProblem& problem, double* work) : p_(problem) {
        const std::int64_t row = p_.columns + 2 * p_.half, padded = (p_.rows + 2 * p_.half) * p_.columns;
        std::fill(work, work + needed(p_), 0.0);
        known_ = work;
        height_ = known_ + row;
        for (int k = 0; k < kAlongRow; ++k) along_row_[k] = height_ + row + k * padded;
        for (int k = 0; k < kMoments; ++k) moment_[k] = along_row_[kAlongRow - 1] + padded + k * p_.columns;
        slope_x_ = moment_[kMoments - 1] + p_.columns;
        slope_y_ = slope_x_ + p_.columns;
        for (std::int64_t j = 0; j < p_.rows; ++j) sum_row(j);
    }

    // Least squares at each cell of row j.
    void fit_row(std::int64_t j) {
        const std::int64_t at = (p_.half + j) * p_.columns, step = p_.columns;
        correlate<kFlat>(along_row_[0] + at, step, moment_[0]);
        correlate<kFlat>(along_row_[1] + at, step, moment_[1]);
        correlate<kRamp>(along_row_[0] + at, step, moment_[2]);
        correlate<kFlat>(along_row_[2] + at, step, moment_[3]);
        correlate<kSquare>(along_row_[0] + at, step, moment_[4]);
        correlate<kRamp>(along_row_[1] + at, step, moment_[5]);
        correlate<kFlat>(along_row_[3] + at, step, moment_[6]);
        correlate<kFlat>(along_row_[4] + at, step, moment_[7]);
        correlate<kRamp>(along_row_[3] + at, step, moment_[8]);
        for (std::int64_t i = 0; i < p_.columns; ++i) {
            const double n = std::max(moment_[0][i], 1.0);
            const double x = moment_[1][i] / n, y = moment_[2][i] / n, z = moment_[6][i] / n;
            const double xx = moment_[3][i] / n - x * x, yy = moment_[4][i] / n - y * y, xy = moment_[5][i] / n - x * y;
            const double xz = moment_[7][i] / n - x * z, yz = moment_[8][i] / n - y * z;
            const double area = xx * yy - xy * xy;
            const bool fits = n >= p_.least_cells && area > 0.1;
            slope_x_[i] = fits ? (xz * yy - yz * xy) / area : 0.0;
            slope_y_[i] = fits ? (yz * xx - xz * xy) / area : 0.0;
        }
    }

    // Metres per cell along +x and +y at a cell of the row fitted last, 0 without a fit.
    double slope_x(std::int64_t i) const { return slope_x_[i]; }
    double slope_y(std::int64_t i) const { return slope_y_[i]; }

   private:
    static constexpr int kAlongRow = 5, kMoments = 9;
    static constexpr int kFlat = 0, kRamp = 1, kSquare = 2;  // weights k^0, k^1, k^2

    // out[i] = sum of weight(k) * in[i + k * step], k from -half to half, added in the order of scipy's correlate1d.
    template <int kWeight>
    void correlate(const double* in, std::int64_t step, double* out) const {
        for (std::int64_t i = 0; i < p_.columns; ++i) out[i] = in[i] * (kWeight == kFlat ? 1.0 : 0.0);
        for (std::int64_t k = p_.half; k > 0; --k) {
            const auto steps = static_cast<double>(k);
            const double weight = kWeight == kFlat ? 1.0 : kWeight == kRamp ? -steps : steps * steps;
            const double *const before = in - k * step, *const after = in + k * step;
            for (std::int64_t i = 0; i < p_.columns; ++i)
                out[i] += (kWeight == kRamp ? before[i] - after[i] : before[i] + after[i]) * weight;
        }
    }

    // Sums along row j: of known cells times 1, x, x^2, of heights times 1, x.
    void sum_row(std::int64_t j) {
        for (std::int64_t i = 0; i < p_.columns; ++i) {
            const std::int64_t at = j * p_.columns + i;
            const bool known = p_.cell_class[at] >= kHit;
            known_[p_.half + i] = known ? 1.0 : 0.0;
            height_[p_.half + i] = ((known ? p_.z_mean[at] : 0.0f) - p_.level_m) * known_[p_.half + i];
        }
        const std::int64_t to = (p_.half + j) * p_.columns;
        correlate<kFlat>(known_ + p_.half, 1, along_row_[0] + to);
        correlate<kRamp>(known_ + p_.half, 1, along_row_[1] + to);
        correlate<kSquare>(known_ + p_.half, 1, along_row_[2] + to);
        correlate<kFlat>(height_ + p_.half, 1, along_row_[3] + to);
        correlate<kRamp>(height_ + p_.half, 1, along_row_[4] + to);
    }

    const PlaneProblem p_;
    double *known_, *height_, *along_row_[kAlongRow], *moment_[kMoments], *slope_x_, *slope_y_;
};

}  // namespace eldorado
