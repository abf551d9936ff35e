// Products and equations of matrices with a fixed order of every sum: the same bits on every processor and build.
// Matrices are contiguous rows.
#pragma once

#include <cmath>
#include <cstddef>
#include <utility>

namespace eldorado {

// (n, k) times (k, m): each sum from its first term to its last.
inline void product(const double* a, const double* b, double* to, std::size_t n, std::size_t k, std::size_t m) {
    for (std::size_t row = 0; row < n; ++row, a += k, to += m) {
        for (std::size_t column = 0; column < m; ++column) to[column] = k ? a[0] * b[column] : 0.0;
        for (std::size_t term = 1; term < k; ++term)
            for (std::size_t column = 0; column < m; ++column) to[column] += a[term] * b[term * m + column];
    }
}

// (n, 3) times (3, 3): rotated points.
inline void turned(const double* a, const double* b, double* to, std::size_t n) {
    for (std::size_t row = 0; row < n; ++row, a += 3, to += 3)
        for (std::size_t column = 0; column < 3; ++column)
            to[column] = (a[0] * b[column] + a[1] * b[3 + column]) + a[2] * b[6 + column];
}

// Solves a x = b by Gauss with the largest pivot of each column; a (n, n) is overwritten, b (n, m) becomes x. Returns
// false if a pivot is 0 or not a number.
inline bool solve(double* a, double* b, std::size_t n, std::size_t m) {
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t best = k;
        for (std::size_t row = k + 1; row < n; ++row)
            if (std::abs(a[row * n + k]) > std::abs(a[best * n + k])) best = row;
        const double pivot = a[best * n + k];
        if (!(std::abs(pivot) > 0.0)) return false;
        if (best != k) {
            for (std::size_t column = k; column < n; ++column) std::swap(a[best * n + column], a[k * n + column]);
            for (std::size_t column = 0; column < m; ++column) std::swap(b[best * m + column], b[k * m + column]);
        }
        for (std::size_t row = k + 1; row < n; ++row) {
            const double share = a[row * n + k] / pivot;
            for (std::size_t column = k + 1; column < n; ++column) a[row * n + column] -= share * a[k * n + column];
            for (std::size_t column = 0; column < m; ++column) b[row * m + column] -= share * b[k * m + column];
        }
    }
    for (std::size_t k = n; k-- > 0;)
        for (std::size_t column = 0; column < m; ++column) {
            double rest = b[k * m + column];
            for (std::size_t known = k + 1; known < n; ++known) rest -= a[k * n + known] * b[known * m + column];
            b[k * m + column] = rest / a[k * n + k];
        }
    return true;
}

}  // namespace eldorado
